// Placements: row-major 3x4 matrices, part mm to world mm.
#pragma once

#include <cmath>
#include <optional>

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

/// The scale of a matrix that is a turn, a mirroring and one scale, within what files round to; of others nothing.
inline std::optional<double> similarity_scale(const double (&m)[12])
{
    constexpr double kSimilar = 1e-5; // columns as long as each other and at right angles, as a share of their squares
    const auto product = [&m](int a, int b) { return m[a] * m[b] + m[4 + a] * m[4 + b] + m[8 + a] * m[8 + b]; };
    const double square = product(0, 0), most = kSimilar * square;
    const bool similar = std::abs(product(1, 1) - square) <= most && std::abs(product(2, 2) - square) <= most &&
                         std::abs(product(0, 1)) <= most && std::abs(product(0, 2)) <= most &&
                         std::abs(product(1, 2)) <= most;
    return similar ? std::optional(std::sqrt(square)) : std::nullopt;
}

} // namespace trimray
