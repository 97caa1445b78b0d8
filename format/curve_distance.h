// From trim pieces to true signed distances: to the curves themselves, not to a mask's pixels.
#pragma once

#include "format/distance_field.h"

#include <span>
#include <vector>

namespace trimray {

/// Each cubic is replaced by chords that leave it by no more than this share of `reach`.
inline constexpr double kChordDeviation = 1.0 / 2048;
/// Rounding of a distance in single precision, as a share of `reach`.
inline constexpr double kDistanceRounding = 1e-5;

/// Distance from each point of the grid to the nearest of `pieces`, positive inside by the even-odd rule; +-infinity
/// where it exceeds `reach`. It is off by (kChordDeviation + kDistanceRounding) * reach at most; the sign, from
/// crossings counted in double, is wrong only where the distance is nothing but rounding.
/// Units: the metric is constant; a step of the grid is step_u along u and step_v along v, reach in the same unit.
/// Shapes: out[j * width + i].
std::vector<float> curve_distances(std::span<const MonotonePiece> pieces, const SampleGrid& grid, double step_u,
                                   double step_v, double reach);

} // namespace trimray
