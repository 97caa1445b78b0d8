#include "runtime/time_budget.h"

#include "runtime/effect_plan.h"
#include "runtime/light_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

namespace trimray {
namespace {

// Rays a pixel of one effect below which its noise is worse than hard shadows, or no occlusion
constexpr uint32_t kFewestRays = 4;
constexpr uint32_t kShrinks[] = {2, 3, 4, 6, 8};

std::string samples_text(uint32_t samples)
{
    return fmt::format("{} x {}", samples, samples);
}

std::string shadows_text(uint32_t light_samples)
{
    return light_samples > 0 ? fmt::format("soft, {} rays a light", light_samples) : "hard";
}

std::string size_text(uint32_t shrink)
{
    return shrink > 1 ? fmt::format("1/{}", shrink) : "full";
}

} // namespace

Effort effort_of(const RenderOptions& options, uint32_t samples)
{
    const SceneLook& look = options.look;
    Effort effort;
    effort.samples = samples;
    effort.smoothed = options.antialias_trims;
    if (!has_lights(look))
        return effort;
    effort.occlusion = look.occlusion.samples;
    effort.light_samples = (look_bits(options) & kLookSoftShadows) != 0 ? look.light_samples : 0;
    effort.mirror_depth = has_mirrors(look) ? look.mirror_depth : 0;
    return effort;
}

std::vector<Effort> effort_ladder(const RenderOptions& options, uint32_t samples)
{
    std::vector<Effort> ladder{effort_of(options, samples)};
    const auto add = [&ladder](uint32_t Effort::*what, uint32_t to) {
        ladder.push_back(ladder.back());
        ladder.back().*what = to;
    };
    const auto halve = [&](uint32_t Effort::*what, uint32_t fewest) {
        while (ladder.back().*what > fewest)
            add(what, std::max(ladder.back().*what / 2, fewest));
    };
    while (ladder.back().samples > 1) // about half of the rays each
        add(&Effort::samples, (2 * ladder.back().samples + 1) / 3);
    halve(&Effort::occlusion, kFewestRays);
    halve(&Effort::light_samples, kFewestRays);
    if (ladder.back().light_samples > 0)
        add(&Effort::light_samples, 0);
    halve(&Effort::mirror_depth, 1);
    if (ladder.back().smoothed) {
        ladder.push_back(ladder.back());
        ladder.back().smoothed = false;
    }
    if (ladder.back().occlusion > 0)
        add(&Effort::occlusion, 0);
    for (const uint32_t shrink : kShrinks)
        if (std::min(options.width, options.height) >= shrink * kLeastSide)
            add(&Effort::shrink, shrink);
    return ladder;
}

RenderOptions with_effort(RenderOptions options, const Effort& effort)
{
    const Effort asked = effort_of(options, effort.samples);
    SceneLook& look = options.look;
    if (asked.occlusion > 0)
        look.occlusion.samples = effort.occlusion;
    if (asked.mirror_depth > 0)
        look.mirror_depth = effort.mirror_depth;
    if (effort.light_samples > 0)
        look.light_samples = effort.light_samples;
    else if (asked.light_samples > 0)
        for (Light& light : look.lights) // as ShadowKind::Hard
            light.half_angle_deg = light.radius_mm = 0;
    options.antialias_trims = effort.smoothed;
    return options;
}

std::vector<GivenUp> given_up(const Effort& asked, const Effort& made)
{
    std::vector<GivenUp> list;
    if (made.samples != asked.samples)
        list.push_back({"samples a pixel", samples_text(asked.samples), samples_text(made.samples)});
    if (made.occlusion != asked.occlusion)
        list.push_back({"rays of occlusion", fmt::format("{}", asked.occlusion), fmt::format("{}", made.occlusion)});
    if (made.light_samples != asked.light_samples)
        list.push_back({"shadows", shadows_text(asked.light_samples), shadows_text(made.light_samples)});
    if (made.mirror_depth != asked.mirror_depth)
        list.push_back({"mirror depth", fmt::format("{}", asked.mirror_depth), fmt::format("{}", made.mirror_depth)});
    if (made.smoothed != asked.smoothed)
        list.push_back({"smoothed trims", "yes", "no"});
    if (made.shrink != asked.shrink)
        list.push_back({"size traced", size_text(asked.shrink), size_text(made.shrink)});
    return list;
}

bool BudgetSearch::fits(double ms) const
{
    return ms <= (1 + kOverBudget) * budget_ms_;
}

void BudgetSearch::begin_picture()
{
    for (Rung& rung : rungs_)
        rung.made = false;
    best_.reset();
    upgrades_ = 0;
}

Result<std::optional<size_t>> BudgetSearch::next(const Probe& probe)
{
    const bool has_fit = best_ && best_fits();
    if (has_fit && upgrades_ == kMostUpgrades)
        return std::optional<size_t>();
    // above the best that fits, below the lowest that does not
    const size_t end = has_fit ? *best_ : rungs_.size();
    size_t begin = 0;
    for (size_t i = 0; i < end; ++i)
        if (rungs_[i].made)
            begin = i + 1;
    for (size_t i = begin; i < end; ++i) {
        std::optional<double>& estimate = rungs_[i].estimate_ms;
        if (!estimate && rungs_.size() > 1) {
            const Result<double> probed = probe(i);
            if (!probed.ok())
                return probed.error();
            estimate = bias_ * *probed;
        }
        const bool cheapest = i + 1 == rungs_.size(); // made whatever it takes
        if (!cheapest && *estimate > budget_ms_)
            continue;
        upgrades_ += has_fit;
        return std::optional(i);
    }
    return std::optional<size_t>();
}

bool BudgetSearch::measured(size_t rung, double ms)
{
    assert(!rungs_[rung].made && "a rung that next() gave");
    // What this picture is slower or faster by than was thought is laid to the view, and so to all rungs alike
    const std::optional<double>& thought_ms = rungs_[rung].estimate_ms;
    const double change = thought_ms && *thought_ms > 0 ? ms / *thought_ms : 1;
    bias_ *= change;
    for (Rung& other : rungs_)
        if (other.estimate_ms && !other.made)
            *other.estimate_ms *= change;
    rungs_[rung] = {ms, true};
    const bool better = !best_ || (fits(ms) && rung < *best_) || !best_fits();
    if (better)
        best_ = rung;
    return better;
}

} // namespace trimray
