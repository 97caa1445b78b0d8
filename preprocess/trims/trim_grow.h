// Watertight borders: the loops of a face are moved outwards by what its neighbours' borders may miss its own by, so
// that a ray through a common edge meets one of the two faces. Neighbours share an edge in space, but each has its own
// pcurve, fit and rounding; grown, the two overlap by as much as they could have been apart.
#pragma once

#include "preprocess/trims/trim_chain.h"

#include <vector>

namespace trimray {

struct GrowReport {
    double largest_mm = 0;              // that a piece was moved out by, at a right angle to itself
    std::vector<TrimFinding> not_grown; // a NotGrown for each loop that stays
};

/// Moves the pieces of closed loops outwards: each by its grow_mm and by rounding, measured on the surface at a right
/// angle to the piece. Pieces with kHeld stay on their line. Which side is out follows from the even-odd rule, not from
/// a loop's direction.
/// Invariants: loops stay closed and pieces monotone; the region of the old loops lies in that of the new ones, and the
/// new border within kGrowReach times the growth of the old one (but for loops narrower than their growth and notches
/// sharper than about 30 degrees).
/// A loop that crosses itself has no inside to grow from, and a hole that its growth would close no inside to shrink
/// to: both stay and are reported.
/// Units: `chains` in uv_face of `domain`; afterwards in uv_face of the domain returned, which bounds them. It goes no
/// farther than a period, a pole or an apex, or a hundredth of a spline's end span beyond its knots.
Rect2d grow_loops(std::vector<TrimChain>& chains, const CadSurface& surface, const Rect2d& domain, GrowReport& report);

inline constexpr double kGrowReach = 4;

} // namespace trimray
