// The map from a surface to the picture near a hit, to the first order.
#if defined(TRIMRAY_SHARED_PIXEL_MAP_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_PIXEL_MAP_H
#undef TRIMRAY_SHARED_PIXEL_MAP_H
#else
#define TRIMRAY_SHARED_PIXEL_MAP_H
#endif

#include "shaders/shared/language.h"

SHARED_OPEN

struct PixelMap {
    real2 du; // pixels a unit of uv_face
    real2 dv;
};

// A point q = eye + T (w0 + x step_x + y step_y) of patch space is seen at pixel (x, y). With w = w0 + x step_x + y
// step_y its differential dq = dT w + T (dx step_x + dy step_y) gives
//     dx = dq . (step_y x w) / (T D),  dy = dq . (w x step_x) / (T D),  D = step_x . (step_y x w)
struct PixelRows {
    real3 x; // pixels a unit of patch space
    real3 y;
};
FN PixelRows pixel_rows(real3 w, scalar3 step_x, scalar3 step_y, real T)
{
    real3 to_x = cross(real3(step_y), w);
    real3 to_y = cross(w, real3(step_x));
    real volume = T * dot(real3(step_x), to_x);
    real per_volume = 1.0f / select(abs(volume) > 1e-30f, volume, real(1e-30f));
    PixelRows rows;
    rows.x = to_x * per_volume;
    rows.y = to_y * per_volume;
    return rows;
}
FN real2 seen_step(PixelRows rows, real3 dq)
{
    return real2(dot(rows.x, dq), dot(rows.y, dq));
}

// su and sv by uv_patch; uv_scale is the patch's (uv_face a unit of uv_patch)
FN PixelMap pixel_map(PixelRows rows, real3 su, real3 sv, scalar2 uv_scale)
{
    PixelMap map;
    map.du = seen_step(rows, su) * real(1.0f / uv_scale.x);
    map.dv = seen_step(rows, sv) * real(1.0f / uv_scale.y);
    return map;
}

SHARED_CLOSE
#endif
