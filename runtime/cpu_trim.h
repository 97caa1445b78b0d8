// Which rays of a packet meet their face inside its trims, in each trim mode. Included once per target.
#if defined(TRIMRAY_CPU_TRIM_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_TRIM_H
#undef TRIMRAY_CPU_TRIM_H
#else
#define TRIMRAY_CPU_TRIM_H
#endif

#include "runtime/cpu_fetch.h"
#include "runtime/cpu_trim_kd.h"
#include "runtime/face_uv.h"
#include "runtime/tracer.h"
#include "shaders/shared/trim_lookup.h"

SHARED_OPEN

/// Lanes of `here`, all in one mixed cell, that lie inside by its pieces.
FN mask inside_by_pieces(const FetchSource& source, const TrimFace& trim, uint cell, real2 uv, mask here,
                         uint64_t& curve_tests)
{
    mask inside(cell_says_inside(cell));
    const auto lane_count = uint64_t(__builtin_popcount(lane_bits(here)));
    for (uint at = cell_first_entry(trim, cell);; ++at) {
        const uint entry = fetch_entry_word(FETCH_PASS at);
        inside = differ(inside, entry_crossed(FETCH_PASS trim, entry, fetch_entry_eta(FETCH_PASS at), uv, here));
        curve_tests += lane_count;
        if (entry_is_last(entry))
            return inside && here;
    }
}

/// Lanes of `asked` that lie inside by their cells; `in_mixed(cell, here)` answers the lanes `here` of a mixed cell.
/// One cell at a time for all lanes in it: a packet's rays lie in few (1.2 in the mean of five models framed whole), so
/// a cell, its entries and their points are read once, not gathered, and what they are is asked once.
template <class InMixed>
FN mask inside_by_cells(const FetchSource& source, const TrimFace& trim, real2 uv, mask asked, InMixed in_mixed)
{
    const integer index = cell_index(trim, uv);
    alignas(64) uint indices[kLanes];
    store(index, indices);
    mask inside(false);
    for (uint left = lane_bits(asked); left != 0;) {
        const uint at = indices[__builtin_ctz(left)];
        const mask here = asked && index == integer(at);
        left &= ~lane_bits(here);
        const uint cell = fetch_cell(FETCH_PASS at);
        if (cell_is_mixed(cell))
            inside = inside || in_mixed(cell, here);
        else if (cell_says_inside(cell))
            inside = inside || here;
    }
    return inside;
}

/// Lanes of `asked` for which the rectangle around uv with half sides `width` holds no trim: it lies in one cell and
/// meets no box of a piece that passes through. None where a face has no cells.
FN_LARGE mask lies_clear(const FetchSource& source, const FaceRecord& face, real2 uv, real2 width, mask asked)
{
    if (face.grid == 0)
        return mask(false);
    const TrimFace trim = trim_face(face);
    const real2 lo = clamp_to_domain(uv - width), hi = clamp_to_domain(uv + width);
    const real2 from(select(asked, lo.x, real(0.0f)), select(asked, lo.y, real(0.0f)));
    const mask in_one = asked && cell_index(trim, from) == cell_index(trim, hi);
    mask met(false);
    inside_by_cells(source, trim, from, in_one, [&](uint cell, mask here) HWY_ATTR {
        for (uint at = cell_first_entry(trim, cell);; ++at) {
            const uint entry = fetch_entry_word(FETCH_PASS at);
            met = met || (here && meets_piece_box(FETCH_PASS trim, entry, lo, hi));
            if (entry_is_last(entry))
                return mask(false);
        }
    });
    return in_one && !met;
}

FN mask inside_exact(const FetchSource& source, const FaceRecord& face, real2 uv, mask asked, uint64_t& curve_tests)
{
    const TrimFace trim = trim_face(face);
    return inside_by_cells(source, trim, uv, asked, [&](uint cell, mask here) HWY_ATTR {
        return inside_by_pieces(source, trim, cell, uv, here, curve_tests);
    });
}

/// The texture is asked for mixed cells only, and then once for all lanes: its gathers cost more than a cell's class.
FN mask inside_hybrid(const FetchSource& source, const FaceRecord& face, real2 uv, mask asked, uint64_t& curve_tests)
{
    const TrimFace trim = trim_face(face);
    mask sure(false), positive(false);
    bool looked_up = false;
    return inside_by_cells(source, trim, uv, asked, [&](uint cell, mask here) HWY_ATTR {
        if (!looked_up) {
            const real distance_texels = sdf_distance(FETCH_PASS sdf_face(face), uv);
            sure = abs(distance_texels) > face.sdf_band_texels;
            positive = sdf_inside(distance_texels);
            looked_up = true;
        }
        const mask inside = here && sure && positive, open = here && !sure;
        return any_lane(open) ? inside || inside_by_pieces(source, trim, cell, uv, open, curve_tests) : inside;
    });
}

/// Lanes of `asked` that lie inside the trims of a face that has some. uv in [0, kUvBelowOne] in those lanes; the
/// answer of other lanes means nothing. `mode` is not auto, and the pack holds what it reads (choose_trim).
FN_LARGE mask inside_trims(const FetchSource& source, TrimMode mode, uint face_id, const FaceRecord& face, real2 uv,
                           mask asked, uint64_t& curve_tests)
{
    if (mode == TrimMode::Kd)
        return inside_kd(source, source.kd->faces[face_id], uv, asked, curve_tests);
    // a face without pieces has neither cells nor texture, and no inside
    if ((mode != TrimMode::Sdf && face.grid == 0) || (mode != TrimMode::Exact && face.sdf_size == 0))
        return mask(false);
    // lanes that do not ask look up a cell and a texel that exist
    const real2 q(select(asked, uv.x, real(0.0f)), select(asked, uv.y, real(0.0f)));
    if (mode == TrimMode::Exact)
        return inside_exact(source, face, q, asked, curve_tests);
    if (mode == TrimMode::Hybrid)
        return inside_hybrid(source, face, q, asked, curve_tests);
    return sdf_inside(sdf_distance(FETCH_PASS sdf_face(face), q));
}

SHARED_CLOSE
#endif
