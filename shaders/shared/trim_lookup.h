// Is a point of a face's domain inside its trim loops? By the face's cells and the pieces of a mixed cell, exactly as
// pack_layout.h states the rule at CellEntry, or by the sign of the distance texture.
#if defined(TRIMRAY_SHARED_TRIM_LOOKUP_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_TRIM_LOOKUP_H
#undef TRIMRAY_SHARED_TRIM_LOOKUP_H
#else
#define TRIMRAY_SHARED_TRIM_LOOKUP_H
#endif

#include "format/pack_layout.h"
#include "shaders/shared/language.h"

SHARED_OPEN

// Data comes through fetch_cell, fetch_entry_word, fetch_entry_eta, fetch_trim_point (index in points) and
// fetch_sdf_word.

// The constants of one face
struct TrimFace {
    uint columns;
    uint rows;
    uint first_cell;
    uint first_entry;
    uint first_point;
    uint sdf_width; // 0: no texture
    uint sdf_height;
    uint sdf_first_word;
};

FN TrimFace trim_face(FaceRecord face)
{
    TrimFace trim;
    trim.columns = face.grid & 0xffffu;
    trim.rows = face.grid >> 16;
    trim.first_cell = face.first_cell;
    trim.first_entry = face.first_entry;
    trim.first_point = face.first_point;
    trim.sdf_width = face.sdf_size & 0xffffu;
    trim.sdf_height = face.sdf_size >> 16;
    trim.sdf_first_word = face.sdf_first_word;
    return trim;
}

// The cell's word at uv_face, which must lie in [0, kUvBelowOne]^2
FN integer cell_word(FETCH_PARAM TrimFace face, real2 uv)
{
    PRECISE real column = uv.x * scalar(face.columns);
    PRECISE real row = uv.y * scalar(face.rows);
    integer i = min(to_integer(column), integer(face.columns - 1u));
    integer j = min(to_integer(row), integer(face.rows - 1u));
    return fetch_cell(FETCH_PASS integer(face.first_cell) + j * integer(face.columns) + i);
}
FN mask cell_is_mixed(integer word)
{
    return (word & integer(kCellMixedCornerOut)) != integer(0u);
}
FN mask cell_says_inside(integer word)
{
    return (word & integer(1u)) != integer(0u);
}
FN integer cell_first_entry(TrimFace face, integer word)
{
    return integer(face.first_entry) + (word >> integer(2u));
}

// u < P(v) for a monotone cubic with the point's coordinates subtracted from its control points, v0 < 0 <= v3:
// Newton on v(t) = 0 kept in its bracket; the sign of u(t) there. Bernstein form, so that ends are exact.
FN_LARGE mask left_of_cubic(real u0, real u1, real u2, real u3, real v0, real v1, real v2, real v3)
{
    real lo = real(0.0f);
    real hi = real(1.0f);
    PRECISE real t = -v0 / max(v3 - v0, real(1e-30f)); // the chord's root
    mask moving = !(t < 0.0f) || t < 0.0f;
    for (int i = 0; i < 32 && any_lane(moving); ++i) {
        PRECISE real s = 1.0f - t;
        PRECISE real a = s * v0 + t * v1; // de Casteljau: the last two points give the value and the slope
        PRECISE real b = s * v1 + t * v2;
        PRECISE real c = s * v2 + t * v3;
        PRECISE real d = s * a + t * b;
        PRECISE real e = s * b + t * c;
        PRECISE real value = s * d + t * e;
        PRECISE real slope = 3.0f * (e - d);
        lo = select(moving && value < 0.0f, t, lo);
        hi = select(moving && value >= 0.0f, t, hi);
        PRECISE real next = t - value / max(slope, real(1e-30f));
        // a step that leaves the bracket is replaced by its middle
        next = select(next > lo && next < hi, next, 0.5f * (lo + hi));
        mask still = moving && abs(next - t) > 2.0f * kRounding && hi - lo > kRounding;
        t = select(moving, next, t);
        moving = still;
    }
    PRECISE real s = 1.0f - t;
    PRECISE real u = s * s * s * u0 + 3.0f * s * t * (s * u1 + t * u2) + t * t * t * u3;
    return u > 0.0f;
}

// Does the path from uv to the cell's reference corner cross the piece of this entry an odd number of times?
FN_LARGE mask entry_crossed(FETCH_PARAM TrimFace face, integer word, real eta, real2 uv)
{
    integer first = integer(face.first_point) + (word >> integer(kPiecePointShift));
    mask cubic = (word & integer(kPieceCubic)) != integer(0u);
    integer last = first + select(cubic, integer(3u), integer(1u));
    real2 p0 = fetch_trim_point(FETCH_PASS first);
    real2 p3 = fetch_trim_point(FETCH_PASS last);
    mask upward = p0.y <= p3.y;
    real2 a = select(upward, p0, p3); // a.v <= b.v
    real2 b = select(upward, p3, p0);

    mask has_eta = !(eta == real(kNoEta));
    mask below_eta = uv.y < eta;
    mask in_band = a.y <= uv.y && uv.y < b.y;
    mask u_grows = a.x < b.x;
    mask on_path = in_band && (!has_eta || differ(!u_grows, below_eta)); // u grows ? v < eta : v >= eta

    mask left = uv.x < min(a.x, b.x);
    mask between = !left && uv.x < max(a.x, b.x);
    // u < a.u + (v - a.v) (b.u - a.u) / (b.v - a.v), multiplied out
    PRECISE real side_u = (uv.x - a.x) * (b.y - a.y);
    PRECISE real side_v = (uv.y - a.y) * (b.x - a.x);
    mask left_of_line = side_u < side_v;
    mask solve = on_path && between && cubic;
    mask left_of_piece = left_of_line;
    if (any_lane(solve)) {
        // lines have no inner control points; their lanes fetch the ends again
        real2 c1 = fetch_trim_point(FETCH_PASS select(solve, first + integer(1u), first));
        real2 c2 = fetch_trim_point(FETCH_PASS select(solve, first + integer(2u), first));
        real2 b1 = select(upward, c1, c2);
        real2 b2 = select(upward, c2, c1);
        mask left_of_curve = left_of_cubic(a.x - uv.x, b1.x - uv.x, b2.x - uv.x, b.x - uv.x, a.y - uv.y, b1.y - uv.y,
                                           b2.y - uv.y, b.y - uv.y);
        left_of_piece = select(solve, left_of_curve, left_of_line);
    }
    mask horizontal = on_path && (left || (between && left_of_piece));
    return differ(horizontal, has_eta && below_eta);
}
FN mask entry_is_last(integer word)
{
    return (word & integer(kEntryLast)) != integer(0u);
}

// Signed distance in texels at uv_face, positive inside: one bilinear look-up in the 8-bit texture
FN real sdf_texel(FETCH_PARAM TrimFace face, integer x, integer y)
{
    integer words_per_row = integer((face.sdf_width + 3u) >> 2);
    integer word = fetch_sdf_word(FETCH_PASS integer(face.sdf_first_word) + y * words_per_row + (x >> integer(2u)));
    integer byte = (word >> ((x & integer(3u)) << integer(3u))) & integer(0xffu);
    return to_real(byte) - 128.0f;
}
FN real sdf_distance(FETCH_PARAM TrimFace face, real2 uv)
{
    // texel centres at (i + 0.5) / width; beyond the outer centres the border texel goes on
    PRECISE real x = clamp(uv.x * scalar(face.sdf_width) - 0.5f, real(0.0f), real(scalar(face.sdf_width) - 1.0f));
    PRECISE real y = clamp(uv.y * scalar(face.sdf_height) - 0.5f, real(0.0f), real(scalar(face.sdf_height) - 1.0f));
    integer i = to_integer(x);
    integer j = to_integer(y);
    integer i1 = min(i + integer(1u), integer(face.sdf_width - 1u));
    integer j1 = min(j + integer(1u), integer(face.sdf_height - 1u));
    PRECISE real fx = x - to_real(i);
    PRECISE real fy = y - to_real(j);
    real d00 = sdf_texel(FETCH_PASS face, i, j);
    real d10 = sdf_texel(FETCH_PASS face, i1, j);
    real d01 = sdf_texel(FETCH_PASS face, i, j1);
    real d11 = sdf_texel(FETCH_PASS face, i1, j1);
    PRECISE real lower = d00 + (d10 - d00) * fx;
    PRECISE real upper = d01 + (d11 - d01) * fx;
    return (lower + (upper - lower) * fy) * kSdfTexelQuantum;
}

SHARED_CLOSE
#endif
