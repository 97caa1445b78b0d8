// Rational patches whose weights lie so far apart that a step between neighbouring single-precision parameters is more
// than a patch's rounding: cut into pieces that each have parameters of their own.
#pragma once

#include "preprocess/bezier_patch.h"

#include <vector>

namespace trimray {

/// Bounds of |S_u| and |S_v| over uv_patch, in half diagonals of the control points' box. From
///   w S_u = p sum_ij B_i^(p-1)(u) B_j^q(v) [w_(i+1)j (P_(i+1)j - S) - w_ij (P_ij - S)]
///   w     =   sum_ij B_i^(p-1)(u) B_j^q(v) [(1 - u) w_ij + u w_(i+1)j]
/// with S in the box and r >= 1 the ratio of two neighbouring weights, H the heavier of their points:
///   |S_u| <= p max_ij (|P_(i+1)j - P_ij| + (r_ij - 1) |H_ij - S|)
/// Domain: weights positive, not all points one. Source: Piegl & Tiller eq. 4.8; Floater 1992 for curves.
struct PatchSpeed {
    double u = 0, v = 0;
};
PatchSpeed patch_speed(const BezierPatch& patch);

/// What both neighbours of a common side can make up for: rounding u and v to single precision moves a point by up to
/// 2^-24 (|S_u| + |S_v|), and a root may lie outside of its patch by what patch_rounding(p, q) moves it
/// (shaders/shared/patch_newton.h). In patch units; polynomial patches stay below it, for |S_u| <= 2 p there.
double largest_speed(int degree_u, int degree_v);

struct CutPatch {
    std::vector<BezierPatch> pieces;
    bool too_fast = false; // a piece is left above largest_speed: the most or the narrowest pieces were not enough
    PatchSpeed speed_mm;   // bounds of |S_u| and |S_v| by the parameters of the patch that was cut
};
inline constexpr size_t kMostPieces = 512; // of one patch

/// Cuts a patch, the piece first whose points rounding moves farthest, until each is within largest_speed, or so small
/// that rounding moves its points by less than a thousandth of what the patch's own rounding is. A cut lies at 2^-k or
/// 1 - 2^-k of a piece, where both halves are as fast: so each has a like share of the decades of weights, and the
/// number of pieces along a parameter grows with their logarithm. Patches of modest weights come back as they are.
/// Pieces come in the order of their places, u first. Domain: as of patch_speed. Source: de Casteljau in double.
CutPatch cut_by_weights(BezierPatch patch);

} // namespace trimray
