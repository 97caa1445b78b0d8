// Where the shared formulas' data comes from on the CPU: the pack's arrays. Included once per target.
#if defined(TRIMRAY_CPU_FETCH_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_FETCH_H
#undef TRIMRAY_CPU_FETCH_H
#else
#define TRIMRAY_CPU_FETCH_H
#endif

#include "format/derive_kd.h"
#include "format/pack_image.h"
#include "shaders/shared/language.h"

SHARED_OPEN

struct FetchSource {
    const float* control_points;
    const uint* cells;
    const CellEntry* cell_entries;
    const float* trim_points;
    const uint* sdf_words;
    const KdTrims* kd; // null unless the trim mode is kd
};

static inline FetchSource fetch_source(const PackImage& image, const KdTrims* kd)
{
    return {image.control_points.data(), image.cells.data(),     image.cell_entries.data(),
            image.trim_points.data(),    image.sdf_words.data(), kd};
}

FN scalar fetch_control(FETCH_PARAM uint index)
{
    return source.control_points[index];
}
FN uint fetch_cell(FETCH_PARAM uint index)
{
    return source.cells[index];
}
FN uint fetch_entry_word(FETCH_PARAM uint index)
{
    return source.cell_entries[index].word;
}
FN scalar fetch_entry_eta(FETCH_PARAM uint index)
{
    return source.cell_entries[index].eta;
}
FN scalar2 fetch_trim_point(FETCH_PARAM uint index)
{
    const float* p = source.trim_points + 2 * std::size_t(index);
    return scalar2(p[0], p[1]);
}
/// Word `index` of the texture that begins at first_word
FN integer fetch_sdf_word(FETCH_PARAM uint first_word, integer index)
{
    return gather(source.sdf_words + first_word, index);
}
/// Byte `at` of the texture that begins at first_word, and in the next 8 bits the byte after it. Both must be the
/// texture's. The four bytes that are read end with them, or are the texture's first: none lies behind the array.
FN integer fetch_sdf_pair(FETCH_PARAM uint first_word, integer at)
{
    const integer from = max(at, integer(2u)) - integer(2u);
    return gather_bytes(source.sdf_words + first_word, from) >> ((at - from) << integer(3u));
}
FN scalar2 fetch_kd_point(FETCH_PARAM uint index)
{
    const float* p = source.kd->points.data() + 2 * std::size_t(index);
    return scalar2(p[0], p[1]);
}

SHARED_CLOSE
#endif
