// How rays keep their precision: each patch gets the part of the ray that is near it.
//
// A pixel's direction is w = w0 + d with w0 the same for all pixels (towards the picture's centre, |w0| = 1) and
// d = x step_x + y step_y, x and y in pixels from the centre. A point of its ray is eye + tau w, in part space. For a
// patch choose tau_p so that the plane tau = tau_p passes through it, tau_p = (patch origin - eye) . w0. Then
//     origin = (eye + tau_p w0 - patch origin) + tau_p d          direction = w0 + d
// where the bracket is one subtraction of large numbers for all rays, done in higher precision (double on the host,
// pairs of floats on the device), and everything else is small or exact to a share 2^-24 of a pixel. Distances tau
// compare between patches, parts and instances, since affine maps keep them; mm = tau * |w in world|.
#if defined(TRIMRAY_SHARED_PRECISION_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_PRECISION_H
#undef TRIMRAY_SHARED_PRECISION_H
#else
#define TRIMRAY_SHARED_PRECISION_H
#endif

#include "shaders/shared/language.h"

SHARED_OPEN

struct Pair {
    scalar hi; // hi + lo, |lo| <= ulp(hi) / 2
    scalar lo;
};

// Source: Knuth TAOCP 2, 4.2.2 theorem B
FN Pair two_sum(scalar a, scalar b)
{
    PRECISE scalar s = a + b;
    PRECISE scalar bb = s - a;
    PRECISE scalar aa = s - bb;
    PRECISE scalar db = b - bb;
    PRECISE scalar da = a - aa;
    Pair p;
    p.hi = s;
    PRECISE scalar error = da + db;
    p.lo = error;
    return p;
}

// Source: Dekker 1971; 4097 = 2^12 + 1 splits 24 bits in two halves. |a|, |b| below 2^50.
FN Pair two_product(scalar a, scalar b)
{
    PRECISE scalar p = a * b;
    PRECISE scalar ca = 4097.0f * a;
    PRECISE scalar ca_a = ca - a;
    PRECISE scalar a_hi = ca - ca_a;
    PRECISE scalar a_lo = a - a_hi;
    PRECISE scalar cb = 4097.0f * b;
    PRECISE scalar cb_b = cb - b;
    PRECISE scalar b_hi = cb - cb_b;
    PRECISE scalar b_lo = b - b_hi;
    PRECISE scalar error = ((a_hi * b_hi - p) + a_hi * b_lo + a_lo * b_hi) + a_lo * b_lo;
    Pair r;
    r.hi = p;
    r.lo = error;
    return r;
}

FN Pair pair_sum(Pair a, Pair b)
{
    Pair s = two_sum(a.hi, b.hi);
    PRECISE scalar lo = s.lo + (a.lo + b.lo);
    return two_sum(s.hi, lo);
}

// eye + tau w0 - origin for one axis, each a pair, tau a float: right to about 2^-46 of the largest term
FN scalar anchored(Pair eye, Pair w0, scalar tau, Pair origin)
{
    Pair product = two_product(tau, w0.hi);
    PRECISE scalar product_lo = product.lo + tau * w0.lo;
    Pair moved = two_sum(product.hi, product_lo); // not `product` again: glslc loops for ever on a precise cycle
    Pair minus_origin;
    minus_origin.hi = -origin.hi;
    minus_origin.lo = -origin.lo;
    Pair sum = pair_sum(pair_sum(eye, minus_origin), moved);
    return sum.hi + sum.lo;
}

SHARED_CLOSE
#endif
