// On which side of a monotone piece of a trim loop a point lies: what trims by cells and by kd-trees have in common.
#if defined(TRIMRAY_SHARED_MONOTONE_SIDE_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_MONOTONE_SIDE_H
#undef TRIMRAY_SHARED_MONOTONE_SIDE_H
#else
#define TRIMRAY_SHARED_MONOTONE_SIDE_H
#endif

#include "shaders/shared/language.h"

SHARED_OPEN

// u < P(v) for a line that rises from a to b: u < a.u + (v - a.v) (b.u - a.u) / (b.v - a.v), multiplied out
FN mask left_of_line(scalar2 a, scalar2 b, real2 uv)
{
    PRECISE real side_u = (uv.x - a.x) * (b.y - a.y);
    PRECISE real side_v = (uv.y - a.y) * (b.x - a.x);
    return side_u < side_v;
}

// Control points of a cubic, from the point asked for
struct CubicFromPoint {
    real u0;
    real u1;
    real u2;
    real u3;
    real v0;
    real v1;
    real v2;
    real v3;
};
FN CubicFromPoint cubic_from_point(scalar2 a, scalar2 b, scalar2 c, scalar2 d, real2 uv)
{
    PRECISE CubicFromPoint cubic;
    cubic.u0 = a.x - uv.x;
    cubic.u1 = b.x - uv.x;
    cubic.u2 = c.x - uv.x;
    cubic.u3 = d.x - uv.x;
    cubic.v0 = a.y - uv.y;
    cubic.v1 = b.y - uv.y;
    cubic.v2 = c.y - uv.y;
    cubic.v3 = d.y - uv.y;
    return cubic;
}

// Where the curve is at t in [0,1], from the point: in Bernstein form, so that ends are exact
FN real2 cubic_offset(CubicFromPoint cubic, real t)
{
    PRECISE real s = 1.0f - t;
    PRECISE real w1 = 3.0f * s * s * t;
    PRECISE real w2 = 3.0f * s * t * t;
    PRECISE real w0 = s * s * s;
    PRECISE real w3 = t * t * t;
    PRECISE real u = (w0 * cubic.u0 + w1 * cubic.u1) + (w2 * cubic.u2 + w3 * cubic.u3);
    PRECISE real v = (w0 * cubic.v0 + w1 * cubic.v1) + (w2 * cubic.v2 + w3 * cubic.v3);
    return real2(u, v);
}

SHARED_CLOSE
#endif
