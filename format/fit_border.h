// Distances that are interpolated linearly between samples miss curved borders and corners by a share of a step. Moving
// the samples a little puts the interpolation's zero where the border is.
#pragma once

#include "format/distance_field.h"

#include <span>
#include <vector>

namespace trimray {

/// Returns `distances` (signed, at the grid's points) moved by at most `most` each, such that their bilinear
/// interpolation is nearly 0 along `pieces`. Points of the pieces beyond the outer samples are left out.
/// Units: a step of the grid is step_u along u and step_v along v; distances and `most` in the same unit.
/// Shapes: distances[j * grid.width + i]. Source: Kaczmarz 1937, one equation B(p) = 0 for each of the points p.
std::vector<float> fit_to_border(std::span<const MonotonePiece> pieces, const SampleGrid& grid, double step_u,
                                 double step_v, std::span<const float> distances, double most);

} // namespace trimray
