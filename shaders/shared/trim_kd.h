// Is a point of a face's domain inside its trim loops? By the kd-tree baseline: what it costs to cross a run of a leaf
// (format/kd_layout.h). The walk to the leaf is each tracer's own.
// Source: Sloup & Havran, "Optimizing Ray Tracing of Trimmed NURBS Surfaces on the GPU", CGF 2021; the bisection of a
// monotone piece: Schollmeyer & Froehlich, "Direct Trimming of NURBS Surfaces on the GPU", SIGGRAPH 2009.
#if defined(TRIMRAY_SHARED_TRIM_KD_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_TRIM_KD_H
#undef TRIMRAY_SHARED_TRIM_KD_H
#else
#define TRIMRAY_SHARED_TRIM_KD_H
#endif

#include "format/kd_layout.h"
#include "shaders/shared/monotone_side.h"

SHARED_OPEN

// Data comes through fetch_kd_point (index in points).

// Halvings of [0,1]: then t is known to an ulp near 1
const int kKdBisections = 24;

FN bool kd_is_leaf(KdNode node)
{
    return (node.word & kKdLeaf) != 0u;
}
FN uint kd_number(KdNode node)
{
    return node.word >> kKdNumberShift;
}
FN bool kd_splits_v(KdNode node)
{
    return (node.word & kKdKindMask) == kKdSplitV;
}

FN uint kd_run_count(KdNode leaf)
{
    uint number = kd_number(leaf);
    return (leaf.word & kKdKindMask) == kKdLeafRun && number > 1u ? 1u : number;
}

// Points from one piece's first to the next one's
FN uint kd_stride(KdRun run)
{
    return (run.word & kKdRunCubic) != 0u ? 3u : 1u;
}

// What the box of a run or of a piece says of u < P(v). a, b: its ends
FN mask kd_left_of_box(scalar2 a, scalar2 b, real2 uv)
{
    return uv.x < min(a.x, b.x);
}
FN mask kd_right_of_box(scalar2 a, scalar2 b, real2 uv)
{
    return uv.x >= max(a.x, b.x);
}

// crossed(run) but for the points that are between its ends and in its box
FN mask kd_crossed_beside(KdRun run, scalar2 a, scalar2 b, real2 uv)
{
    mask below = uv.y < a.y && mask((run.word & kKdRunBelow) != 0u);
    mask above = uv.y >= b.y && mask((run.word & kKdRunAbove) != 0u);
    mask level = a.y <= uv.y && uv.y < b.y;
    return below || above || (level && kd_left_of_box(a, b, uv));
}
FN mask kd_in_box(scalar2 a, scalar2 b, real2 uv)
{
    return a.y <= uv.y && uv.y < b.y && !kd_left_of_box(a, b, uv) && !kd_right_of_box(a, b, uv);
}

// The run's piece at v, which is between its ends: the last that begins at v or below
FN uint kd_piece_at(FETCH_PARAM uint first_point, uint stride, uint piece_count, scalar v)
{
    uint piece = 0u;
    while (piece_count > 1u) {
        uint half_count = piece_count >> 1;
        bool beyond = fetch_kd_point(FETCH_PASS first_point + (piece + half_count) * stride).y <= v;
        piece += beyond ? half_count : 0u;
        piece_count = beyond ? piece_count - half_count : half_count;
    }
    return piece;
}

// u < P(v) for a monotone cubic, a.v <= v < d.v, of the lanes `asked`. Each halving leaves a part of the curve: the
// point is on one side of that part's box, which decides, or in it.
FN_LARGE mask kd_left_of_cubic(scalar2 a, scalar2 b, scalar2 c, scalar2 d, real2 uv, mask asked)
{
    mask grows = mask(a.x < d.x);
    CubicFromPoint cubic = cubic_from_point(a, b, c, d, uv);
    mask left = asked;
    mask open = asked;
    real lo = real(0.0f);
    scalar width = 0.5f;
    for (int i = 0; i < kKdBisections && any_lane(open); ++i) {
        PRECISE real t = lo + width;
        real2 at = cubic_offset(cubic, t);
        mask past = at.y > 0.0f; // the curve reaches the point's v before t
        left = select(open, at.x > 0.0f, left);
        // before t and growing, or after t and falling, the curve is where u(t) is or further left, so u(t) <= 0
        // decides; otherwise u(t) > 0 does
        open = open && differ(left, differ(past, grows));
        lo = select(past, lo, t);
        width = 0.5f * width;
    }
    return left;
}

// u < P(v) for a piece, of the lanes `asked`, which lie between its ends
FN mask kd_left_of_piece(FETCH_PARAM uint first_point, bool cubic, real2 uv, mask asked)
{
    scalar2 a = fetch_kd_point(FETCH_PASS first_point);
    scalar2 d = fetch_kd_point(FETCH_PASS first_point + (cubic ? 3u : 1u));
    mask left = kd_left_of_box(a, d, uv);
    mask open = asked && !left && !kd_right_of_box(a, d, uv);
    if (!any_lane(open))
        return left;
    if (!cubic)
        return left || (open && left_of_line(a, d, uv));
    scalar2 b = fetch_kd_point(FETCH_PASS first_point + 1u);
    scalar2 c = fetch_kd_point(FETCH_PASS first_point + 2u);
    return left || (open && kd_left_of_cubic(a, b, c, d, uv, open));
}

SHARED_CLOSE
#endif
