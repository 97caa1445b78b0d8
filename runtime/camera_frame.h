// How a camera lies in space, for those who move it.
#pragma once

#include "runtime/camera.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace trimray {
namespace camera_math {

using Vec3 = std::array<double, 3>;

inline Vec3 operator-(const Vec3& a, const Vec3& b)
{
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Vec3 operator+(const Vec3& a, const Vec3& b)
{
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Vec3 operator*(const Vec3& a, double s)
{
    return {a[0] * s, a[1] * s, a[2] * s};
}
inline double dot(const Vec3& a, const Vec3& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Vec3 cross(const Vec3& a, const Vec3& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Unit vector along a, or `fallback` where a has no direction.
inline Vec3 normalised(const Vec3& a, const Vec3& fallback)
{
    const double largest = std::max({std::abs(a[0]), std::abs(a[1]), std::abs(a[2])});
    if (!(largest > 0) || !std::isfinite(largest))
        return fallback;
    const Vec3 scaled = a * (1 / largest);
    return scaled * (1 / std::sqrt(dot(scaled, scaled)));
}

} // namespace camera_math

/// Unit vectors of the picture: into it, to its right, to its top.
struct CameraAxes {
    std::array<double, 3> forward, right, up;
};

/// An eye at its target looks down; an up along the view gives way to the axis that is farthest from the view.
CameraAxes camera_axes(const Camera& camera);

/// Half of the picture's height at distance 1.
double half_height(double fov_deg);

/// Moves the camera, without turning it, so that something is seen whole. Of parallel rays the height is chosen too.
void frame_whole(Camera& camera, const Reach& reach, double aspect);

} // namespace trimray
