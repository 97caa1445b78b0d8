// Rays against plane, cylinder, cone and sphere, in patch space as pack_layout.h parametrises them. All roots along the
// line are returned, in order; which of them lie on the face is the caller's domain check. Directions need not be unit:
// a distance t means origin + t * direction.
#if defined(TRIMRAY_SHARED_QUADRIC_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_QUADRIC_H
#undef TRIMRAY_SHARED_QUADRIC_H
#else
#define TRIMRAY_SHARED_QUADRIC_H
#endif

#include "shaders/shared/language.h"

SHARED_OPEN

// Roots t0 <= t1 in units of the direction's length; both kHuge where there are none. `touch`: where the line touches
// the surface so nearly that rounding decides whether there are roots; kHuge: it does not.
struct RootPair {
    real t0;
    real t1;
    real touch;
};

// How far from where it should a line may lie, for each unit of its origin's and its surface's size: the origin's sum
// of four terms, the direction's of three, and the six operations of a moment
const scalar kTouching = 16.0f * kRounding;

FN real touching_reach(scalar size, real3 origin)
{
    return kTouching * (size + abs(origin.x) + abs(origin.y) + abs(origin.z));
}

// Below this share of the direction's length a component counts as zero: a root would lie 2^40 sizes away
const scalar kParallel = 9.0949470e-13f;

FN RootPair no_roots_unless(mask real_roots, real t0, real t1)
{
    RootPair roots;
    roots.t0 = select(real_roots, min(t0, t1), real(kHuge));
    roots.t1 = select(real_roots, max(t0, t1), real(kHuge));
    roots.touch = real(kHuge);
    return roots;
}

// z = 0
FN RootPair plane_roots(real3 origin, real3 direction)
{
    mask crosses = abs(direction.z) > kParallel * (abs(direction.x) + abs(direction.y));
    PRECISE real t = -origin.z / select(crosses, direction.z, real(1.0f));
    RootPair roots;
    roots.t0 = select(crosses, t, real(kHuge));
    roots.t1 = real(kHuge);
    // in the plane: anywhere
    mask lies_in = abs(direction.z) <= kTouching * (abs(direction.x) + abs(direction.y)) &&
                   abs(origin.z) <= touching_reach(1.0f, origin);
    roots.touch = select(lies_in, real(-kHuge), real(kHuge));
    return roots;
}

// x^2 + y^2 = r^2. From the point nearest to the axis, so that nothing cancels: with n = direction.xy and
// m = origin.xy x n, that point is at distance |m| / |n| and t = -origin.xy . n / n^2.
FN RootPair cylinder_roots(scalar r, real3 origin, real3 direction)
{
    PRECISE real n2 = direction.x * direction.x + direction.y * direction.y;
    mask crosses = n2 > kParallel * (n2 + direction.z * direction.z);
    n2 = select(crosses, n2, real(1.0f));
    PRECISE real n = sqrt(n2);
    PRECISE real m = abs(origin.x * direction.y - origin.y * direction.x);
    PRECISE real half2 = (r * n - m) * (r * n + m); // (half chord * n)^2
    PRECISE real middle = -(origin.x * direction.x + origin.y * direction.y);
    PRECISE real half_chord = sqrt(max(half2, real(0.0f)));
    RootPair roots = no_roots_unless(crosses && half2 >= 0.0f, (middle - half_chord) / n2, (middle + half_chord) / n2);
    mask touches = crosses && abs(r * n - m) <= n * touching_reach(r, origin);
    roots.touch = select(touches, (middle - half_chord) / n2, real(kHuge));
    return roots;
}

// x^2 + y^2 + z^2 = r^2, from the point of the line nearest to the centre
FN RootPair sphere_roots(scalar r, real3 origin, real3 direction)
{
    PRECISE real n2 = dot(direction, direction);
    PRECISE real middle = -dot(origin, direction) / n2;
    PRECISE real3 nearest = origin + direction * middle;
    PRECISE real d = length(nearest);
    PRECISE real half2 = (r - d) * (r + d);
    PRECISE real half_chord = sqrt(max(half2, real(0.0f)) / n2);
    RootPair roots = no_roots_unless(half2 >= 0.0f, middle - half_chord, middle + half_chord);
    roots.touch = select(abs(r - d) <= touching_reach(r, origin), middle - half_chord, real(kHuge));
    return roots;
}

// One Newton step of a root of the cone towards hypot(x, y) = |rho|, rho = r + z tan a, which cancels less than the
// quadratic's coefficients; a step that is not small is a root that Newton should leave alone.
FN real polish_cone_root(scalar r, scalar tan_a, real3 origin, real3 direction, real t)
{
    mask is_root = abs(t) < kHuge;
    real at = select(is_root, t, real(0.0f));
    PRECISE real3 p = origin + direction * at;
    PRECISE real rho = r + p.z * tan_a;
    PRECISE real hypot = sqrt(p.x * p.x + p.y * p.y);
    PRECISE real g = hypot - abs(rho);
    PRECISE real rho_t = direction.z * tan_a;
    PRECISE real g_t =
        (p.x * direction.x + p.y * direction.y) / max(hypot, real(1e-20f)) - select(rho < 0.0f, -rho_t, rho_t);
    mask steep = abs(g_t) > 1e-3f * length(direction);
    PRECISE real step = g / select(steep, g_t, real(1.0f));
    mask small = steep && abs(step) * length(direction) < 1e-2f * (abs(rho) + length(p));
    return select(is_root && small, at - step, t);
}

// x^2 + y^2 = (r + z tan a)^2: both nappes
FN RootPair cone_roots(scalar r, scalar tan_a, real3 origin, real3 direction)
{
    PRECISE real rho = r + origin.z * tan_a;
    PRECISE real rho_t = direction.z * tan_a;
    PRECISE real a = direction.x * direction.x + direction.y * direction.y - rho_t * rho_t;
    PRECISE real b = origin.x * direction.x + origin.y * direction.y - rho * rho_t;
    PRECISE real c = origin.x * origin.x + origin.y * origin.y - rho * rho;
    // b^2 - a c without its cancellation, which blots out the apex: with m = (x, y, rho) x (x, y, rho)_t it is
    // m_x^2 + m_y^2 - m_rho^2, and m is as small as the line is near the apex
    PRECISE real m_x = origin.y * rho_t - rho * direction.y;
    PRECISE real m_y = rho * direction.x - origin.x * rho_t;
    PRECISE real m_rho = abs(origin.x * direction.y - origin.y * direction.x);
    PRECISE real m = sqrt(m_x * m_x + m_y * m_y);
    PRECISE real discriminant = (m - m_rho) * (m + m_rho);
    PRECISE real root = sqrt(max(discriminant, real(0.0f)));
    // q keeps the larger of the two sums; its partner is c / q
    PRECISE real q = -(b + select(b < 0.0f, -root, root));
    mask has_first = abs(a) > kParallel * (direction.x * direction.x + direction.y * direction.y + rho_t * rho_t);
    mask has_second = abs(q) > 0.0f;
    PRECISE real first = q / select(has_first, a, real(1.0f));
    PRECISE real second = c / select(has_second, q, real(1.0f));
    mask some = discriminant >= 0.0f;
    // q = 0 makes both roots 0 / a
    first = select(some && has_first, first, real(kHuge));
    second = select(some && has_second, second, select(some && has_first, first, real(kHuge)));
    first = polish_cone_root(r, tan_a, origin, direction, first);
    second = polish_cone_root(r, tan_a, origin, direction, second);
    RootPair roots;
    roots.t0 = min(first, second);
    roots.t1 = max(first, second);
    // b^2 - a c loses what its terms' own sums of squares lose
    PRECISE real squares = (direction.x * direction.x + direction.y * direction.y + rho_t * rho_t) *
                           (origin.x * origin.x + origin.y * origin.y + rho * rho);
    mask touches = has_first && abs(discriminant) <= 2.0f * kTouching * squares;
    roots.touch = select(touches, select(some, roots.t0, -b / select(has_first, a, real(1.0f))), real(kHuge));
    return roots;
}

// uv_patch of a point on the surface. Angles in [-pi, pi].
FN real2 plane_uv(real3 p)
{
    return real2(p.x, p.y);
}
FN real2 cylinder_uv(real3 p)
{
    return real2(angle_of(p.x, p.y), p.z);
}
// v = z / cos a; on the nappe of negative radius u points the other way
FN real2 cone_uv(scalar r, scalar tan_a, real3 p)
{
    PRECISE real rho = r + p.z * tan_a;
    real turn = select(rho < 0.0f, real(-1.0f), real(1.0f));
    return real2(angle_of(p.x * turn, p.y * turn), p.z * sqrt(1.0f + tan_a * tan_a));
}
FN real2 sphere_uv(real3 p)
{
    return real2(angle_of(p.x, p.y), angle_of(sqrt(p.x * p.x + p.y * p.y), p.z));
}

// Directions of S_u x S_v in right-handed axes, not unit; negate for a left-handed axis system.
FN real3 plane_normal()
{
    return real3(real(0.0f), real(0.0f), real(1.0f));
}
FN real3 cylinder_normal(real3 p)
{
    return real3(p.x, p.y, real(0.0f));
}
// (cos u, sin u, -tan a) times the radius, where S_u x S_v = rho (cos a cos u, cos a sin u, -sin a)
FN real3 cone_normal(scalar r, scalar tan_a, real3 p)
{
    PRECISE real rho = r + p.z * tan_a;
    real hypot = sqrt(p.x * p.x + p.y * p.y);
    mask apex = hypot <= 0.0f; // there the axis is the mean of all normals
    real lean = select(rho < 0.0f, hypot * tan_a, -hypot * tan_a);
    return real3(select(apex, real(0.0f), p.x), select(apex, real(0.0f), p.y),
                 select(apex, real(tan_a > 0.0f ? -1.0f : 1.0f), lean));
}
FN real3 sphere_normal(real3 p)
{
    return p;
}

SHARED_CLOSE
#endif
