// Vectors, rays and roots of the reference for closest hits, in double. Its own, so that it shares nothing with what it
// judges.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

namespace trimray::reference {

using Vec3 = std::array<double, 3>;

inline Vec3 operator+(const Vec3& a, const Vec3& b)
{
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Vec3 operator-(const Vec3& a, const Vec3& b)
{
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
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
inline double length(const Vec3& a)
{
    return std::hypot(a[0], a[1], a[2]);
}

/// Between two vectors, accurate at 0 and 180 too; 0 where either vanishes.
inline double angle_deg(const Vec3& a, const Vec3& b)
{
    constexpr double kDegrees = 57.29577951308232;
    return kDegrees * std::atan2(length(cross(a, b)), dot(a, b));
}

/// Points origin + t * direction; the direction has any length but 0.
struct Ray {
    Vec3 origin{}, direction{};
    Vec3 at(double t) const { return origin + direction * t; }
};

/// Where a ray's line meets a surface.
struct Root {
    double t = 0;         // of the ray
    double u = 0, v = 0;  // uv_patch
    bool contact = false; // the line touches, or may meet the surface more than once, within 1e-6 patch units of there
};

/// Called with roots as they are found. Returns the t from which on no more are asked for.
using TakeRoot = std::function<double(const Root&)>;

/// An axis-aligned box; lo > hi: empty.
struct Bounds {
    Vec3 lo{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
            std::numeric_limits<double>::infinity()};
    Vec3 hi = lo * -1;

    void add(const Vec3& p)
    {
        for (size_t i = 0; i < 3; ++i) {
            lo[i] = std::min(lo[i], p[i]);
            hi[i] = std::max(hi[i], p[i]);
        }
    }
    bool empty() const { return !(lo[0] <= hi[0]); }
    /// The corner whose bits choose hi along x, y and z.
    Vec3 corner(int bits) const
    {
        return {bits & 1 ? hi[0] : lo[0], bits & 2 ? hi[1] : lo[1], bits & 4 ? hi[2] : lo[2]};
    }
};

} // namespace trimray::reference
