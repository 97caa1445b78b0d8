// What is doubtful about a face's loops. None of it keeps a face from being shown: its inside is decided by one rule,
// whatever its loops are like.
//
// The rule: even-odd. Loops are closed (pcurves that nearly meet are moved together, wider gaps are closed by a
// straight line in uv), then a point is inside where a ray from it crosses them an odd number of times; a crossing
// counts wherever it comes from. So orientation, order and nesting of loops mean nothing, a loop within a hole is an
// island, two loops that overlap leave their overlap out, and where a loop crosses itself its lobes are inside as often
// as they are walked around an odd number of times. Only where a surface closes on itself, and a loop therefore has no
// outside, is its direction asked: the face lies on its left (trim_window.h).
#pragma once

#include "preprocess/import/cad_model.h"
#include "preprocess/trims/trim_curve.h"

#include <string>
#include <vector>

namespace trimray {

enum class TrimFindingKind : uint8_t {
    OpenLoop,      // a gap wider than the face's tolerance was closed by a line
    TurnedLoop,    // an outer loop runs clockwise, or a hole counter-clockwise, in uv
    TouchingLoops, // two pieces that do not follow each other have a point in common
    CrossingLoops, // two pieces pass each other
    NotGrown,      // a loop could not be moved outwards by what its neighbours may miss it by (trim_grow.h)
};

enum class NotGrownReason : uint8_t {
    CrossesItself, // or another loop: neither side of it is the inside all along
    NoRoom,        // a hole that would close, or an outer loop turned inside out
    Surface,       // beyond its knots the face's spline has weights that are not positive: none of its loops was moved
};

struct TrimFinding {
    TrimFindingKind kind = TrimFindingKind::OpenLoop;
    Vec2d uv_file;           // where
    double gap_mm = 0;       // OpenLoop
    int loop = 0, other = 0; // of the face, in the order in which they were walked; Touching, Crossing: of both pieces
    NotGrownReason reason = NotGrownReason::CrossesItself; // NotGrown
};

/// "loop is open", "loop is turned round", "loops touch", "loops cross", "loop is not grown".
const char* finding_name(TrimFindingKind kind);

/// Where and how much, in a few words.
std::string finding_detail(const TrimFinding& finding);

/// A closed loop in uv_face, and the number of the face's loop that it comes from (negative: of several, or of none).
struct CheckedLoop {
    const std::vector<CurvePiece>* pieces = nullptr;
    int loop = 0;
};

// Two pieces nearer than this in uv_face have a point in common: twice the grid that points are rounded to.
inline constexpr double kTouching = 0x1p-21;
inline constexpr size_t kMostContacts = 8; // findings of contact a face

/// Adds what is doubtful about a face's closed loops. Pieces along no edge or along a seam are not compared, nor two
/// that follow each other or are uses of one edge. `domain` is uv_file of uv_face.
void check_loops(const std::vector<CheckedLoop>& loops, const CadFace& face, const Rect2d& domain,
                 std::vector<TrimFinding>& findings);

} // namespace trimray
