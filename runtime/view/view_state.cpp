#include "runtime/view/view_state.h"

#include "format/leaf_geometry.h"
#include "runtime/command_trace.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace trimray {

SceneRequest default_look()
{
    SceneRequest look;
    look.edges = EdgeLines::Sharp;
    look.edge_width_px = 1.2f;
    look.samples = 2;
    look.background = {0.028f, 0.033f, 0.042f};
    return look;
}

Result<RenderOptions> options_of(const ViewState& state, PictureSize size, const PackImage& image)
{
    RenderOptions options;
    options.width = size.width;
    options.height = size.height;
    SceneRequest look = state.look;
    if (!state.has_background)
        look.background.reset();
    if (const Status applied = apply_request(look, diagonal_mm(image), options); !applied.ok())
        return applied.error();
    options.look.environment = state.environment;
    options.camera = state.camera;
    options.trim = state.trim;
    options.closest = state.closest;
    options.error_px = state.error_px;
    options.threads = state.threads;
    return options;
}

SceneCamera scene_camera(const Camera& camera)
{
    SceneCamera scene;
    scene.eye = camera.eye;
    scene.target = camera.target;
    scene.up = camera.up;
    if (camera.orthographic_mm > 0)
        scene.height_mm = camera.orthographic_mm;
    else
        scene.fov_deg = camera.fov_deg;
    return scene;
}

SceneRequest scene_of(const ViewState& state)
{
    SceneRequest scene = state.look;
    scene.cameras = {scene_camera(state.camera)};
    if (!state.has_background)
        scene.background.reset();
    return scene;
}

Reach placements_reach(const PackImage& image, const PlacementView& placed, std::vector<uint32_t> placements)
{
    return [&image, placed, placements = std::move(placements)](const std::array<double, 3>& direction) {
        double farthest = -std::numeric_limits<double>::infinity();
        for (const uint32_t placement : placements)
            farthest = std::max(farthest, largest_along(image, placed.instances[placement], direction));
        return farthest;
    };
}

} // namespace trimray
