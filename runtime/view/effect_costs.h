// What each effect of a view costs: the picture's time as it is less that of the same picture without the effect.
#pragma once

#include "format/pack_image.h"
#include "format/result.h"
#include "runtime/tracer.h"
#include "runtime/view/picture_turns.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace trimray {

/// The items of an effect plan (effect_plan.h) that a person can turn off, in the plan's order.
std::vector<std::string> removable_effects();

/// `options` without the item: the plan has it no more, nor what cannot be without it (a section's caps, the shadows of
/// lights, smooth edges beside sharp ones). A light's own highlights go with the lights; without parallel rays the
/// target is seen as large as with them. What is not on stays as it is. Domain: one of removable_effects().
RenderOptions without_effect(const std::string& name, RenderOptions options);

/// One item of the view's plan.
struct EffectCost {
    std::string name, why;                // as the plan has them
    std::vector<std::string> takes_along; // other items that go where it is turned off
    std::optional<double> ms; // what the picture takes more because of it, below 0 where it saves time; none: it is the
                              // pack's or cannot be turned off
    // Standard error of ms, from how its rounds spread; never less than the median of all effects' errors, for a few
    // rounds may agree by chance
    double error_ms = 0;
    WorkCounts work_without; // of the picture without it, where it can be turned off
};

struct EffectCosts {
    std::string device;
    double picture_ms = 0, error_ms = 0; // of the whole picture, median of the rounds
    WorkCounts work;
    uint32_t rounds = 0;             // that were made
    std::vector<EffectCost> effects; // all items of the plan, in its order
};

/// Times are wall times, of the CPU with one thread processor times; costs are medians over the rounds of differences
/// between two pictures of the same round (picture_turns.h). Costs of effects that share work (rays of shadows and of
/// occlusion share their start) do not add up to the picture's time. `tracer` must be nobody else's meanwhile.
/// Fails: Interrupted (options.cancelled), as Tracer::render.
Result<EffectCosts> measure_effect_costs(Tracer& tracer, const PackImage& image, const RenderOptions& options,
                                         const TurnOptions& turns);

} // namespace trimray
