#include "runtime/navigation.h"

#include "runtime/camera_frame.h"

#include <algorithm>
#include <cmath>

namespace trimray {
namespace {

constexpr double kTurn = 3.14159265358979323846; // radians for the picture's height

double distance(const Camera& camera)
{
    using namespace camera_math;
    const Vec3 view = camera.target - camera.eye;
    return std::sqrt(dot(view, view));
}

/// Millimetres a pixel, as far away as the target.
double pixel_mm(const Camera& camera, PictureSize size)
{
    const double height =
        camera.orthographic_mm > 0 ? camera.orthographic_mm : 2 * half_height(camera.fov_deg) * distance(camera);
    return height / size.height;
}

/// v turned about a unit axis, counterclockwise where the axis points at the one who looks. Source: Rodrigues.
std::array<double, 3> turned(const std::array<double, 3>& v, const std::array<double, 3>& axis, double angle)
{
    using namespace camera_math;
    return v * std::cos(angle) + cross(axis, v) * std::sin(angle) + axis * (dot(axis, v) * (1 - std::cos(angle)));
}

/// The camera with its eye turned about its target.
Camera turned_about_target(Camera camera, const std::array<double, 3>& axis, double angle)
{
    using namespace camera_math;
    camera.eye = camera.target + turned(camera.eye - camera.target, axis, angle);
    camera.up = turned(camera.up, axis, angle);
    return camera;
}

Camera turned_on_table(const Camera& camera, double right, double down, const std::array<double, 3>& world_up)
{
    using namespace camera_math;
    constexpr double kFromPole = 1e-3; // radians that the view keeps from straight up and down: it shows its up there
    const Vec3 up = normalised(world_up, {0, 0, 1});
    Camera table = turned_about_target(camera, up, -right);
    const CameraAxes own = camera_axes(table);
    const Vec3 level = cross(own.forward, up);
    const double sine = std::sqrt(dot(level, level));
    // straight from above or below, as standard views look, the picture's own right goes on as the table's
    const Vec3 axis = sine < 1e-6 ? own.right : level * (1 / sine);
    const double from_up = std::atan2(sine, -dot(own.forward, up)); // of the eye, seen from the target
    const double wanted = std::clamp(from_up - down, kFromPole, kTurn - kFromPole);
    table = turned_about_target(table, axis, wanted - from_up);
    table.up = up;
    return table;
}

} // namespace

Camera orbit(const Camera& camera, double dx_px, double dy_px, PictureSize size, Turning turning,
             const std::array<double, 3>& world_up)
{
    using namespace camera_math;
    const double right = kTurn * dx_px / size.height, down = kTurn * dy_px / size.height;
    if (turning == Turning::Turntable)
        return turned_on_table(camera, right, down, world_up);
    const CameraAxes axes = camera_axes(camera);
    const double angle = std::hypot(right, down);
    if (!(angle > 0))
        return camera;
    Camera free = camera;
    free.up = axes.up;
    // the model follows the pointer, so the eye goes the other way, about the axis across the pointer's way
    return turned_about_target(free, (axes.up * right + axes.right * down) * (1 / angle), -angle);
}

Camera pan(const Camera& camera, double dx_px, double dy_px, PictureSize size)
{
    using namespace camera_math;
    const CameraAxes axes = camera_axes(camera);
    const double mm = pixel_mm(camera, size);
    const Vec3 way = axes.right * (-dx_px * mm) + axes.up * (dy_px * mm);
    Camera moved = camera;
    moved.eye = camera.eye + way;
    moved.target = camera.target + way;
    return moved;
}

std::array<double, 3> point_at_target(const Camera& camera, double x_px, double y_px, PictureSize size)
{
    using namespace camera_math;
    const CameraAxes axes = camera_axes(camera);
    const double mm = pixel_mm(camera, size);
    return camera.target + axes.right * ((x_px - 0.5 * size.width) * mm) + axes.up * ((0.5 * size.height - y_px) * mm);
}

Camera zoom_about(const Camera& camera, const std::array<double, 3>& point, double scale)
{
    using namespace camera_math;
    Camera nearer = camera; // seen from the point all keeps its direction, so in the picture it keeps its place
    nearer.eye = point + (camera.eye - point) * scale;
    nearer.target = point + (camera.target - point) * scale;
    nearer.orthographic_mm = camera.orthographic_mm * scale;
    return nearer;
}

Camera roll(const Camera& camera, double degrees)
{
    const CameraAxes axes = camera_axes(camera);
    Camera rolled = camera;
    rolled.up = turned(axes.up, axes.forward, -degrees * kTurn / 180);
    return rolled;
}

Camera with_parallel_rays(const Camera& camera)
{
    Camera parallel = camera;
    if (!(camera.orthographic_mm > 0))
        parallel.orthographic_mm = 2 * half_height(camera.fov_deg) * distance(camera);
    return parallel;
}

Camera with_perspective(const Camera& camera)
{
    using namespace camera_math;
    if (!(camera.orthographic_mm > 0))
        return camera;
    const CameraAxes axes = camera_axes(camera);
    Camera perspective = camera;
    perspective.orthographic_mm = 0;
    perspective.eye = camera.target - axes.forward * (camera.orthographic_mm / (2 * half_height(camera.fov_deg)));
    return perspective;
}

Camera turning_about_middle(Camera camera, const Reach& reach)
{
    using namespace camera_math;
    const Vec3 forward = camera_axes(camera).forward;
    const double middle = 0.5 * (reach(forward) - reach(forward * -1)), way = middle - dot(camera.eye, forward);
    if (way > 0)
        camera.target = camera.eye + forward * way;
    return camera;
}

std::optional<std::array<double, 2>> seen_at(const Camera& camera, const std::array<double, 3>& point, PictureSize size)
{
    using namespace camera_math;
    const CameraAxes axes = camera_axes(camera);
    const Vec3 way = point - camera.eye;
    const double depth = dot(way, axes.forward);
    const bool parallel = camera.orthographic_mm > 0;
    const double half = parallel ? 0.5 * camera.orthographic_mm : half_height(camera.fov_deg) * depth;
    if (!(half > 0))
        return std::nullopt;
    const double pixels = 0.5 * size.height / half; // a millimetre
    return std::array{0.5 * size.width + pixels * dot(way, axes.right), 0.5 * size.height - pixels * dot(way, axes.up)};
}

} // namespace trimray
