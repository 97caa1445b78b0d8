// Trims answered by the reference in double, lane by lane, for TrimMode::Reference. Included once per target.
#if defined(TRIMRAY_CPU_TRIM_REFERENCE_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_TRIM_REFERENCE_H
#undef TRIMRAY_CPU_TRIM_REFERENCE_H
#else
#define TRIMRAY_CPU_TRIM_REFERENCE_H
#endif

#include "runtime/cpu_lanes.h"
#include "shaders/shared/language.h"

SHARED_OPEN

/// Lanes of `asked` that lie inside the trims of a face. Notes the queries in the scratch where the job records them.
[[maybe_unused]] static HWY_ATTR HWY_NOINLINE mask inside_by_reference(const BlockJob& job, uint face, real2 uv,
                                                                       mask asked, BlockScratch& scratch)
{
    TrimQueries queries;
    store(uv.x, queries.u);
    store(uv.y, queries.v);
    queries.face = face;
    queries.asked = lane_bits(asked);
    queries.inside = 0;
    alignas(64) float inside[kLanes] = {};
    for (uint left = queries.asked; left != 0; left &= left - 1) {
        const int lane = __builtin_ctz(left);
        if (!job.reference->inside(face, queries.u[lane], queries.v[lane]))
            continue;
        inside[lane] = 1;
        queries.inside |= 1u << lane;
    }
    if (job.record_trim_queries)
        scratch.trim_queries.push_back(queries);
    return load(inside) > 0.0f;
}

SHARED_CLOSE
#endif
