// What a picture's lights, occlusion and mirrors come to for both tracers: shaders/light_layout.h, from the scene's
// look.
#pragma once

#include "runtime/placement_view.h"
#include "runtime/tracer.h"
#include "shaders/light_layout.h"

#include <array>
#include <vector>

namespace trimray {

// Bounds of what a scene may ask for
constexpr uint32_t kMostRaysAPixel = 4096; // to each light, and of ambient occlusion
constexpr uint32_t kMostMirrorDepth = 8;
constexpr double kMostSky = 100;

/// The rays of a picture, world mm: pixel (x, y) from its middle sees eye + tau (w0 + x step_x + y step_y), |w0| = 1.
struct ViewRays {
    std::array<double, 3> eye_mm, w0, step_x, step_y;
    double tau_ref; // mm; hits are kept relative to it
};

struct FrameLights {
    LightView view;
    std::vector<LightRecord> lights;
    // Points of the unit disc, x and y in turn: view.light_samples for soft lights, then view.occlusion_samples
    std::vector<float> samples;
};

/// Whether a rule makes a mirror.
bool has_mirrors(const SceneLook& look);

/// Whether a picture is lit by more than the light at the eye: then tracers need FrameLights.
bool has_lights(const SceneLook& look);

/// Whether light at a hit hangs on rays from there.
bool has_light_rays(const SceneLook& look);

/// Fails: Usage (numbers that mean nothing, too many lights or samples).
Status check_lights(const SceneLook& look);

/// Domain: check_lights is ok.
FrameLights frame_lights(const PlacementView& placed, const RenderOptions& options);

PlaceView place_view(const PlacementView& placed, const ViewRays& rays);

/// By instance.
std::vector<WorldToPart> world_to_part(const PlacementView& placed);

} // namespace trimray
