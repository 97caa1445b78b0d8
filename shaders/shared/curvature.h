// Principal curvatures. Signs follow a normal: positive where the surface bends away from it, so that with a face's
// outward normal a ball is positive and a bore negative. Source: do Carmo, Differential Geometry of Curves and
// Surfaces, 3-3 (shape operator); Piegl & Tiller A3.6, A4.4 for the derivatives.
#if defined(TRIMRAY_SHARED_CURVATURE_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_CURVATURE_H
#undef TRIMRAY_SHARED_CURVATURE_H
#else
#define TRIMRAY_SHARED_CURVATURE_H
#endif

#include "shaders/shared/derivatives.h"
#include "shaders/shared/language.h"
#include "shaders/shared/torus.h"

SHARED_OPEN

struct Curvatures {
    real larger; // of the two principal curvatures, 1 / patch unit
    real smaller;
};
FN Curvatures curvatures_of(real a, real b)
{
    Curvatures k;
    k.larger = max(a, b);
    k.smaller = min(a, b);
    return k;
}
// As the opposite normal sees them; turn is 1 or -1.
FN Curvatures turned_curvatures(Curvatures k, real turn)
{
    return curvatures_of(k.larger * turn, k.smaller * turn);
}

// By the normal S_u x S_v in right-handed axes. A profile that turns about an axis has its lines of curvature along v
// and along u; k_u is the normal's part away from the axis over the distance rho from it (Meusnier).
FN Curvatures cylinder_curvatures(scalar r)
{
    return curvatures_of(real(1.0f / r), real(0.0f));
}
// k_u = cos a / |rho|, rho = r + z tan a
FN Curvatures cone_curvatures(scalar r, scalar tan_a, real3 p)
{
    scalar cos_a = 1.0f / sqrt(1.0f + tan_a * tan_a);
    real rho = abs(r + p.z * tan_a);
    return curvatures_of(real(cos_a) / max(rho, real(1e-20f)), real(0.0f));
}
FN Curvatures sphere_curvatures(scalar r)
{
    return curvatures_of(real(1.0f / r), real(1.0f / r));
}
// k_v = 1 / r, k_u = cos v / rho; on the inner part of a spindle, where rho < 0, S_u x S_v points the other way
FN Curvatures torus_curvatures(scalar R, scalar r, real3 p)
{
    real side = torus_side(R, r, p);
    real rho = sqrt(p.x * p.x + p.y * p.y) * side;
    real cos_v = (rho - R) * (1.0f / r);
    mask on_axis = abs(rho) <= 1e-20f;
    return turned_curvatures(curvatures_of(real(1.0f / r), cos_v / select(on_axis, real(1e-20f), rho)), side);
}

// From derivatives, by the normal S_u x S_v. In the frame e1 = S_u / |S_u|, e2 = n x e1 of the tangent plane the shape
// operator is a symmetric matrix (a b; b c), and k = (a + c) / 2 +- sqrt(((a - c) / 2)^2 + b^2): a sum of squares,
// where the textbook's H^2 - K leaves half of the digits wherever both are alike.
//     S_u = g e1,  S_v = s g e1 + h e2  with s = S_u.S_v / g^2,  g h = |S_u x S_v|
//     a = L / g^2,  b = (M - s L) / (g h),  c = (N - 2 s M + s^2 L) / h^2
// Domain: S_u x S_v is not 0.
FN Curvatures curvatures_of_derivatives(Derivatives s)
{
    real3 normal = cross(s.u, s.v);
    real gg = dot(s.u, s.u);
    real gh = length(normal);
    real per_gh = 1.0f / gh;
    real per_gg = 1.0f / gg;
    real3 n = normal * -per_gh; // what bends away from the normal is positive
    real skew = dot(s.u, s.v) * per_gg;
    real L = dot(s.uu, n);
    real M = dot(s.uv, n);
    real N = dot(s.vv, n);
    real a = L * per_gg;
    real b = (M - skew * L) * per_gh;
    real c = (N - 2.0f * skew * M + skew * skew * L) * gg * per_gh * per_gh;
    real middle = 0.5f * (a + c);
    real apart = 0.5f * (a - c);
    real spread = sqrt(apart * apart + b * b);
    return curvatures_of(middle + spread, middle - spread);
}

// ---- near poles ----------------------------------------------------------------------------------------------------
// Where a side is one point, or two sides leave a corner in one direction, curvatures are 0 / 0 and near by they are
// what rounding leaves of it: there, as for normals, they are those a little way inside. A patch that is slender
// everywhere is no pole: what tells one is that it widens inwards, at least twofold in this share of the way to its
// middle.
const scalar kPoleStep = 1.0f / 16.0f;
const scalar kThin = 1.0f / 256.0f; // of thinness: looked at at all

// The least of the squared ratio of |S_u| to |S_v|, its inverse, and the squared sine between them
FN real thinness(Derivatives s)
{
    real uu = max(dot(s.u, s.u), real(1e-30f));
    real vv = max(dot(s.v, s.v), real(1e-30f));
    real3 normal = cross(s.u, s.v);
    return min(min(uu / vv, vv / uu), dot(normal, normal) / (uu * vv));
}
FN real2 from_pole(real2 uv)
{
    return real2(uv.x + (0.5f - uv.x) * kPoleStep, uv.y + (0.5f - uv.y) * kPoleStep);
}
FN mask is_pole(real thin, Derivatives inside)
{
    return 4.0f * thin < thinness(inside);
}

SHARED_CLOSE
#endif
