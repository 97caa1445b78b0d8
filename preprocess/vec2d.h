// Arithmetic of points and vectors of a parameter plane.
#pragma once

#include "preprocess/import/cad_model.h"

#include <cmath>

namespace trimray {

inline Vec2d operator+(Vec2d a, Vec2d b)
{
    return {a.x + b.x, a.y + b.y};
}
inline Vec2d operator-(Vec2d a, Vec2d b)
{
    return {a.x - b.x, a.y - b.y};
}
inline Vec2d operator*(double s, Vec2d a)
{
    return {s * a.x, s * a.y};
}
inline double dot(Vec2d a, Vec2d b)
{
    return a.x * b.x + a.y * b.y;
}
inline double cross(Vec2d a, Vec2d b)
{
    return a.x * b.y - a.y * b.x;
}
inline double length(Vec2d a)
{
    return std::sqrt(dot(a, a)); // in mm of a model: no overflow to guard against
}

} // namespace trimray
