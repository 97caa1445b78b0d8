// Placements: row-major 3x4 matrices, part mm to world mm.
#pragma once

#include <cmath>

namespace trimray {

/// World coordinates: far above any model, far below where squares overflow.
inline constexpr double kMaxMillimetres = 1e15;

/// Of the first three columns.
inline double determinant(const double (&m)[12])
{
    return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
           m[2] * (m[4] * m[9] - m[5] * m[8]);
}

/// Whether the matrix flattens what it places: its determinant is rounding. NaN does.
inline bool is_singular(const double (&m)[12])
{
    // below this share of the product of its columns' lengths a determinant is rounding
    constexpr double kSingularDeterminant = 1e-12;
    double lengths = 1;
    for (int c = 0; c < 3; ++c)
        lengths *= std::sqrt(m[c] * m[c] + m[4 + c] * m[4 + c] + m[8 + c] * m[8 + c]);
    return !(std::abs(determinant(m)) > kSingularDeterminant * lengths);
}

} // namespace trimray
