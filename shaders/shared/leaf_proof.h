// What the bounds of a leaf's bend (format/leaf_bend.h) prove about the roots of a ray in it: that there is none, that
// there is one at most, and that a Newton step ends within rounding of one.
//
// A ray sees the leaf through the map F = P S of the plane, P the projection along the ray. With DS_0 the derivative at
// the leaf's middle and |R .| the length of a vector of uv_patch on the plane of DS_0, the ray's bend k of a rectangle
// around a point c is a bound of |(P DS_c)^-1 (P DS_a - P DS_b)| in that norm, for a and b as far apart as the
// rectangle's half sides. Then, d being Newton's step from c,
// - a root x of the rectangle lies within k / 2 |R (x - c)| of c + d;
// - if k < 1 there is one root at most;
// - if k |d| <= 1/2, |d| in half sides, there is a root within k |d| |R d| of c + d;
// - if c is a root and the whole rectangle lies within l half sides of it, k l / 2 < 1, it has no other.
// What single precision loses of DS_c, E, adds its noise to that, a bound e of |(P DS_c)^-1 P E| whatever the
// rectangle's size: to k for the one root; and the length of E (x - c) to what rounding may have moved c + d.
// Source: Krawczyk 1969; Kantorovich's theorem (Ortega & Rheinboldt 12.6); the contraction mapping theorem (5.1).
#if defined(TRIMRAY_SHARED_LEAF_PROOF_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_LEAF_PROOF_H
#undef TRIMRAY_SHARED_LEAF_PROOF_H
#else
#define TRIMRAY_SHARED_LEAF_PROOF_H
#endif

#include "shaders/shared/leaf_box.h"
#include "shaders/shared/patch_newton.h"

SHARED_OPEN

// What stands for a bend beyond every proof
const scalar kMostBend = 1e4f;

// The leaf at its middle, the same for all rays
struct LeafPlane {
    scalar3 p; // S, S_u, S_v there, patch units
    scalar3 du;
    scalar3 dv;
    scalar3 normal; // unit
    scalar3 axis;   // unit, along S_u
    scalar2 middle; // uv_patch
    scalar2 half_side;
    scalar uu; // S_u . S_u, |S_u . S_v|, S_v . S_v
    scalar uv;
    scalar vv;
    scalar2 per_length; // u and v of a vector are at most these times its length on the plane
    scalar area;        // |S_u x S_v|
    scalar size;        // the longest way on the plane from the middle to a corner
    scalar along;       // LeafBend; kHuge: nothing is known
    scalar across;
    scalar2 lost; // by single precision, of S_u and S_v, length
    scalar noise; // what that is to along and across, whatever the rectangle's size
};

// What single precision loses of a leaf's S_u and S_v, length. most: PatchRecord::param
FN scalar2 derivative_loss(LeafBox box, scalar2 most, int degree_u, int degree_v)
{
    scalar of_point = patch_rounding(degree_u, degree_v);
    return scalar2(loss_of(most.x, of_point, degree_u, box.uv_lo.x, box.uv_hi.x),
                   loss_of(most.y, of_point, degree_v, box.uv_lo.y, box.uv_hi.y));
}

// lost: derivative_loss
FN LeafPlane leaf_plane(LeafBox box, scalar3 p, scalar3 du, scalar3 dv, scalar2 lost)
{
    LeafPlane leaf;
    leaf.p = p;
    leaf.du = du;
    leaf.dv = dv;
    leaf.middle = leaf_middle(box);
    leaf.half_side = leaf_half_side(box);
    scalar3 n = cross(du, dv);
    leaf.uu = dot(du, du);
    leaf.uv = max(dot(du, dv), -dot(du, dv));
    leaf.vv = dot(dv, dv);
    scalar long_u = sqrt(leaf.uu);
    scalar long_v = sqrt(leaf.vv);
    leaf.area = sqrt(dot(n, n));
    bool no_plane = leaf.area <= 1e-6f * long_u * long_v || leaf.area <= 0.0f;
    scalar per_area = no_plane ? 0.0f : 1.0f / leaf.area;
    leaf.normal = n * per_area;
    leaf.axis = du * (no_plane ? 0.0f : 1.0f / long_u);
    leaf.per_length = scalar2(long_v * per_area, long_u * per_area);
    scalar3 to_u = du * leaf.half_side.x;
    scalar3 to_v = dv * leaf.half_side.y;
    leaf.size = max(sqrt(dot(to_u + to_v, to_u + to_v)), sqrt(dot(to_u - to_v, to_u - to_v)));
    // |E R^-1| of the columns' errors: R^-1's rows are per_length long
    leaf.lost = lost;
    leaf.noise = lost.x * leaf.per_length.x + lost.y * leaf.per_length.y;
    no_plane = no_plane || leaf.noise >= kOneRoot;
    leaf.along = no_plane ? kHuge : box.along;
    leaf.across = no_plane ? kHuge : box.across;
    return leaf;
}

// A leaf that leaves something open is split into its quarters, those of its parts that do as well, so often and for a
// ray into so many parts
const int kDeepestSplit = 6;
const int kMostParts = 384;
// A rectangle that bends more is split without a search, which would mostly leave it open; one that may hold several
// roots and is split after it is given so many steps
const scalar kLargestSearched = 1.5f;
const int kGrazingSteps = 2;

// Of a rectangle as a ray sees it around a point
struct RayBend {
    real bend;  // k, of the rectangle's half sides
    real noise; // e, whatever the rectangle's size
};

// The ray's bend of the leaf around its middle: along + across / tan b, b the ray's slope against the leaf's plane
FN RayBend middle_bend(LeafPlane leaf, SeenPoint middle)
{
    real sine = abs(middle.det);
    real cosine = sqrt(max(leaf.area * leaf.area - sine * sine, real(0.0f)));
    // cosine loses 4e-4 of the area to rounding where b is nearly a right angle
    real per_slope = (cosine + 4e-4f * leaf.area) / max(sine, real(1e-20f));
    RayBend ray;
    ray.bend = min(leaf.along + leaf.across * per_slope, real(kMostBend));
    ray.noise = min(leaf.noise + leaf.noise * per_slope, real(kMostBend));
    return ray;
}

FN real3 on_plane(LeafPlane leaf, RayPlanes ray, SeenPoint seen, scalar3 y)
{
    real y1 = dot(ray.n1, real3(y));
    real y2 = dot(ray.n2, real3(y));
    real u = seen.dv.y * y1 - seen.dv.x * y2;
    real v = seen.du.x * y2 - seen.du.y * y1;
    return real3(leaf.du) * u + real3(leaf.dv) * v;
}

// The ray's bend of a rectangle `share` times the leaf's size, around any point of the leaf
FN RayBend bend_around(LeafPlane leaf, RayPlanes ray, SeenPoint seen, real share)
{
    // R (P DS_c)^-1 P [Q n]: of two orthogonal axes of the leaf's plane, and of its normal
    real3 a = on_plane(leaf, ray, seen, leaf.axis);
    real3 b = on_plane(leaf, ray, seen, cross(leaf.normal, leaf.axis));
    real3 n = on_plane(leaf, ray, seen, leaf.normal);
    // the largest singular value of [a b]
    real aa = dot(a, a);
    real bb = dot(b, b);
    real ab = dot(a, b);
    real spread = sqrt((aa - bb) * (aa - bb) + 4.0f * ab * ab);
    real per_det = 1.0f / max(abs(seen.det), real(1e-20f));
    real of_plane = sqrt(0.5f * (aa + bb + spread)) * per_det;
    real of_normal = length(n) * per_det;
    RayBend around;
    around.bend = min(share * (leaf.along * of_plane + leaf.across * of_normal), real(kMostBend));
    around.noise = min(leaf.noise * (of_plane + of_normal), real(kMostBend));
    return around;
}

// True where a rectangle `share` times the leaf's size, whose middle is `s`, bends too much for any ray's proof, and
// for its size no less than half as much as the leaf: beside a pole, where a derivative vanishes, none is small enough.
// And where rounding, which splitting does not lessen, hides all from this ray: small parts still tell that it passes
// by.
FN mask splits_in_vain(LeafPlane leaf, SurfacePoint s, RayBend ray, real share)
{
    real less = share * min(leaf.along, 2.0f);
    mask is_short = dot(s.du, s.du) <= less * less * leaf.uu || dot(s.dv, s.dv) <= less * less * leaf.vv;
    // of half a leaf the first tells nothing
    return (is_short && share < 0.5f) || (ray.noise >= kOneRoot && share <= 0.125f);
}

// True where a rectangle is searched before it is split
FN mask is_searched(RayBend ray)
{
    return ray.bend + ray.noise < kLargestSearched;
}

// True where a rectangle `off` times as large holds one root at most
FN mask holds_one(RayBend ray, real off)
{
    return ray.bend * off + ray.noise < kOneRoot;
}

// Where the points of a rectangle lie along a direction of the picture: off + s u + t v, |s|, |t| <= 1, but for `bend`
struct Spread {
    real off;
    real u;
    real v;
    real bend; // and what rounding adds to it
};

// Of a rectangle `share` times the leaf's size around the point `seen`, along the unit vector (m1, m2)
FN Spread spread_along(LeafPlane leaf, RayPlanes ray, SeenPoint seen, real m1, real m2, real share, scalar rounding)
{
    real up = abs(dot(ray.n1 * m1 + ray.n2 * m2, real3(leaf.normal)));
    real level = sqrt(max(1.0f - up * up, real(0.0f)));
    real bend = (0.5f * share * share * leaf.size) * (leaf.along * level + leaf.across * up);
    real lost = share * (leaf.lost.x * leaf.half_side.x + leaf.lost.y * leaf.half_side.y);
    Spread spread;
    spread.off = m1 * seen.r.x + m2 * seen.r.y;
    spread.u = (m1 * seen.du.x + m2 * seen.du.y) * (share * leaf.half_side.x);
    spread.v = (m1 * seen.dv.x + m2 * seen.dv.y) * (share * leaf.half_side.y);
    // rounding twice: for the point, and for a root that a patch's overlap lets in
    spread.bend = bend + lost + 4.0f * rounding;
    return spread;
}

// True where all its points lie on one side of the ray
FN mask lies_aside(Spread spread)
{
    return abs(spread.off) > abs(spread.u) + abs(spread.v) + spread.bend;
}

// Of the rectangle's quarter, whose points are no others, towards (to_u, to_v), each 1 or -1
FN Spread quarter_spread(Spread of, scalar to_u, scalar to_v)
{
    Spread spread;
    spread.u = 0.5f * of.u;
    spread.v = 0.5f * of.v;
    spread.off = of.off + to_u * spread.u + to_v * spread.v;
    spread.bend = of.bend;
    return spread;
}

// A rectangle along the surface's normal `s.du` x `s.dv` as the ray sees it, where a rectangle that it grazes is thin,
// and across it
struct Sight {
    Spread along;
    Spread across;
};

FN Sight sight_of(LeafPlane leaf, RayPlanes ray, SurfacePoint s, SeenPoint seen, real share, scalar rounding)
{
    real3 n = cross(s.du, s.dv);
    real n1 = dot(ray.n1, n);
    real n2 = dot(ray.n2, n);
    real long_n = sqrt(n1 * n1 + n2 * n2);
    mask seen_across = long_n > 0.0f;
    real per_n = 1.0f / max(long_n, real(1e-20f));
    real m1 = select(seen_across, n1 * per_n, real(1.0f));
    real m2 = select(seen_across, n2 * per_n, real(0.0f));
    Sight sight;
    sight.along = spread_along(leaf, ray, seen, m1, m2, share, rounding);
    sight.across = spread_along(leaf, ray, seen, -m2, m1, share, rounding);
    return sight;
}

// True where the ray passes by the rectangle, whatever its slope
FN mask passes_by(Sight sight)
{
    return lies_aside(sight.along) || lies_aside(sight.across);
}

// And by its quarter of that number: 1 stands for the one towards larger u, 2 for larger v
FN mask passes_quarter(Sight sight, int quarter)
{
    scalar to_u = (quarter & 1) != 0 ? 1.0f : -1.0f;
    scalar to_v = (quarter & 2) != 0 ? 1.0f : -1.0f;
    return lies_aside(quarter_spread(sight.along, to_u, to_v)) || lies_aside(quarter_spread(sight.across, to_u, to_v));
}

// The bend around a point that lies `off` half sides from a rectangle's middle is the rectangle's divided by this;
// where it is 0 there is no bound
FN real bend_left(RayBend ray, real off)
{
    real left = 1.0f - (ray.bend * off + ray.noise);
    return select(left > 0.01f, left, real(0.0f));
}

FN real bend_from(RayBend ray, real off)
{
    real left = bend_left(ray, off);
    return select(left > 0.0f, ray.bend / max(left, real(0.01f)), real(kMostBend));
}

// The normal is that of a last step's beginning: by how much it may be turned, rad (0.0006 degrees)
const scalar kLastTurn = 1e-5f;

// turn / left: the bend of a rectangle of the size of a step around its beginning, no less than what the normal turns
// on the way. Where left is 0 only a step of no length turns little.
FN mask turns_little(real turn, real left)
{
    return turn <= kLastTurn * left;
}

// True where a step begins within rounding of the ray, as `near` says the step before did or where the normal turns no
// farther: one step more finds the place of the normal, none the root
FN mask newton_settled(NewtonStep next, mask little, mask near, scalar rounding)
{
    return next.residual <= rounding + next.blur && (near || little || next.singular);
}

// True where a step `moved` that turns `little` is proved to end within rounding of a root:
// 2 (turn / left |R moved| + lost) <= rounding, without the division and the root
FN mask newton_exact(LeafPlane leaf, SurfacePoint s, NewtonStep next, real2 moved, real turn, real left, mask little,
                     scalar rounding, scalar enough)
{
    real3 way = s.du * moved.x + s.dv * moved.y;
    real lost = leaf.lost.x * abs(moved.x) + leaf.lost.y * abs(moved.y);
    real room = (0.5f * rounding - lost) * left;
    return !next.singular && next.residual <= enough && little && room >= 0.0f &&
           turn * turn * dot(way, way) <= room * room;
}

// True where rounding moves a root `uv` across a side of the patch by more than the patch's overlap lets in
FN mask is_blurred(real2 uv, real2 blur)
{
    real beside_u = abs(abs(uv.x - 0.5f) - 0.5f);
    real beside_v = abs(abs(uv.y - 0.5f) - 0.5f);
    return (blur.x > kNewtonOutside && beside_u <= blur.x) || (blur.y > kNewtonOutside && beside_v <= blur.y);
}

// By how much more than a hair rounding moves a point, patch units; `footprint`: of a hit, patch units
FN real more_than_hair(real footprint, scalar rounding)
{
    return rounding - kHairPx * footprint;
}

// True where a root at `uv`, moved by `blur`, may lie on either side of a side of [-slack, 1 + slack]^2
FN mask is_beside_side(real2 uv, real2 blur, scalar2 slack)
{
    real beyond_u = abs(uv.x - 0.5f) - (0.5f + slack.x);
    real beyond_v = abs(uv.y - 0.5f) - (0.5f + slack.y);
    mask outside = beyond_u > blur.x || beyond_v > blur.y;
    return !outside && (beyond_u > -blur.x || beyond_v > -blur.y);
}

// True where a point moved by `off` moves a root along its ray by more than a depth may be off: off / sin b, b the
// ray's slope
FN mask is_depth_unsure(SurfacePoint s, real3 direction, real off, real footprint)
{
    real3 n = cross(s.du, s.dv);
    return off * length(n) * length(direction) > kDepthPx * footprint * abs(dot(n, direction));
}

// Where a ray's roots in a rectangle may lie, uv_patch; empty where hi < lo
struct RootBox {
    real2 lo;
    real2 hi;
};

FN mask is_empty(RootBox box)
{
    return box.hi.x < box.lo.x || box.hi.y < box.lo.y;
}

// The larger of |d|, in half sides of a rectangle that are 1 / per_side
FN real farther(real2 d, real2 per_side)
{
    return max(abs(d.x) * per_side.x, abs(d.y) * per_side.y);
}

// `box` cut to where a root may lie after a step from `uv`, `seen` there, to `to`; `bend` around uv of a rectangle with
// half sides 1 / per_side; `rounding`: of a point.
FN RootBox narrowed(RootBox box, LeafPlane leaf, SeenPoint seen, real2 uv, real2 to, real bend, real2 per_side,
                    scalar rounding)
{
    // from uv to the farthest point of the box
    real off_u = max(uv.x - box.lo.x, box.hi.x - uv.x);
    real off_v = max(uv.y - box.lo.y, box.hi.y - uv.y);
    real far = farther(real2(off_u, off_v), per_side);
    real way = sqrt(leaf.uu * off_u * off_u + 2.0f * leaf.uv * off_u * off_v + leaf.vv * off_v * off_v);
    // on the leaf's plane; beyond every proof a root may lie anywhere
    real reach = select(bend < kMostBend, 0.5f * bend * far * way, real(kHuge));
    real2 blur = root_blur(seen, 2.0f * rounding + leaf.lost.x * off_u + leaf.lost.y * off_v);
    real2 off = real2(reach * leaf.per_length.x + blur.x, reach * leaf.per_length.y + blur.y);
    RootBox less;
    less.lo = real2(max(box.lo.x, to.x - off.x), max(box.lo.y, to.y - off.y));
    less.hi = real2(min(box.hi.x, to.x + off.x), min(box.hi.y, to.y + off.y));
    return less;
}

// True where `uv` is the box's only root; `around`: the bend around it of a rectangle with half sides 1 / per_side. On
// the way to another one DS would have to turn by 1 in the mean, and turns evenly.
FN mask is_only_root(RootBox box, real2 uv, RayBend around, real2 per_side)
{
    real off_u = max(uv.x - box.lo.x, box.hi.x - uv.x);
    real off_v = max(uv.y - box.lo.y, box.hi.y - uv.y);
    return holds_one(around, 0.5f * farther(real2(off_u, off_v), per_side));
}

SHARED_CLOSE
#endif
