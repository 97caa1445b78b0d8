// Newton's iteration for a ray against a patch: the ray is the line where two planes meet (Kajiya 1982), and a root of
// R(u, v) = (n1 . S + d1, n2 . S + d2) is a point of the patch on that line.
#if defined(TRIMRAY_SHARED_PATCH_NEWTON_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_PATCH_NEWTON_H
#undef TRIMRAY_SHARED_PATCH_NEWTON_H
#else
#define TRIMRAY_SHARED_PATCH_NEWTON_H
#endif

#include "shaders/shared/bezier.h"
#include "shaders/shared/language.h"
#include "shaders/shared/newton_reach.h"

SHARED_OPEN

struct RayPlanes {
    real3 n1; // unit, orthogonal
    real d1;
    real3 n2;
    real d2;
};

FN RayPlanes ray_planes(real3 origin, real3 direction)
{
    // a direction across: from the two components that cannot both be small
    mask x_large = abs(direction.x) > abs(direction.z);
    PRECISE real3 across =
        select(x_large, real3(-direction.y, direction.x, real(0.0f)), real3(real(0.0f), -direction.z, direction.y));
    RayPlanes planes;
    planes.n1 = across * (1.0f / length(across));
    PRECISE real3 other = cross(direction, planes.n1);
    planes.n2 = other * (1.0f / length(other));
    planes.d1 = -dot(planes.n1, origin);
    planes.d2 = -dot(planes.n2, origin);
    return planes;
}

// Sine of the angle between a ray and a surface below which a leaf that turns by LeafOptions.max_turning_rad can hold
// two roots.
const scalar kGrazing = 0.15f;

const int kNewtonSteps = 12;
// Rounding of a point with |q| about 1, patch units: a point so near its ray is on it. A step from a larger residual
// ends within its square times the leaf's curvature: from kLargestLastResidual within 6e-8, below rounding.
const scalar kSmallResidual = 4e-6f;
const scalar kLargestLastResidual = 2.4e-4f;

// The residual below which one more step ends the iteration. `error`: asked for, patch units
FN scalar last_residual(scalar error)
{
    return min(max(error, kSmallResidual), kLargestLastResidual);
}

// Where a leaf may hold more roots than one, Newton starts in its middle and then at these places, 0 to 3
FN scalar2 newton_start(int index, scalar2 leaf_lo, scalar2 leaf_hi)
{
    scalar s = index == 0 || index == 2 ? 0.1f : 0.9f;
    scalar t = index == 0 || index == 3 ? 0.1f : 0.9f;
    return scalar2(leaf_lo.x + s * (leaf_hi.x - leaf_lo.x), leaf_lo.y + t * (leaf_hi.y - leaf_lo.y));
}
const int kMoreStarts = 4;

struct NewtonStep {
    real2 uv;      // after the step; may leave [0,1]^2, the caller decides
    real residual; // before the step: distance of the point from the ray, patch units
    mask singular; // the step was not taken
    mask grazing;  // the ray and the surface meet at less than kGrazing: more roots may be near
};

// One step. Source: Kajiya 1982; Cramer's rule.
FN NewtonStep newton_step(SurfacePoint s, RayPlanes ray, real2 uv)
{
    PRECISE real r1 = dot(ray.n1, s.p) + ray.d1;
    PRECISE real r2 = dot(ray.n2, s.p) + ray.d2;
    PRECISE real a1 = dot(ray.n1, s.du); // columns of the Jacobian
    PRECISE real a2 = dot(ray.n2, s.du);
    PRECISE real b1 = dot(ray.n1, s.dv);
    PRECISE real b2 = dot(ray.n2, s.dv);
    PRECISE real det = a1 * b2 - b1 * a2;
    // rounding alone gives |det| a few eps of |R_u| |R_v|: below that its sign means nothing
    PRECISE real noise = 8.0f * kRounding * sqrt((a1 * a1 + a2 * a2) * (b1 * b1 + b2 * b2));
    NewtonStep next;
    next.singular = abs(det) <= noise;
    next.grazing = det * det <= kGrazing * kGrazing * dot(s.du, s.du) * dot(s.dv, s.dv);
    PRECISE real per_det = 1.0f / select(next.singular, real(1.0f), det);
    next.residual = sqrt(r1 * r1 + r2 * r2);
    real2 moved = real2(uv.x - (b2 * r1 - b1 * r2) * per_det, uv.y - (a1 * r2 - a2 * r1) * per_det);
    next.uv = select(next.singular, uv, moved);
    return next;
}

FN real kept_near_leaf(real u, scalar leaf_lo, scalar leaf_hi)
{
    scalar middle = 0.5f * (leaf_lo + leaf_hi);
    scalar reach = kNewtonReach * (middle - leaf_lo);
    return clamp(u, real(max(middle - reach, -kNewtonOutside)), real(min(middle + reach, 1.0f + kNewtonOutside)));
}

// How far outside of its patch a root may be and belong to it, in uv_patch: as far as `rounding` may have moved it, so
// that both neighbours reach their common side whatever the patch's shape and the ray's slant. With R_u, R_v the
// Jacobian's columns, an error of length e moves the root by at most (e |R_v|, e |R_u|) / |det|.
FN real2 patch_overlap(SurfacePoint s, RayPlanes ray, scalar rounding)
{
    real a1 = dot(ray.n1, s.du);
    real a2 = dot(ray.n2, s.du);
    real b1 = dot(ray.n1, s.dv);
    real b2 = dot(ray.n2, s.dv);
    real per_det = rounding / max(abs(a1 * b2 - b1 * a2), real(1e-20f));
    return real2(min(per_det * sqrt(b1 * b1 + b2 * b2), real(kNewtonOutside)),
                 min(per_det * sqrt(a1 * a1 + a2 * a2), real(kNewtonOutside)));
}

// A step from uv to `to`, shorter than this (uv_patch) because it was cut: the patch's rounding, |S_u| and |S_v| about
// 1
const scalar kNewtonStill = 2e-6f;

// True where no root is to be had: the step was not taken, or the iterate stands at the bounds of its reach and is
// drawn outwards. Along the bound it may still tremble by rounding.
FN mask newton_stuck(NewtonStep next, real2 uv, real2 to)
{
    mask inside = to.x == next.uv.x && to.y == next.uv.y;
    mask still = abs(to.x - uv.x) <= kNewtonStill && abs(to.y - uv.y) <= kNewtonStill;
    return next.singular || (!inside && still);
}

SHARED_CLOSE
#endif
