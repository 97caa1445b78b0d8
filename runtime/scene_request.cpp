#include "runtime/scene_request.h"

#include "runtime/frame_effects.h"

namespace trimray {
namespace {

// The size of lights that soft shadows are asked of and that have none: a penumbra to be seen, of about the width that
// a desk lamp's has; the sun's own half angle is 0.27 degrees
constexpr double kSoftHalfAngleDeg = 2;
constexpr double kSoftRadiusPerDiagonal = 0.02;

void set_shadows(ShadowKind kind, double diagonal_mm, std::vector<Light>& lights)
{
    if (lights.empty() && kind != ShadowKind::None)
        lights.push_back(default_sun());
    for (Light& light : lights) {
        if (light.kind == LightKind::Eye)
            continue;
        light.shadows = kind != ShadowKind::None;
        if (kind == ShadowKind::Hard)
            light.half_angle_deg = light.radius_mm = 0;
        else if (kind == ShadowKind::Soft && light.kind == LightKind::Directional && light.half_angle_deg == 0)
            light.half_angle_deg = kSoftHalfAngleDeg;
        else if (kind == ShadowKind::Soft && light.kind == LightKind::Point && light.radius_mm == 0)
            light.radius_mm = kSoftRadiusPerDiagonal * diagonal_mm;
    }
}

} // namespace

Light default_sun()
{
    Light sun;
    sun.direction = {1, 2, -3};
    return sun;
}

Result<SceneCamera> merge_camera(const SceneCamera& base, const SceneCamera& over)
{
    SceneCamera camera = base;
    if (over.eye || !over.view.empty()) {
        camera.view = over.view;
        camera.eye = over.eye;
        camera.target = camera.up = std::nullopt;
        camera.where = over.where;
    }
    if (over.target)
        camera.target = over.target;
    if (over.up)
        camera.up = over.up;
    if (over.fov_deg) { // a pinhole
        camera.fov_deg = over.fov_deg;
        camera.height_mm = std::nullopt;
        camera.parallel = std::nullopt;
    }
    if (over.height_mm || over.parallel) {
        camera.height_mm = over.height_mm;
        camera.parallel = over.parallel;
        camera.fov_deg = std::nullopt;
    }
    if (!camera.eye && (over.target || over.up))
        return Error{ErrorCode::Usage, over.target ? "--target" : "--up",
                     "needs --eye x,y,z; without it the model is framed whole from --view"};
    if (camera.eye && camera.parallel.value_or(false) && !camera.height_mm)
        return Error{ErrorCode::Usage, "--ortho", "expected a height in mm: with an eye nothing is framed"};
    return camera;
}

Status apply_request(const SceneRequest& request, double diagonal_mm, RenderOptions& options)
{
    options.edges = request.edges.value_or(request.edges_only ? EdgeLines::Sharp : EdgeLines::None);
    options.silhouettes = request.silhouettes.value_or(request.edges_only);
    options.fill = !request.edges_only;
    options.edge_width_px = request.edge_width_px;
    options.edge_color = request.edge_color;
    options.antialias_trims = request.antialias_trims;
    if (request.edges_only && options.edges == EdgeLines::None && !options.silhouettes)
        return Error{ErrorCode::Usage, "--style", "edges-only without edges and silhouettes draws nothing"};
    options.look = request.look;
    options.look.background = request.background;
    if (request.shadows)
        set_shadows(*request.shadows, diagonal_mm, options.look.lights);
    return check_effects(options);
}

} // namespace trimray
