// A pcurve -> few lines and cubic Beziers, each monotone in u and in v, within a tolerance: samples dense enough to
// stand for the curve, cut where it turns, then the longest stretches that one line or one cubic fits.
#pragma once

#include "format/trim_piece.h"
#include "preprocess/import/cad_model.h"

#include <vector>

namespace trimray {

/// CurvePiece::use of what no edge runs along: a line that closes a gap, a pole, the border of a period's window.
inline constexpr int kNoUse = -1;

/// CurvePiece::grow_mm of what stays on its line: seams, poles, the border of a period's window.
inline constexpr double kHeld = -1;

/// A line (points 0 and 3) or a polynomial cubic Bezier in uv; the control points are ordered in u and in v, so the
/// piece is monotone in both.
struct CurvePiece {
    Vec2d p[4];
    bool cubic = false;
    int use = kNoUse;       // the edge use that it comes from, counted over the face's loops in order
    double grow_mm = kHeld; // what it is moved outwards by, less rounding (trim_grow.h)
};

// Tangents are one direction if the sine of the angle between them is less.
inline constexpr double kSameDirection = 0.05;

/// A line between two points, of no use.
CurvePiece line_piece(Vec2d a, Vec2d b);

/// Turns the way along the pieces round.
void reverse_pieces(std::vector<CurvePiece>& pieces);

/// The way that a piece leaves its start, or reaches its end: to the next point of its control polygon that is another.
/// 0 for a piece without length.
Vec2d start_direction(const CurvePiece& piece);
Vec2d end_direction(const CurvePiece& piece);

/// Moves an end, and the control point beside it. The move, in mm, is added to what the piece grows by, unless it is
/// held.
void move_start(CurvePiece& piece, Vec2d to, Vec2d mm_per_uv);
void move_end(CurvePiece& piece, Vec2d to, Vec2d mm_per_uv);

/// Parameter of the point whose u (`v`: whose v) is x; of a piece along which that coordinate changes.
/// Outside of the piece: a cubic's end, a line's parameter beyond it.
double parameter_at(const CurvePiece& piece, bool v, double x);

/// The piece as the pack's functions take one, in the coordinates that it is in.
MonotonePiece monotone(const CurvePiece& piece);

/// Puts the inner points of a cubic in order between its ends, in u and in v; where they were, nothing changes.
void order_points(CurvePiece& piece);

/// Both halves of `piece` cut at parameter t. Source: de Casteljau.
void split_piece(const CurvePiece& piece, double t, CurvePiece& before, CurvePiece& after);

/// Point of a B-spline curve at t. Domain: knots[degree] <= t <= knots[n]; outside, the end spans go on.
Vec2d curve_point(const SplineCurve2d& curve, double t);

/// Whether the curve is one line between two points.
bool is_straight(const SplineCurve2d& curve);

struct CurveFit {
    std::vector<CurvePiece> pieces; // in the order of t, consecutive ends equal
    double deviation = 0;           // largest distance of the curve's samples from their piece, in the metric
    bool finite = true;             // false: the curve has a point that is not; no pieces then
};

/// Fits the curve over [first, last]. A distance is sqrt((metric.x du)^2 + (metric.y dv)^2); `tolerance` is one.
/// The ends of the first and last piece are the curve's, bit for bit.
CurveFit fit_curve(const SplineCurve2d& curve, double first, double last, Vec2d metric, double tolerance);

} // namespace trimray
