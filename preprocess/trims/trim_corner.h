// Two pieces of a loop whose ends miss each other, brought together where the curves meet.
#pragma once

#include "preprocess/trims/trim_curve.h"

#include <vector>

namespace trimray {

/// Lets `before`'s end and `after`'s start meet where their tangents cross: what a piece has beyond that point is cut
/// off, what it lacks is drawn on along its tangent (`between`, in the order of the loop). Ends that overlap on one
/// line meet midway. `after` is `offset` away (whole periods); lengths are taken in mm_per_uv. False, and nothing
/// changed: the tangents cross at no place near both ends, so a line between them is as good.
bool meet_at_corner(CurvePiece& before, CurvePiece& after, Vec2d offset, Vec2d mm_per_uv,
                    std::vector<CurvePiece>& between);

} // namespace trimray
