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

// Data comes through fetch_sdf_word, a lane each, and fetch_cell, fetch_entry_word, fetch_entry_eta and
// fetch_trim_point (index in points), the same for all lanes: a cell is asked for the lanes in it.

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

// The cell at uv_face, which must lie in [0, kUvBelowOne]^2
FN integer cell_index(TrimFace face, real2 uv)
{
    PRECISE real column = uv.x * scalar(face.columns);
    PRECISE real row = uv.y * scalar(face.rows);
    integer i = min(to_integer(column), integer(face.columns - 1u));
    integer j = min(to_integer(row), integer(face.rows - 1u));
    return integer(face.first_cell) + j * integer(face.columns) + i;
}
FN bool cell_is_mixed(uint word)
{
    return (word & kCellMixedCornerOut) != 0u;
}
FN bool cell_says_inside(uint word)
{
    return (word & 1u) != 0u;
}
FN uint cell_first_entry(TrimFace face, uint word)
{
    return face.first_entry + (word >> 2);
}
FN bool entry_is_last(uint word)
{
    return (word & kEntryLast) != 0u;
}

// u < P(v) for the monotone cubic with control points a, b, c, d, a.y < d.y, of the lanes `asked`, whose uv lies
// between the ends' u and v. Along the curve f(t) = ((V(t) - v) / dv + (U(t) - u) / du) / 2 grows from f(0) <= 0 to
// f(1) >= 0. Near its root the two terms have opposite signs, and wherever they have, the curve passes uv on a known
// side: one or two of Newton's steps get there, more only where uv lies on the curve. They are kept in their bracket.
// Bernstein form of the distances from uv, so that ends are exact.
FN_LARGE mask left_of_cubic(scalar2 a, scalar2 b, scalar2 c, scalar2 d, real2 uv, mask asked)
{
    bool u_grows = a.x < d.x;
    scalar smallest_du = u_grows ? 1e-30f : -1e-30f;
    scalar per_du = 0.5f / (u_grows ? max(d.x - a.x, smallest_du) : min(d.x - a.x, smallest_du));
    scalar per_dv = 0.5f / max(d.y - a.y, 1e-30f);
    // f(t) = s(t) - s(uv), s(t) = ((k3 t + k2) t + k1) t, s(1) = 1: about t, where a curve's parameter runs evenly
    scalar s1 = (b.x - a.x) * per_du + (b.y - a.y) * per_dv;
    scalar s2 = (c.x - a.x) * per_du + (c.y - a.y) * per_dv;
    scalar k1 = 3.0f * s1;
    scalar k2 = 3.0f * (s2 - 2.0f * s1);
    scalar k3 = 1.0f - 3.0f * (s2 - s1);
    PRECISE real u0 = a.x - uv.x;
    PRECISE real u1 = b.x - uv.x;
    PRECISE real u2 = c.x - uv.x;
    PRECISE real u3 = d.x - uv.x;
    PRECISE real v0 = a.y - uv.y;
    PRECISE real v1 = b.y - uv.y;
    PRECISE real v2 = c.y - uv.y;
    PRECISE real v3 = d.y - uv.y;
    real lo = real(0.0f);
    real hi = real(1.0f);
    PRECISE real t = clamp(-(u0 * per_du + v0 * per_dv), real(0.0f), real(1.0f));
    mask left = asked;
    mask moving = asked;
    for (int i = 0; i < 32 && any_lane(moving); ++i) {
        PRECISE real s = 1.0f - t;
        PRECISE real w1 = 3.0f * s * s * t;
        PRECISE real w2 = 3.0f * s * t * t;
        PRECISE real w0 = s * s * s;
        PRECISE real w3 = t * t * t;
        PRECISE real u = (w0 * u0 + w1 * u1) + (w2 * u2 + w3 * u3);
        PRECISE real v = (w0 * v0 + w1 * v1) + (w2 * v2 + w3 * v3);
        left = select(moving, u > 0.0f, left);
        // the curve reaches uv's v at a t no smaller (v <= 0) or no larger (v >= 0): with u there on the same side
        mask decided = u_grows ? select(left, v <= 0.0f, v >= 0.0f) : select(left, v >= 0.0f, v <= 0.0f);
        lo = select(v < 0.0f, t, lo);
        hi = select(v < 0.0f, hi, t);
        PRECISE real slope = k1 + t * (2.0f * k2 + 3.0f * t * k3);
        PRECISE real next = t - (u * per_du + v * per_dv) / max(slope, real(1e-30f));
        // a step that leaves the bracket is replaced by its middle
        next = select(next > lo && next < hi, next, 0.5f * (lo + hi));
        moving = moving && !decided && abs(next - t) > 2.0f * kRounding && hi - lo > kRounding;
        t = next;
    }
    return left;
}

// Does the path from uv to the cell's reference corner cross the piece of this entry an odd number of times?
// Answers the lanes `asked`.
FN mask entry_crossed(FETCH_PARAM TrimFace face, uint word, scalar eta, real2 uv, mask asked)
{
    uint first = face.first_point + (word >> kPiecePointShift);
    bool cubic = (word & kPieceCubic) != 0u;
    scalar2 p0 = fetch_trim_point(FETCH_PASS first);
    scalar2 p3 = fetch_trim_point(FETCH_PASS first + (cubic ? 3u : 1u));
    bool upward = p0.y <= p3.y;
    scalar2 a = upward ? p0 : p3; // a.v <= b.v
    scalar2 b = upward ? p3 : p0;

    bool has_eta = eta != kNoEta;
    bool u_grows = a.x < b.x;
    mask below_eta = uv.y < eta;
    mask on_path = asked && a.y <= uv.y && uv.y < b.y;
    if (has_eta)
        on_path = on_path && differ(below_eta, mask(!u_grows));
    mask left = uv.x < min(a.x, b.x);
    mask between = on_path && !left && uv.x < max(a.x, b.x);
    if (any_lane(between)) {
        mask left_of_piece;
        if (cubic) {
            scalar2 c1 = fetch_trim_point(FETCH_PASS first + 1u);
            scalar2 c2 = fetch_trim_point(FETCH_PASS first + 2u);
            left_of_piece = left_of_cubic(a, upward ? c1 : c2, upward ? c2 : c1, b, uv, between);
        } else {
            // u < a.u + (v - a.v) (b.u - a.u) / (b.v - a.v), multiplied out
            PRECISE real side_u = (uv.x - a.x) * (b.y - a.y);
            PRECISE real side_v = (uv.y - a.y) * (b.x - a.x);
            left_of_piece = side_u < side_v;
        }
        left = left || (between && left_of_piece);
    }
    mask horizontal = on_path && left;
    if (has_eta)
        return differ(horizontal, below_eta);
    return horizontal;
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
