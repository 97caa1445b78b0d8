// What the subcommands that make pictures share: which device traces, from where, and at how many samples.
#pragma once

#include "format/result.h"
#include "runtime/picture_size.h"
#include "runtime/placement_view.h"
#include "runtime/scene_request.h"
#include "runtime/tracer.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace trimray {

/// Names a command line takes for a choice; those that `available` leaves out are known but not in this build.
struct Choice {
    const char* option;
    std::vector<std::string> known, available;
};
const Choice& trim_choice();
const Choice& closest_choice();
const Choice& device_choice();

/// Fails: Usage (unknown; the nearest is suggested), UnsupportedFormat (known, not in this build; the others are
/// named).
Status check_choice(const Choice& choice, const std::string& value);

/// Domain: names of trim_choice().available.
TrimMode trim_mode(const std::string& name);
/// Domain: names of closest_choice().available.
ClosestPolicy closest_policy(const std::string& name);
const char* closest_name(ClosestPolicy policy);

/// A tracer for `device`: "cpu", "vulkan" (software drivers too), "reference", or "auto": a hardware GPU where there is
/// one, else the CPU; `note` says which and why. Fails: NoDevice, DeviceFailed, UnsupportedPackFeature.
Result<std::unique_ptr<Tracer>> make_tracer(const std::shared_ptr<const Scene>& scene, const std::string& device,
                                            std::string& note);

/// "WxH" in pixels, each of samples x samples rays. Fails: Usage.
Result<PictureSize> parse_size(const std::string& text, uint32_t samples);

/// Without an eye: the model framed whole from the named view. Without a target: the middle of the model.
/// Fails: Usage (no such view; an eye in the model's middle).
Result<Camera> camera_of(const SceneCamera& asked, const PackImage& image, uint32_t width, uint32_t height);
/// The same where the middle is that of what is placed, and `framed` is framed.
Result<Camera> camera_of(const SceneCamera& asked, const PlacementView& placed, const Reach& framed, uint32_t width,
                         uint32_t height);

/// Of all placements that are visible; what is placed and the pack must outlive it.
Reach model_reach(const PackImage& image, const PlacementView& placed);

/// Of the model's bounds.
double diagonal_mm(const PackImage& image);

/// What is traced for a picture of samples x samples a pixel.
RenderOptions at_samples(RenderOptions options, uint32_t samples);

/// Traces at samples x samples the resolution and averages (colours only, when samples > 1). The counts in `stats` are
/// of all samples. Fails: as Tracer::render.
Result<Frame> trace_picture(Tracer& tracer, const RenderOptions& options, uint32_t samples, RenderStats& stats);

} // namespace trimray
