// Edge uses -> closed chains of pieces in uv_file: which end joins which, which period each use belongs to, and how
// gaps, poles and loops that go once around are closed.
#pragma once

#include "preprocess/trims/trim_check.h"

#include <string>
#include <vector>

namespace trimray {

/// Lengths on the surface per unit of u and of v, in mm: a constant metric that trims are measured in.
struct TrimMetric {
    Vec2d mm_per_uv{1, 1}; // the largest over the domain where it varies
    double tolerance_mm = 0;
    double longer_side_mm = 0;
};

/// A closed chain of pieces, ends shared; or one that ends whole periods beyond its start (winding).
struct TrimChain {
    std::vector<CurvePiece> pieces;
    int winding_u = 0, winding_v = 0;
    int loop = -1; // number of the face's loop, as walked; negative: made of several, or of none
};

struct ChainReport {
    std::vector<TrimFinding> findings; // open loops, and loops around a surface in the wrong direction
    int loop = 0;                      // number of the loop at work
    bool had_open_loop = false;
    double largest_gap_mm = 0;
    double largest_deviation_mm = 0; // of the fit
    double largest_move_mm = 0;      // of an end to meet its neighbour
    std::string failure;             // not empty: the chains cannot be used, and why
};

/// The metric of a surface over a rectangle of its parameters.
TrimMetric trim_metric(const CadSurface& surface, const Rect2d& domain, double relative_tolerance);

/// Fits the pcurves of a face's loops and joins them.
/// Ends that nearly meet are moved together. Ends within twice the face's own tolerance (each may be off by it; on the
/// surface: a gap along a pole is no gap) meet where their tangents cross nearby (trim_corner.h). What is left is
/// closed by a line, and counts as open where it is wider than that. Uses follow each other in the order given where
/// they meet; otherwise the nearest end goes next, turned around if need be. The two uses of a seam stay whole periods
/// apart where the loop closes that way.
std::vector<TrimChain> build_chains(const CadFace& face, double relative_tolerance, TrimMetric& metric,
                                    ChainReport& report);

/// Bounding rectangle of the chains' pieces.
Rect2d chain_bounds(const std::vector<CurvePiece>& pieces);

/// Area enclosed in uv_file, positive for a counter-clockwise chain.
double signed_area(const std::vector<CurvePiece>& pieces);

} // namespace trimray
