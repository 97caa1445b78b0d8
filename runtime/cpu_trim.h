// Which rays of a packet meet their face inside its trims, in each trim mode. Included once per target.
#if defined(TRIMRAY_CPU_TRIM_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_TRIM_H
#undef TRIMRAY_CPU_TRIM_H
#else
#define TRIMRAY_CPU_TRIM_H
#endif

#include "runtime/cpu_fetch.h"
#include "runtime/tracer.h"
#include "shaders/shared/trim_lookup.h"

SHARED_OPEN

/// Lanes of `open`, all in mixed cells with the words `cell`, that lie inside by the pieces of their cells: one cell at
/// a time for all lanes in it, of which a packet has few, so that entries and points are read once.
FN mask inside_by_pieces(const FetchSource& source, const TrimFace& trim, integer cell, real2 uv, mask open,
                         uint64_t& curve_tests)
{
    mask inside = cell_says_inside(cell);
    alignas(64) uint words[kLanes];
    store(cell, words);
    for (uint left = lane_bits(open); left != 0;) {
        const uint word = words[__builtin_ctz(left)];
        const mask here = open && cell == integer(word);
        const uint here_bits = lane_bits(here);
        left &= ~here_bits;
        uint at = cell_first_entry(trim, word), entry;
        do {
            entry = fetch_entry_word(FETCH_PASS at);
            inside =
                differ(inside, here && entry_crossed(FETCH_PASS trim, entry, fetch_entry_eta(FETCH_PASS at), uv, here));
            curve_tests += uint64_t(__builtin_popcount(here_bits));
            ++at;
        } while (!entry_is_last(entry));
    }
    return inside;
}

/// Lanes of `asked` that lie inside the trims of a face that has some. uv in [0, kUvBelowOne] in those lanes; the
/// answer of other lanes means nothing. `mode` is not auto, and the pack holds what it reads (choose_trim).
FN_LARGE mask inside_trims(const FetchSource& source, TrimMode mode, const FaceRecord& face, real2 uv, mask asked,
                           uint64_t& curve_tests)
{
    // a face without pieces has neither cells nor texture, and no inside
    if ((mode != TrimMode::Sdf && face.grid == 0) || (mode != TrimMode::Exact && face.sdf_size == 0))
        return mask(false);
    const TrimFace trim = trim_face(face);
    // lanes that do not ask look up a point that exists
    const real2 q(select(asked, uv.x, real(0.0f)), select(asked, uv.y, real(0.0f)));
    if (mode == TrimMode::Sdf)
        return sdf_distance(FETCH_PASS trim, q) > 0.0f;

    // the cell's class takes one fetch and decides most; the texture's four come before the pieces
    const integer cell = cell_word(FETCH_PASS trim, q);
    mask inside = cell_says_inside(cell);
    mask open = asked && cell_is_mixed(cell);
    if (!any_lane(open))
        return inside;
    if (mode == TrimMode::Hybrid) {
        const real distance_texels = sdf_distance(FETCH_PASS trim, q);
        inside = select(open, distance_texels > 0.0f, inside);
        open = open && abs(distance_texels) <= face.sdf_band_texels;
        if (!any_lane(open))
            return inside;
    }
    return select(open, inside_by_pieces(source, trim, cell, q, open, curve_tests), inside);
}

SHARED_CLOSE
#endif
