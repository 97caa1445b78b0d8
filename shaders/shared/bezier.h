// Points and derivatives of Bezier patches in Bernstein form. Source: Piegl & Tiller A1.2 (all Bernstein polynomials),
// eq. 1.9 (derivative of a curve as a difference of two curves of one degree less).
#if defined(TRIMRAY_SHARED_BEZIER_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_BEZIER_H
#undef TRIMRAY_SHARED_BEZIER_H
#else
#define TRIMRAY_SHARED_BEZIER_H
#endif

#include "shaders/shared/language.h"

SHARED_OPEN

// Control points come from fetch_control(FETCH_PASS index), index in floats.

const int kBasisSize = 26; // kMaxDegree + 1

struct SurfacePoint {
    real3 p; // patch units
    real3 du;
    real3 dv;
};

// basis[i] = B_i^degree(t), i = 0 .. degree; the sums of products of positive numbers lose no digits
FN void bernstein(int degree, real t, INOUT_ARRAY(basis, kBasisSize))
{
    PRECISE real s = 1.0f - t;
    basis[0] = real(1.0f);
    for (int k = 1; k <= degree; ++k) {
        STOP_PAST_DEGREES(k);
        PRECISE real saved = real(0.0f);
        for (int i = 0; i < k; ++i) {
            PRECISE real old = basis[i];
            basis[i] = saved + s * old;
            saved = t * old;
        }
        basis[k] = saved;
    }
}

// Homogeneous sums over the net's four corners of degree - 1: [u][v] = 00, 10, 01, 11
struct CornerSums {
    real3 p00;
    real3 p10;
    real3 p01;
    real3 p11;
    real w00;
    real w10;
    real w01;
    real w11;
};

// S and its first derivatives at uv. `first`: first float of the control net; v runs fastest.
FN SurfacePoint bezier_point(FETCH_PARAM uint first, int degree_u, int degree_v, bool rational, real2 uv)
{
    real basis_u[kBasisSize];
    real basis_v[kBasisSize];
    bernstein(degree_u - 1, uv.x, basis_u);
    bernstein(degree_v - 1, uv.y, basis_v);
    uint stride = rational ? 4u : 3u;
    real3 zero = real3(real(0.0f), real(0.0f), real(0.0f));
    CornerSums a;
    a.p00 = zero;
    a.p10 = zero;
    a.p01 = zero;
    a.p11 = zero;
    a.w00 = real(0.0f);
    a.w10 = real(0.0f);
    a.w01 = real(0.0f);
    a.w11 = real(0.0f);
    uint at = first;
    for (int i = 0; i <= degree_u; ++i) {
        STOP_PAST_DEGREES(i);
        // the row's curve as two of degree_v - 1: from its first and from its second control point on
        real3 row0 = zero;
        real3 row1 = zero;
        real row0_w = real(0.0f);
        real row1_w = real(0.0f);
        for (int j = 0; j <= degree_v; ++j) {
            STOP_PAST_DEGREES(j);
            scalar3 c = scalar3(fetch_control(FETCH_PASS at), fetch_control(FETCH_PASS at + 1u),
                                fetch_control(FETCH_PASS at + 2u));
            if (j < degree_v)
                row0 = row0 + basis_v[j] * c;
            if (j > 0)
                row1 = row1 + basis_v[j - 1] * c;
            if (rational) {
                scalar w = fetch_control(FETCH_PASS at + 3u);
                if (j < degree_v)
                    row0_w = row0_w + basis_v[j] * w;
                if (j > 0)
                    row1_w = row1_w + basis_v[j - 1] * w;
            }
            at += stride;
        }
        if (i < degree_u) {
            a.p00 = a.p00 + row0 * basis_u[i];
            a.p01 = a.p01 + row1 * basis_u[i];
            if (rational) {
                a.w00 = a.w00 + row0_w * basis_u[i];
                a.w01 = a.w01 + row1_w * basis_u[i];
            }
        }
        if (i > 0) {
            a.p10 = a.p10 + row0 * basis_u[i - 1];
            a.p11 = a.p11 + row1 * basis_u[i - 1];
            if (rational) {
                a.w10 = a.w10 + row0_w * basis_u[i - 1];
                a.w11 = a.w11 + row1_w * basis_u[i - 1];
            }
        }
    }
    PRECISE real u = uv.x;
    PRECISE real v = uv.y;
    // Sums of products again, not a + (b - a) u: beside a heavy point that loses the digits of a light one.
    PRECISE real not_u = 1.0f - u;
    PRECISE real not_v = 1.0f - v;
    PRECISE real3 lo_u = a.p00 * not_v + a.p01 * v; // S(u, v) = (1 - u) lo_u + u hi_u
    PRECISE real3 hi_u = a.p10 * not_v + a.p11 * v;
    PRECISE real3 lo_v = a.p00 * not_u + a.p10 * u;
    PRECISE real3 hi_v = a.p01 * not_u + a.p11 * u;
    scalar n = scalar(degree_u);
    scalar m = scalar(degree_v);
    SurfacePoint s;
    s.p = lo_u * not_u + hi_u * u;
    s.du = (hi_u - lo_u) * n;
    s.dv = (hi_v - lo_v) * m;
    if (rational) {
        // S = A / w:  S_u = (A_u - w_u S) / w  (Piegl & Tiller eq. 4.8)
        PRECISE real lo_u_w = a.w00 * not_v + a.w01 * v;
        PRECISE real hi_u_w = a.w10 * not_v + a.w11 * v;
        PRECISE real lo_v_w = a.w00 * not_u + a.w10 * u;
        PRECISE real hi_v_w = a.w01 * not_u + a.w11 * u;
        PRECISE real w = lo_u_w * not_u + hi_u_w * u;
        // outside of [0,1]^2 the sum of weights may vanish; no root is accepted there
        PRECISE real per_w = 1.0f / select(abs(w) > 1e-20f, w, real(1e-20f));
        s.p = s.p * per_w;
        s.du = (s.du - s.p * ((hi_u_w - lo_u_w) * n)) * per_w;
        s.dv = (s.dv - s.p * ((hi_v_w - lo_v_w) * m)) * per_w;
    }
    return s;
}

SHARED_CLOSE
#endif
