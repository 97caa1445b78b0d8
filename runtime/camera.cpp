#include "runtime/camera.h"

#include "runtime/camera_frame.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>

namespace trimray {
namespace {

// How far back, in picture heights, the pinhole of parallel rays lies. Over a model as deep as the picture is high they
// shift against each other by 1 / 3e7 of it at most, a ten-thousandth of a pixel of 3,000; and doubles place an eye so
// far away to 4e-9 of the height, pairs of floats to 1e-7.
constexpr double kParallelFrom = 3e7;

struct StandardView {
    const char* name;
    std::array<double, 3> looks_along, up;
};
constexpr StandardView kViews[] = {
    {"iso", {-1, 1, -1}, {0, 0, 1}},  {"front", {0, 1, 0}, {0, 0, 1}},  {"back", {0, -1, 0}, {0, 0, 1}},
    {"left", {1, 0, 0}, {0, 0, 1}},   {"right", {-1, 0, 0}, {0, 0, 1}}, {"top", {0, 0, -1}, {0, 1, 0}},
    {"bottom", {0, 0, 1}, {0, 1, 0}},
};
constexpr double kBorder = 1.04; // a little air around the model

/// Null: no such view.
const StandardView* find_view(const std::string& name)
{
    const std::string wanted = name.empty() ? "iso" : name;
    const auto found = std::find_if(std::begin(kViews), std::end(kViews),
                                    [&](const StandardView& view) { return wanted == view.name; });
    return found == std::end(kViews) ? nullptr : found;
}

/// The camera turned as the view is, its eye at the origin.
void turn(const StandardView& view, Camera& camera)
{
    camera.up = view.up;
    camera.eye = {0, 0, 0};
    camera.target = view.looks_along;
}

} // namespace

CameraAxes camera_axes(const Camera& camera)
{
    using namespace camera_math;
    constexpr double kLeastSine = 1e-6; // of the angle between view and up
    CameraAxes axes;
    axes.forward = normalised(camera.target - camera.eye, {0, 0, -1});
    Vec3 up = normalised(camera.up, {0, 0, 1});
    const Vec3 across = cross(axes.forward, up);
    if (dot(across, across) < kLeastSine * kLeastSine) {
        size_t least = 0;
        for (size_t i = 1; i < 3; ++i)
            if (std::abs(axes.forward[i]) < std::abs(axes.forward[least]))
                least = i;
        up = {0, 0, 0};
        up[least] = 1;
    }
    axes.right = normalised(cross(axes.forward, up), {1, 0, 0});
    axes.up = cross(axes.right, axes.forward);
    return axes;
}

double half_height(double fov_deg)
{
    constexpr double kDegree = 3.14159265358979323846 / 180;
    return std::tan(0.5 * std::clamp(fov_deg, 1e-9, 179.0) * kDegree);
}

CameraRays camera_rays(const Camera& camera, uint32_t width, uint32_t height)
{
    using namespace camera_math;
    const CameraAxes axes = camera_axes(camera);
    const bool parallel = camera.orthographic_mm > 0;
    const double half_y = parallel ? 0.5 / kParallelFrom : half_height(camera.fov_deg);
    const double half_x = half_y * width / height;
    CameraRays rays;
    rays.plane_mm = parallel ? kParallelFrom * camera.orthographic_mm : 0;
    rays.eye = camera.eye - axes.forward * rays.plane_mm;
    rays.corner = axes.forward - axes.right * half_x + axes.up * half_y;
    rays.step_x = axes.right * (2 * half_x / width);
    rays.step_y = axes.up * (-2 * half_y / height);
    return rays;
}

ParallelRays parallel_rays(const Camera& camera, uint32_t width, uint32_t height)
{
    using namespace camera_math;
    const CameraAxes axes = camera_axes(camera);
    const double half_y = 0.5 * camera.orthographic_mm, half_x = half_y * width / height;
    return {camera.eye - axes.right * half_x + axes.up * half_y, axes.right * (2 * half_x / width),
            axes.up * (-2 * half_y / height), axes.forward};
}

const std::vector<std::string>& standard_view_names()
{
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const StandardView& view : kViews)
            all.emplace_back(view.name);
        return all;
    }();
    return names;
}

namespace {

/// Fails never: what has no bounds leaves the camera as it is.
void frame_perspective(Camera& camera, const Reach& reach, double aspect)
{
    using namespace camera_math;
    const CameraAxes axes = camera_axes(camera);
    const double tan_y = half_height(camera.fov_deg) / kBorder, tan_x = tan_y * aspect;
    // A point p is within the picture's right side when (p - eye) . right <= tan_x (p - eye) . forward, that is
    // p . s <= eye . s with s = right / tan_x - forward: the reach along s. The other three sides likewise.
    const double right = reach(axes.right * (1 / tan_x) - axes.forward);
    const double left = reach(axes.right * (-1 / tan_x) - axes.forward);
    const double up = reach(axes.up * (1 / tan_y) - axes.forward);
    const double down = reach(axes.up * (-1 / tan_y) - axes.forward);
    const double nearest = -reach(axes.forward * -1), farthest = reach(axes.forward);
    if (!std::isfinite(right + left + up + down + nearest + farthest))
        return; // nothing to frame
    // the eye may go no farther along the view than either pair of sides allows, and lies midway between them
    double along = -0.5 * std::max(right + left, up + down);
    if (!(along < nearest))
        along = nearest - std::max(1.0, std::abs(nearest) * 1e-6); // a point
    camera.eye =
        axes.right * (0.5 * (right - left) * tan_x) + axes.up * (0.5 * (up - down) * tan_y) + axes.forward * along;
    camera.target = camera.eye + axes.forward * (0.5 * (nearest + farthest) - along);
}

/// height_mm: of what is seen; 0: so much that it is seen whole.
void frame_parallel(Camera& camera, const Reach& reach, double aspect, double height_mm)
{
    using namespace camera_math;
    camera.orthographic_mm = height_mm > 0 ? height_mm : 1;
    const CameraAxes axes = camera_axes(camera);
    const double right = reach(axes.right), left = -reach(axes.right * -1), up = reach(axes.up),
                 down = -reach(axes.up * -1), nearest = -reach(axes.forward * -1), farthest = reach(axes.forward);
    if (!std::isfinite(right + left + up + down + nearest + farthest))
        return; // nothing to frame
    const double fits = std::max(up - down, (right - left) / aspect) * kBorder;
    if (!(height_mm > 0) && fits > 0) // a point has no height: a millimetre is seen
        camera.orthographic_mm = fits;
    // before the model, by no more than rounding needs: depths are then about the model's own size
    const double along = nearest - std::max(0.01 * (farthest - nearest), 1e-3 * camera.orthographic_mm);
    camera.eye = axes.right * (0.5 * (right + left)) + axes.up * (0.5 * (up + down)) + axes.forward * along;
    camera.target = camera.eye + axes.forward * (0.5 * (nearest + farthest) - along);
}

} // namespace

void frame_whole(Camera& camera, const Reach& reach, double aspect)
{
    if (camera.orthographic_mm > 0)
        frame_parallel(camera, reach, aspect, 0);
    else
        frame_perspective(camera, reach, aspect);
}

bool standard_view(const std::string& name, const Reach& reach, double aspect, double fov_deg, Camera& camera)
{
    const StandardView* const view = find_view(name);
    if (view == nullptr)
        return false;
    camera.fov_deg = fov_deg;
    turn(*view, camera);
    frame_perspective(camera, reach, aspect);
    return true;
}

bool standard_orthographic_view(const std::string& name, const Reach& reach, double aspect, double height_mm,
                                Camera& camera)
{
    const StandardView* const view = find_view(name);
    if (view == nullptr)
        return false;
    turn(*view, camera);
    frame_parallel(camera, reach, aspect, height_mm);
    return true;
}

} // namespace trimray
