// Rays against the torus (sqrt(x^2 + y^2) - R)^2 + z^2 = r^2, in patch space.
//
// The quartic's critical points are found first, in brackets between the critical points of its derivative, and so on
// down to a quadratic; between neighbouring critical points a polynomial is monotone and has one root where its sign
// changes. The last stage measures the sign and the root on the torus's own equation instead of the quartic's
// coefficients, which lose r^2 / R^2 of their digits on thin tori.
#if defined(TRIMRAY_SHARED_TORUS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_TORUS_H
#undef TRIMRAY_SHARED_TORUS_H
#else
#define TRIMRAY_SHARED_TORUS_H
#endif

#include "shaders/shared/language.h"
#include "shaders/shared/quadric.h"

SHARED_OPEN

struct TorusRoots {
    real t0; // ascending; kHuge: no more
    real t1;
    real t2;
    real t3;
    real touch; // where the line touches so nearly that rounding decides whether there are roots; kHuge: nowhere
};

// Value and derivative of (hypot(x, y) - R)^2 + z^2 - r^2 along a ray, times the same with -R for spindle tori, whose
// inner part has that equation; for r < R the second factor is positive and changes no root.
struct ValueSlope {
    real value;
    real slope;
};
FN ValueSlope torus_value(scalar R, scalar r, real3 origin, real3 direction, real t)
{
    PRECISE real3 p = origin + direction * t;
    PRECISE real rho = sqrt(p.x * p.x + p.y * p.y);
    PRECISE real rho_t = (p.x * direction.x + p.y * direction.y) / max(rho, real(1e-20f));
    // (rho - R)^2 + z^2 - r^2 = d^2 - r^2 with d the distance from the tube's centre circle
    PRECISE real d = sqrt((rho - R) * (rho - R) + p.z * p.z);
    ValueSlope f;
    f.value = (d - r) * (d + r);
    f.slope = 2.0f * ((rho - R) * rho_t + p.z * direction.z);
    if (r > R) {
        PRECISE real g = (rho + R) * (rho + R) + p.z * p.z - r * r;
        PRECISE real g_t = 2.0f * ((rho + R) * rho_t + p.z * direction.z);
        f.slope = f.slope * g + f.value * g_t;
        f.value = f.value * g;
    }
    return f;
}

FN ValueSlope polynomial_value(real c4, real c3, real c2, real c1, real c0, real t)
{
    ValueSlope f;
    f.value = (((c4 * t + c3) * t + c2) * t + c1) * t + c0;
    f.slope = ((4.0f * c4 * t + 3.0f * c3) * t + 2.0f * c2) * t + c1;
    return f;
}

// A cubic's root in [lo, hi], where it is monotone; hi where it does not change sign. Newton kept in its bracket.
FN_LARGE real cubic_root_between(real c3, real c2, real c1, real c0, real lo, real hi)
{
    real none = real(0.0f);
    ValueSlope at_lo = polynomial_value(none, c3, c2, c1, c0, lo);
    ValueSlope at_hi = polynomial_value(none, c3, c2, c1, c0, hi);
    mask found = differ(at_lo.value < 0.0f, at_hi.value < 0.0f);
    mask rising = at_lo.value < at_hi.value;
    real a = lo;
    real b = hi;
    real t = 0.5f * (lo + hi);
    mask moving = found;
    for (int i = 0; i < 24 && any_lane(moving); ++i) {
        ValueSlope f = polynomial_value(none, c3, c2, c1, c0, t);
        mask left = differ(f.value > 0.0f, rising); // the root is to the right of t
        a = select(moving && left, t, a);
        b = select(moving && !left, t, b);
        PRECISE real next = t - f.value / select(abs(f.slope) > 1e-30f, f.slope, real(1e-30f));
        next = select(next >= a && next <= b, next, 0.5f * (a + b));
        // a lane that has settled stays: at the root the sign is noise, and would send it off to the middle of its
        // bracket
        mask still = moving && abs(next - t) > 1e-6f;
        t = select(moving, next, t);
        moving = still;
    }
    return select(found, t, hi);
}

// The torus's root in [lo, hi], where its sign changes once; kHuge where it does not change. The values at both ends
// are given.
FN_LARGE real torus_root_between(scalar R, scalar r, real3 origin, real3 direction, real lo, real hi, real at_lo,
                                 real at_hi)
{
    mask found = differ(at_lo < 0.0f, at_hi < 0.0f) && lo < hi;
    mask rising = at_lo < at_hi;
    real a = lo;
    real b = hi;
    real t = 0.5f * (lo + hi);
    mask moving = found;
    for (int i = 0; i < 32 && any_lane(moving); ++i) {
        ValueSlope f = torus_value(R, r, origin, direction, t);
        mask left = differ(f.value > 0.0f, rising);
        a = select(moving && left, t, a);
        b = select(moving && !left, t, b);
        PRECISE real next = t - f.value / select(abs(f.slope) > 1e-30f, f.slope, real(1e-30f));
        next = select(next >= a && next <= b, next, 0.5f * (a + b));
        mask still = moving && abs(next - t) > 2.0f * kRounding * (abs(t) + R);
        t = select(moving, next, t);
        moving = still;
    }
    return select(found, t, real(kHuge));
}

FN_LARGE TorusRoots torus_roots(scalar R, scalar r, real3 origin, real3 direction)
{
    // distances s from the line's point nearest to the centre, in units of length: t = middle + s / |direction|
    PRECISE real speed = length(direction);
    PRECISE real3 d = direction * (1.0f / speed);
    PRECISE real middle = -dot(origin, d);
    PRECISE real3 p = origin + d * middle;
    scalar reach = R + r;
    PRECISE real p2 = dot(p, p);
    mask near_enough = p2 <= reach * reach * 1.00001f;
    PRECISE real s_end = sqrt(max(reach * reach * 1.0001f - p2, real(0.0f))); // the sphere around the torus

    // (s^2 + p^2 + R^2 - r^2)^2 - 4 R^2 (s^2 + p^2 - (p_z + s d_z)^2) = s^4 + c2 s^2 + c1 s + c0; its derivative / 4:
    PRECISE real k = p2 + (R - r) * (R + r);
    PRECISE real c2 = 2.0f * k - 4.0f * R * R * (1.0f - d.z * d.z);
    PRECISE real c1 = 8.0f * R * R * p.z * d.z;
    PRECISE real q1 = 0.5f * c2;
    PRECISE real q0 = 0.25f * c1; // s^3 + q1 s + q0
    // where that cubic turns: s^2 = -q1 / 3
    PRECISE real turn = min(sqrt(max(q1 * (-1.0f / 3.0f), real(0.0f))), s_end);
    real one = real(1.0f);
    real none = real(0.0f);
    real e1 = cubic_root_between(one, none, q1, q0, -s_end, -turn);
    real e2 = cubic_root_between(one, none, q1, q0, -turn, turn);
    real e3 = cubic_root_between(one, none, q1, q0, turn, s_end);
    real f_start = torus_value(R, r, p, d, -s_end).value;
    real f1 = torus_value(R, r, p, d, e1).value;
    real f2 = torus_value(R, r, p, d, e2).value;
    real f3 = torus_value(R, r, p, d, e3).value;
    real f_end = torus_value(R, r, p, d, s_end).value;
    real s0 = torus_root_between(R, r, p, d, -s_end, e1, f_start, f1);
    real s1 = torus_root_between(R, r, p, d, e1, e2, f1, f2);
    real s2 = torus_root_between(R, r, p, d, e2, e3, f2, f3);
    real s3 = torus_root_between(R, r, p, d, e3, s_end, f3, f_end);
    // A value is about 2 r times the distance from the surface, and of spindle tori up to (2 reach)^2 times that: where
    // it turns within rounding of 0 there may be two roots or none, from the root before it on
    PRECISE real small = 2.0f * r * (r > R ? 4.0f * reach * reach : 1.0f) * touching_reach(reach, p);
    real touch = select(abs(f3) <= small, min(s2, e3), real(kHuge));
    touch = select(abs(f2) <= small, min(s1, e2), touch);
    touch = select(abs(f1) <= small, min(s0, e1), touch);
    TorusRoots roots;
    PRECISE real per_length = 1.0f / speed;
    roots.t0 = select(near_enough && s0 < kHuge, (middle + s0) * per_length, real(kHuge));
    roots.t1 = select(near_enough && s1 < kHuge, (middle + s1) * per_length, real(kHuge));
    roots.t2 = select(near_enough && s2 < kHuge, (middle + s2) * per_length, real(kHuge));
    roots.t3 = select(near_enough && s3 < kHuge, (middle + s3) * per_length, real(kHuge));
    roots.touch = select(near_enough && touch < kHuge, (middle + touch) * per_length, real(kHuge));
    return roots;
}

// 1, or -1 on the inner part of a spindle torus, where R + r cos v < 0
FN real torus_side(scalar R, scalar r, real3 p)
{
    PRECISE real rho = sqrt(p.x * p.x + p.y * p.y);
    PRECISE real outer = abs((rho - R) * (rho - R) + p.z * p.z - r * r);
    PRECISE real inner = abs((rho + R) * (rho + R) + p.z * p.z - r * r);
    return select(inner < outer, real(-1.0f), real(1.0f));
}

// uv_patch, both angles in [-pi, pi]
FN real2 torus_uv(scalar R, scalar r, real3 p)
{
    real side = torus_side(R, r, p);
    PRECISE real rho = sqrt(p.x * p.x + p.y * p.y) * side;
    return real2(angle_of(p.x * side, p.y * side), angle_of(rho - R, p.z));
}

// Direction of S_u x S_v in right-handed axes: away from the tube's centre circle, times the sign of R + r cos v
FN real3 torus_normal(scalar R, scalar r, real3 p)
{
    real side = torus_side(R, r, p);
    PRECISE real rho = sqrt(p.x * p.x + p.y * p.y);
    PRECISE real k = (rho * side - R) / max(rho, real(1e-20f));
    return real3(p.x * k, p.y * k, p.z * side);
}

SHARED_CLOSE
#endif
