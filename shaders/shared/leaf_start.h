// Where the paper's own method starts Newton's iteration in a leaf.
#if defined(TRIMRAY_SHARED_LEAF_START_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_LEAF_START_H
#undef TRIMRAY_SHARED_LEAF_START_H
#else
#define TRIMRAY_SHARED_LEAF_START_H
#endif

#include "shaders/shared/language.h"

SHARED_OPEN

// The paper's eq. 2. `start`: (u^, v^) in [0, 1]^2, of all leaves alike. Returns uv_patch in the leaf's rectangle.
FN scalar2 leaf_start(scalar2 start, scalar2 leaf_lo, scalar2 leaf_hi)
{
    return scalar2(leaf_lo.x + start.x * (leaf_hi.x - leaf_lo.x), leaf_lo.y + start.y * (leaf_hi.y - leaf_lo.y));
}

SHARED_CLOSE
#endif
