// What a picture in the viewer is made of: all of it can be written as a scene file, from which `trimray render` makes
// the same picture.
#pragma once

#include "runtime/camera.h"
#include "runtime/navigation.h"
#include "runtime/placement_view.h"
#include "runtime/scene_request.h"
#include "runtime/tracer.h"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace trimray {

struct ViewState {
    Camera camera;
    SceneRequest look;                              // without cameras
    std::shared_ptr<const Environment> environment; // of look.environment, read
    TrimMode trim = TrimMode::Auto;
    ClosestPolicy closest = ClosestPolicy::Certified;
    float error_px = RenderOptions{}.error_px;
    uint32_t threads = 0;
    bool has_background = true; // false: screenshots, and what scene files say, are transparent

    uint32_t samples() const { return look.samples.value_or(1); }
};

/// How the viewer draws where nobody says otherwise: dark lines along sharp edges, 2 x 2 samples, a quiet background.
SceneRequest default_look();

/// What the tracer is asked for, one sample a pixel. Fails: as apply_request.
Result<RenderOptions> options_of(const ViewState& state, PictureSize size, const PackImage& image);

/// The camera as a scene file has it.
SceneCamera scene_camera(const Camera& camera);

/// What the state asks for, as a scene file: its camera is the file's only one.
SceneRequest scene_of(const ViewState& state);

/// Of some placements where they stand, world mm; the pack and what is placed must outlive it. Domain: some.
Reach placements_reach(const PackImage& image, const PlacementView& placed, std::vector<uint32_t> placements);

} // namespace trimray
