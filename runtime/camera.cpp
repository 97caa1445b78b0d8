#include "runtime/camera.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace trimray {
namespace {

using Vec3 = std::array<double, 3>;

Vec3 operator-(const Vec3& a, const Vec3& b)
{
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Vec3 operator+(const Vec3& a, const Vec3& b)
{
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
Vec3 operator*(const Vec3& a, double s)
{
    return {a[0] * s, a[1] * s, a[2] * s};
}
double dot(const Vec3& a, const Vec3& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Vec3 cross(const Vec3& a, const Vec3& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Unit vector along a, or `fallback` where a has no direction.
Vec3 normalised(const Vec3& a, const Vec3& fallback)
{
    const double largest = std::max({std::abs(a[0]), std::abs(a[1]), std::abs(a[2])});
    if (!(largest > 0) || !std::isfinite(largest))
        return fallback;
    const Vec3 scaled = a * (1 / largest);
    return scaled * (1 / std::sqrt(dot(scaled, scaled)));
}

struct Axes {
    Vec3 forward, right, up;
};

/// An eye at its target looks down; an up along the view gives way to the axis that is farthest from the view.
Axes camera_axes(const Camera& camera)
{
    constexpr double kLeastSine = 1e-6; // of the angle between view and up
    Axes axes;
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

} // namespace

CameraRays camera_rays(const Camera& camera, uint32_t width, uint32_t height)
{
    const Axes axes = camera_axes(camera);
    const double half_y = half_height(camera.fov_deg);
    const double half_x = half_y * width / height;
    CameraRays rays;
    rays.eye = camera.eye;
    rays.corner = axes.forward - axes.right * half_x + axes.up * half_y;
    rays.step_x = axes.right * (2 * half_x / width);
    rays.step_y = axes.up * (-2 * half_y / height);
    return rays;
}

bool standard_view(const std::string& name, const std::array<double, 3>& bounds_lo_mm,
                   const std::array<double, 3>& bounds_hi_mm, double aspect, double fov_deg, Camera& camera)
{
    struct View {
        const char* name;
        Vec3 looks_along, up;
    };
    static const View kViews[] = {
        {"iso", {-1, 1, -1}, {0, 0, 1}},  {"front", {0, 1, 0}, {0, 0, 1}},  {"back", {0, -1, 0}, {0, 0, 1}},
        {"left", {1, 0, 0}, {0, 0, 1}},   {"right", {-1, 0, 0}, {0, 0, 1}}, {"top", {0, 0, -1}, {0, 1, 0}},
        {"bottom", {0, 0, 1}, {0, 1, 0}},
    };
    constexpr double kBorder = 1.04; // a little air around the model
    const std::string wanted = name.empty() ? "iso" : name;
    for (const View& view : kViews) {
        if (wanted != view.name)
            continue;
        camera.fov_deg = fov_deg;
        camera.up = view.up;
        camera.target = (bounds_lo_mm + bounds_hi_mm) * 0.5;
        camera.eye = camera.target - view.looks_along;
        const Axes axes = camera_axes(camera);
        const double tan_y = half_height(fov_deg), tan_x = tan_y * aspect;
        // the eye is far enough back when each corner of the box lies within the picture's two angles
        double back = 0;
        for (int corner = 0; corner < 8; ++corner) {
            Vec3 p;
            for (size_t i = 0; i < 3; ++i)
                p[i] = (corner >> i & 1 ? bounds_hi_mm[i] : bounds_lo_mm[i]) - camera.target[i];
            const double along = dot(p, axes.forward);
            back = std::max(back, kBorder * std::abs(dot(p, axes.right)) / tan_x - along);
            back = std::max(back, kBorder * std::abs(dot(p, axes.up)) / tan_y - along);
        }
        if (!(back > 0))
            back = 1; // a point
        camera.eye = camera.target - axes.forward * back;
        return true;
    }
    return false;
}

} // namespace trimray
