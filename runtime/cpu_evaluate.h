// Points of Bezier patches for the CPU tracer: the shared formula compiled for the degrees that models are made of, and
// once more for any degree. Included once per target.
//
// With the degrees known the loops unroll and the Bernstein polynomials stay in registers. The operations and their
// order are the same, so all versions give the same bits. Measured on AVX-512: 5 to 25 % less time an evaluation; at
// degree 1x1 nothing. 9 pairs of degrees, polynomial and rational: 18 functions a target, and 2 for what is left.
#if defined(TRIMRAY_CPU_EVALUATE_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_EVALUATE_H
#undef TRIMRAY_CPU_EVALUATE_H
#else
#define TRIMRAY_CPU_EVALUATE_H
#endif

#include "format/pack_layout.h"
#include "runtime/common_degrees.h"
#include "runtime/cpu_fetch.h"
#include "shaders/shared/bezier.h"

SHARED_OPEN

/// S and its derivatives at uv; `first` and the degrees as in bezier_point.
using Evaluate = SurfacePoint (*)(const FetchSource& source, uint first, int degree_u, int degree_v, real2 uv);

template <bool rational>
HWY_ATTR HWY_NOINLINE SurfacePoint evaluate_any(const FetchSource& source, uint first, int degree_u, int degree_v,
                                                real2 uv)
{
    return bezier_point(FETCH_PASS first, degree_u, degree_v, rational, uv);
}

template <int degree_u, int degree_v, bool rational>
HWY_ATTR HWY_NOINLINE SurfacePoint evaluate_fixed(const FetchSource& source, uint first, int, int, real2 uv)
{
    return bezier_point(FETCH_PASS first, degree_u, degree_v, rational, uv);
}

/// The fastest version for a Bezier patch of this shape (pack_layout.h, PatchRecord).
static inline Evaluate find_evaluate(uint shape)
{
    return by_common_degrees(shape, []<int degree_u, int degree_v, bool rational>() -> Evaluate {
        if constexpr (degree_u > 0)
            return &evaluate_fixed<degree_u, degree_v, rational>;
        else
            return &evaluate_any<rational>;
    });
}

SHARED_CLOSE
#endif
