// First and second derivatives of Bezier patches. Source: Piegl & Tiller eq. 3.24 (derivatives of a polynomial patch as
// patches of differences of its control points) and A4.4 (those of a rational one from those of its homogeneous sums).
//
// The differences are taken first, each from the control points themselves: what is left of a nearly flat net's second
// differences is then limited by the pack's rounding of its control points, not by sums that are as large as the patch.
#if defined(TRIMRAY_SHARED_BEZIER_DERIVATIVES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_BEZIER_DERIVATIVES_H
#undef TRIMRAY_SHARED_BEZIER_DERIVATIVES_H
#else
#define TRIMRAY_SHARED_BEZIER_DERIVATIVES_H
#endif

#include "shaders/shared/bezier.h"
#include "shaders/shared/derivatives.h"
#include "shaders/shared/language.h"

SHARED_OPEN

// (wx, wy, wz), w; of a polynomial patch w = 0
struct ControlPoint {
    scalar3 p;
    scalar w;
};
FN ControlPoint control_point(FETCH_PARAM uint at, bool rational)
{
    ControlPoint c;
    c.p = scalar3(fetch_control(FETCH_PASS at), fetch_control(FETCH_PASS at + 1u), fetch_control(FETCH_PASS at + 2u));
    c.w = 0.0f;
    if (rational)
        c.w = fetch_control(FETCH_PASS at + 3u);
    return c;
}
FN ControlPoint difference(ControlPoint a, ControlPoint b)
{
    ControlPoint c;
    c.p = a.p - b.p;
    c.w = a.w - b.w;
    return c;
}

struct NetSum {
    real3 p;
    real w;
};
FN NetSum no_sum()
{
    NetSum none;
    none.p = real3(real(0.0f), real(0.0f), real(0.0f));
    none.w = real(0.0f);
    return none;
}
FN NetSum plus_point(NetSum s, real factor, ControlPoint c)
{
    s.p = s.p + factor * c.p;
    s.w = s.w + factor * c.w;
    return s;
}
FN NetSum plus_sum(NetSum s, real factor, NetSum other)
{
    s.p = s.p + factor * other.p;
    s.w = s.w + factor * other.w;
    return s;
}
FN NetSum times(NetSum s, int factor)
{
    s.p = s.p * real(scalar(factor));
    s.w = s.w * real(scalar(factor));
    return s;
}

// A4.4 with A the homogeneous point: S_ab = (A_ab - sums of lower derivatives times those of w) / w
FN Derivatives of_rational(NetSum a, NetSum au, NetSum av, NetSum auu, NetSum auv, NetSum avv)
{
    real per_w = 1.0f / a.w;
    real3 p = a.p * per_w;
    Derivatives s;
    s.u = (au.p - p * au.w) * per_w;
    s.v = (av.p - p * av.w) * per_w;
    s.uu = (auu.p - s.u * (2.0f * au.w) - p * auu.w) * per_w;
    s.uv = (auv.p - s.u * av.w - s.v * au.w - p * auv.w) * per_w;
    s.vv = (avv.p - s.v * (2.0f * av.w) - p * avv.w) * per_w;
    return s;
}

// Derivatives at uv, patch units. `first` and the degrees as in bezier_point. Domain: uv in [0,1]^2, where w > 0.
FN_LARGE Derivatives bezier_derivatives(FETCH_PARAM uint first, int degree_u, int degree_v, bool rational, real2 uv)
{
    // of the degree itself and of those of the first and the second differences
    real u0[kBasisSize];
    real u1[kBasisSize];
    real u2[kBasisSize];
    real v0[kBasisSize];
    real v1[kBasisSize];
    real v2[kBasisSize];
    bernstein(degree_u, uv.x, u0);
    bernstein(degree_u - 1, uv.x, u1);
    bernstein(degree_u - 2, uv.x, u2);
    bernstein(degree_v, uv.y, v0);
    bernstein(degree_v - 1, uv.y, v1);
    bernstein(degree_v - 2, uv.y, v2);
    uint step_v = rational ? 4u : 3u;
    uint step_u = step_v * uint(degree_v + 1);
    NetSum a = no_sum();
    NetSum au = no_sum();
    NetSum av = no_sum();
    NetSum auu = no_sum();
    NetSum auv = no_sum();
    NetSum avv = no_sum();
    uint at = first;
    for (int i = 0; i <= degree_u; ++i) {
        STOP_PAST_DEGREES(i);
        NetSum row = no_sum();
        NetSum row_u = no_sum();
        NetSum row_v = no_sum();
        NetSum row_uu = no_sum();
        NetSum row_uv = no_sum();
        NetSum row_vv = no_sum();
        for (int j = 0; j <= degree_v; ++j) {
            STOP_PAST_DEGREES(j);
            ControlPoint c = control_point(FETCH_PASS at, rational);
            ControlPoint to_v = c; // c_{j+1} - c_j
            row = plus_point(row, v0[j], c);
            if (j < degree_v) {
                ControlPoint next = control_point(FETCH_PASS at + step_v, rational);
                to_v = difference(next, c);
                row_v = plus_point(row_v, v1[j], to_v);
                if (j < degree_v - 1) {
                    ControlPoint after = control_point(FETCH_PASS at + 2u * step_v, rational);
                    row_vv = plus_point(row_vv, v2[j], difference(difference(after, next), to_v));
                }
            }
            if (i < degree_u) {
                ControlPoint next = control_point(FETCH_PASS at + step_u, rational);
                ControlPoint to_u = difference(next, c);
                row_u = plus_point(row_u, v0[j], to_u);
                if (j < degree_v) {
                    ControlPoint corner = control_point(FETCH_PASS at + step_u + step_v, rational);
                    row_uv = plus_point(row_uv, v1[j], difference(difference(corner, next), to_v));
                }
                if (i < degree_u - 1) {
                    ControlPoint after = control_point(FETCH_PASS at + 2u * step_u, rational);
                    row_uu = plus_point(row_uu, v0[j], difference(difference(after, next), to_u));
                }
            }
            at += step_v;
        }
        a = plus_sum(a, u0[i], row);
        av = plus_sum(av, u0[i], row_v);
        avv = plus_sum(avv, u0[i], row_vv);
        if (i < degree_u) {
            au = plus_sum(au, u1[i], row_u);
            auv = plus_sum(auv, u1[i], row_uv);
        }
        if (i < degree_u - 1)
            auu = plus_sum(auu, u2[i], row_uu);
    }
    au = times(au, degree_u);
    av = times(av, degree_v);
    auu = times(auu, degree_u * (degree_u - 1));
    auv = times(auv, degree_u * degree_v);
    avv = times(avv, degree_v * (degree_v - 1));
    if (rational)
        return of_rational(a, au, av, auu, auv, avv);
    Derivatives s;
    s.u = au.p;
    s.v = av.p;
    s.uu = auu.p;
    s.uv = auv.p;
    s.vv = avv.p;
    return s;
}

SHARED_CLOSE
#endif
