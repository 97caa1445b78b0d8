// Is a point of a face's domain inside its trim loops? By the face's cells and the pieces of a mixed cell, exactly as
// pack_layout.h states the rule at CellEntry, or by the sign of the distance texture.
#if defined(TRIMRAY_SHARED_TRIM_LOOKUP_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_TRIM_LOOKUP_H
#undef TRIMRAY_SHARED_TRIM_LOOKUP_H
#else
#define TRIMRAY_SHARED_TRIM_LOOKUP_H
#endif

#include "format/pack_layout.h"
#include "shaders/shared/monotone_side.h"

SHARED_OPEN

// Data comes through fetch_sdf_word and fetch_sdf_pair, a lane each, and fetch_cell, fetch_entry_word, fetch_entry_eta
// and fetch_trim_point (index in points), the same for all lanes: a cell is asked for the lanes in it.

// The constants of one face
struct TrimFace {
    uint columns;
    uint rows;
    uint first_cell;
    uint first_entry;
    uint first_point;
};

FN TrimFace trim_face(FaceRecord face)
{
    TrimFace trim;
    trim.columns = face.grid & 0xffffu;
    trim.rows = face.grid >> 16;
    trim.first_cell = face.first_cell;
    trim.first_entry = face.first_entry;
    trim.first_point = face.first_point;
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
    CubicFromPoint cubic = cubic_from_point(a, b, c, d, uv);
    real lo = real(0.0f);
    real hi = real(1.0f);
    PRECISE real t = clamp(-(cubic.u0 * per_du + cubic.v0 * per_dv), real(0.0f), real(1.0f));
    mask left = asked;
    mask moving = asked;
    for (int i = 0; i < 32 && any_lane(moving); ++i) {
        real2 at = cubic_offset(cubic, t);
        left = select(moving, at.x > 0.0f, left);
        // the curve reaches uv's v at a t no smaller (at.y <= 0) or no larger (at.y >= 0): with u there on the same
        // side
        mask decided = u_grows ? select(left, at.y <= 0.0f, at.y >= 0.0f) : select(left, at.y >= 0.0f, at.y <= 0.0f);
        lo = select(at.y < 0.0f, t, lo);
        hi = select(at.y < 0.0f, hi, t);
        PRECISE real slope = k1 + t * (2.0f * k2 + 3.0f * t * k3);
        PRECISE real next = t - (at.x * per_du + at.y * per_dv) / max(slope, real(1e-30f));
        // a step that leaves the bracket is replaced by its middle
        next = select(next > lo && next < hi, next, 0.5f * (lo + hi));
        moving = moving && !decided && abs(next - t) > 2.0f * kRounding && hi - lo > kRounding;
        t = next;
    }
    return left;
}

// Does the rectangle [lo, hi] meet the box of this entry's piece?
FN mask meets_piece_box(FETCH_PARAM TrimFace face, uint word, real2 lo, real2 hi)
{
    uint first = face.first_point + (word >> kPiecePointShift);
    scalar2 a = fetch_trim_point(FETCH_PASS first);
    scalar2 b = fetch_trim_point(FETCH_PASS first + ((word & kPieceCubic) != 0u ? 3u : 1u));
    return lo.x <= max(a.x, b.x) && hi.x >= min(a.x, b.x) && lo.y <= max(a.y, b.y) && hi.y >= min(a.y, b.y);
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
            left_of_piece = left_of_line(a, b, uv);
        }
        left = left || (between && left_of_piece);
    }
    mask horizontal = on_path && left;
    if (has_eta)
        return differ(horizontal, below_eta);
    return horizontal;
}

// ---- distance textures: SPEC.md, "Distance textures" ---------------------------------------------------------------

// The constants of a face's texture
struct SdfFace {
    uint first_word;
    uint tile_shift;
    uint stride;    // bytes from one row to the next
    uint upper_row; // the same, 0 where there is one row
    uint tiles_u;
    uint first_tile;  // byte at which tiles begin
    uint last_column; // at which a look-up may begin
    uint last_row;
    scalar2 scale; // a point's place among the texels: scale * uv - inset, from 0 to end
    scalar inset;
    scalar2 end;
};

// Domain: face.sdf_size != 0
FN SdfFace sdf_face(FaceRecord face)
{
    uint width = face.sdf_size & 0xffffu;
    uint height = face.sdf_size >> 16;
    SdfFace sdf;
    sdf.first_word = face.sdf_first_word;
    sdf.tile_shift = (face.flags >> kFaceTileShiftBit) & kFaceTileShiftMask;
    sdf.last_column = width > 2u ? width - 2u : 0u;
    sdf.last_row = height > 2u ? height - 2u : 0u;
    sdf.stride = sdf.tile_shift > 0u ? (1u << sdf.tile_shift) + 1u : sdf.last_column + 2u;
    sdf.upper_row = sdf.tile_shift > 0u || height > 1u ? sdf.stride : 0u;
    sdf.tiles_u = (sdf.last_column >> sdf.tile_shift) + 1u;
    sdf.first_tile = 2u * sdf.tiles_u * ((sdf.last_row >> sdf.tile_shift) + 1u);
    sdf.inset = (face.flags & kFaceTexelCentres) != 0u ? 0.5f : kSdfInset;
    sdf.end = scalar2(scalar(width - 1u), scalar(height - 1u));
    sdf.scale = scalar2(sdf.end.x + 2.0f * sdf.inset, sdf.end.y + 2.0f * sdf.inset);
    return sdf;
}

// The four texels around a point, in quanta, and where between them it lies
struct SdfCell {
    real d00;
    real d10;
    real d01;
    real d11;
    real2 f;
};
FN real sdf_level(integer pair, uint which)
{
    return to_real((pair >> integer(8u * which)) & integer(0xffu)) - 128.0f;
}
// Fetches: rows two; tiles one for their entry, and two more where a lane's tile is kept
FN SdfCell sdf_cell(FETCH_PARAM SdfFace face, real2 uv)
{
    // between the domain's border and the outer texels these go on
    PRECISE real x = clamp(uv.x * face.scale.x - face.inset, real(0.0f), real(face.end.x));
    PRECISE real y = clamp(uv.y * face.scale.y - face.inset, real(0.0f), real(face.end.y));
    integer i = min(to_integer(x), integer(face.last_column));
    integer j = min(to_integer(y), integer(face.last_row));
    integer lower;
    integer upper;
    if (face.tile_shift == 0u) {
        integer at = j * integer(face.stride) + i;
        lower = fetch_sdf_pair(FETCH_PASS face.first_word, at);
        upper = fetch_sdf_pair(FETCH_PASS face.first_word, at + integer(face.upper_row));
    } else {
        integer shift = integer(face.tile_shift);
        integer inner = integer((1u << face.tile_shift) - 1u);
        integer tile = (j >> shift) * integer(face.tiles_u) + (i >> shift);
        integer entries = fetch_sdf_word(FETCH_PASS face.first_word, tile >> integer(1u)); // two of 16 bits
        integer entry = (entries >> ((tile & integer(1u)) << integer(4u))) & integer(0xffffu);
        mask kept = integer(kFirstTile - 1u) < entry;
        lower = select(entry == integer(kTileIn), integer(0xffffu), integer(0u));
        upper = lower;
        if (any_lane(kept)) {
            integer at = integer(face.first_tile) + (entry - integer(kFirstTile)) * integer(face.stride * face.stride) +
                         (j & inner) * integer(face.stride) + (i & inner);
            at = select(kept, at, integer(0u));
            lower = select(kept, fetch_sdf_pair(FETCH_PASS face.first_word, at), lower);
            upper = select(kept, fetch_sdf_pair(FETCH_PASS face.first_word, at + integer(face.stride)), upper);
        }
    }
    SdfCell cell;
    cell.d00 = sdf_level(lower, 0u);
    cell.d10 = sdf_level(lower, 1u);
    cell.d01 = sdf_level(upper, 0u);
    cell.d11 = sdf_level(upper, 1u);
    cell.f = real2(x - to_real(i), y - to_real(j));
    return cell;
}

FN real sdf_interpolated(SdfCell cell)
{
    PRECISE real lower = cell.d00 + (cell.d10 - cell.d00) * cell.f.x;
    PRECISE real upper = cell.d01 + (cell.d11 - cell.d01) * cell.f.x;
    return (lower + (upper - lower) * cell.f.y) * kSdfTexelQuantum;
}

// Signed distance in texels at uv_face, between -128 and 127 quanta: farther ones read as these
FN real sdf_distance(FETCH_PARAM SdfFace face, real2 uv)
{
    return sdf_interpolated(sdf_cell(FETCH_PASS face, uv));
}
FN mask sdf_inside(real distance_texels)
{
    return distance_texels >= 0.0f;
}

SHARED_CLOSE
#endif
