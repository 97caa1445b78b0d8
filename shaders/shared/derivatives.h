// First and second derivatives of the native surfaces, in closed form. Those of Bezier patches: bezier_derivatives.h.
#if defined(TRIMRAY_SHARED_DERIVATIVES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_DERIVATIVES_H
#undef TRIMRAY_SHARED_DERIVATIVES_H
#else
#define TRIMRAY_SHARED_DERIVATIVES_H
#endif

#include "shaders/shared/language.h"

SHARED_OPEN

// Of a native surface at its point p, patch space, by uv_patch. Parametrisations: pack_layout.h. With rho the signed
// distance from the axis, (cos u, sin u) = (x, y) / rho.
struct Derivatives {
    real3 u;
    real3 v;
    real3 uu;
    real3 uv;
    real3 vv;
};

// u turns about the axis on every kind but the plane; S_v = (k x, k y, rise), S_vv = (l x, l y, bend)
FN Derivatives turned(real3 p, real k, real rise, real l, real bend)
{
    real none = real(0.0f);
    Derivatives s;
    s.u = real3(-p.y, p.x, none);
    s.v = real3(k * p.x, k * p.y, rise);
    s.uu = real3(-p.x, -p.y, none);
    s.uv = real3(-k * p.y, k * p.x, none);
    s.vv = real3(l * p.x, l * p.y, bend);
    return s;
}
FN Derivatives plane_derivatives()
{
    real3 none = real3(real(0.0f), real(0.0f), real(0.0f));
    Derivatives s;
    s.u = real3(real(1.0f), real(0.0f), real(0.0f));
    s.v = real3(real(0.0f), real(1.0f), real(0.0f));
    s.uu = none;
    s.uv = none;
    s.vv = none;
    return s;
}
FN Derivatives cylinder_derivatives(real3 p)
{
    real none = real(0.0f);
    return turned(p, none, real(1.0f), none, none);
}
// S_v = (sin a cos u, sin a sin u, cos a)
FN Derivatives cone_derivatives(scalar r, scalar tan_a, real3 p)
{
    scalar cos_a = 1.0f / sqrt(1.0f + tan_a * tan_a);
    real rho = r + p.z * tan_a;
    real none = real(0.0f);
    return turned(p, tan_a * cos_a / select(abs(rho) > 1e-20f, rho, real(1e-20f)), real(cos_a), none, none);
}
// S_v = (-z cos u, -z sin u, rho), S_vv = -S
FN Derivatives sphere_derivatives(real3 p)
{
    real rho = sqrt(p.x * p.x + p.y * p.y);
    return turned(p, -p.z / max(rho, real(1e-20f)), rho, real(-1.0f), -p.z);
}
// S_v = (-z cos u, -z sin u, rho - R), S_vv = -((rho - R) cos u, (rho - R) sin u, z); `side`: torus_side
FN Derivatives torus_derivatives(scalar R, real side, real3 p)
{
    real rho = side * sqrt(p.x * p.x + p.y * p.y);
    real per_rho = 1.0f / select(abs(rho) > 1e-20f, rho, real(1e-20f));
    return turned(p, -p.z * per_rho, rho - R, (R - rho) * per_rho, -p.z);
}

SHARED_CLOSE
#endif
