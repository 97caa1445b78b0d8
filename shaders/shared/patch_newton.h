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

const int kNewtonSteps = 12;
// A step from a larger residual ends within its square times the leaf's curvature: from kLargestLastResidual within
// 6e-8, below rounding. What is less than kLeastLastResidual (patch units) asks for no further step either.
const scalar kLeastLastResidual = 4e-6f;
const scalar kLargestLastResidual = 2.4e-4f;

// The residual from which a last step is taken, where it is proved to end within rounding. `error`: asked for, patch
// units.
FN scalar last_residual(scalar error)
{
    return min(max(error, kLeastLastResidual), kLargestLastResidual);
}

// Where rounding of uv alone moves a point farther than this (patch units), beside control points 10^3 times as heavy
// as others, single precision has no answer.
const scalar kMostBlur = 1e-4f;

// A point of a patch and its derivatives as its ray sees them: across the ray, along n1 and n2
struct SeenPoint {
    real2 r; // from the ray to the point; its length is the residual
    real2 du;
    real2 dv;
    real det; // of the Jacobian [du dv]
};

FN SeenPoint seen_point(SurfacePoint s, RayPlanes ray)
{
    PRECISE real r1 = dot(ray.n1, s.p) + ray.d1;
    PRECISE real r2 = dot(ray.n2, s.p) + ray.d2;
    PRECISE real a1 = dot(ray.n1, s.du);
    PRECISE real a2 = dot(ray.n2, s.du);
    PRECISE real b1 = dot(ray.n1, s.dv);
    PRECISE real b2 = dot(ray.n2, s.dv);
    PRECISE real det = a1 * b2 - b1 * a2;
    SeenPoint seen;
    seen.r = real2(r1, r2);
    seen.du = real2(a1, a2);
    seen.dv = real2(b1, b2);
    seen.det = det;
    return seen;
}

struct NewtonStep {
    real2 uv;      // after the step; may leave [0,1]^2, the caller decides
    real residual; // before the step: distance of the point from the ray, patch units
    real blur;     // by how much rounding of uv alone moves the point, patch units; kMostBlur at most
    mask singular; // the step was not taken
};

// One step. Source: Kajiya 1982; Cramer's rule.
FN NewtonStep newton_step(SeenPoint s, real2 uv)
{
    real along_u = length(s.du);
    real along_v = length(s.dv);
    // rounding alone gives |det| a few eps of |R_u| |R_v|: below that its sign means nothing
    PRECISE real noise = 8.0f * kRounding * (along_u * along_v);
    NewtonStep next;
    next.blur = min(kRounding * (along_u + along_v), real(kMostBlur));
    next.singular = abs(s.det) <= noise;
    PRECISE real per_det = 1.0f / select(next.singular, real(1.0f), s.det);
    next.residual = length(s.r);
    real2 moved =
        real2(uv.x - (s.dv.y * s.r.x - s.dv.x * s.r.y) * per_det, uv.y - (s.du.x * s.r.y - s.du.y * s.r.x) * per_det);
    next.uv = select(next.singular, uv, moved);
    return next;
}

FN real kept_near(real u, real middle, real half_side)
{
    real reach = kNewtonReach * half_side;
    return clamp(u, max(middle - reach, real(-kNewtonOutside)), min(middle + reach, real(1.0f + kNewtonOutside)));
}

// How far outside of its patch a root may be and belong to it, in uv_patch: as far as `rounding` may have moved it, so
// that both neighbours reach their common side whatever the patch's shape and the ray's slant. With R_u, R_v the
// Jacobian's columns, an error of length e moves the root by at most (e |R_v|, e |R_u|) / |det|. Not cut at
// kNewtonOutside.
FN real2 root_blur(SeenPoint s, real rounding)
{
    real per_det = rounding / max(abs(s.det), real(1e-20f));
    return real2(per_det * length(s.dv), per_det * length(s.du));
}

// By how much a patch goes on beyond its sides, uv_patch (pack_layout.h: kDomainSlack)
FN scalar2 patch_slack(scalar2 uv_scale)
{
    return scalar2(min(kDomainSlack / max(uv_scale.x, -uv_scale.x), kMostPatchSlack),
                   min(kDomainSlack / max(uv_scale.y, -uv_scale.y), kMostPatchSlack));
}

// slack: patch_slack
FN real2 patch_overlap(real2 blur, scalar2 slack)
{
    return real2(min(max(blur.x, real(slack.x)), real(kNewtonOutside)),
                 min(max(blur.y, real(slack.y)), real(kNewtonOutside)));
}

// True where a root lies beyond a side of its patch
FN mask is_beyond_sides(real2 uv)
{
    return abs(uv.x - 0.5f) > 0.5f || abs(uv.y - 0.5f) > 0.5f;
}

// A root and its distance along the ray
struct NewtonRoot {
    real2 uv;
    real t;
};

// What a last step makes of the point it starts from: its derivatives tell where it ends. Unless it is `proved` to end
// within rounding, a step longer than 1e-3 (patch units) would change the residual by more, and is not taken.
FN NewtonRoot newton_root(SurfacePoint s, NewtonStep next, real2 uv, mask proved, real3 origin, real3 direction)
{
    real3 moved = s.du * (next.uv.x - uv.x) + s.dv * (next.uv.y - uv.y);
    mask taken = proved || dot(moved, moved) <= 1e-6f;
    NewtonRoot root;
    root.uv = select(taken, next.uv, uv);
    real3 p = select(taken, s.p + moved, s.p);
    root.t = dot(p - origin, direction) / dot(direction, direction);
    return root;
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
