// The few vector operations the converter needs on Vec3d.
#pragma once

#include "preprocess/import/cad_model.h"

#include <cmath>

namespace trimray {

inline Vec3d operator+(const Vec3d& a, const Vec3d& b)
{
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vec3d operator-(const Vec3d& a, const Vec3d& b)
{
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vec3d operator*(double s, const Vec3d& a)
{
    return {s * a.x, s * a.y, s * a.z};
}
inline double dot(const Vec3d& a, const Vec3d& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec3d cross(const Vec3d& a, const Vec3d& b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(const Vec3d& a)
{
    return std::sqrt(dot(a, a));
}

} // namespace trimray
