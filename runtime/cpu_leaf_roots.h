// The roots of rays in a leaf of a Bezier patch, 16 at once: of 16 rays in the whole leaf, or of one ray in 16 parts of
// it. Included once per target by cpu_packet.h.
#if defined(TRIMRAY_CPU_LEAF_ROOTS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_LEAF_ROOTS_H
#undef TRIMRAY_CPU_LEAF_ROOTS_H
#else
#define TRIMRAY_CPU_LEAF_ROOTS_H
#endif

#include "runtime/cpu_evaluate.h"
#include "runtime/cpu_fetch.h"
#include "shaders/shared/leaf_proof.h"

#include <cstdint>

SHARED_OPEN

/// A Bezier patch as a view's rays see it.
struct NewtonPatch {
    const FetchSource& source;
    uint first_control_point;
    int degree_u, degree_v;
    Evaluate evaluate;
    scalar enough;   // residual of the last step, patch units
    scalar rounding; // residual that rounding alone may leave, patch units

    HWY_ATTR SurfacePoint at(real2 uv) const { return evaluate(source, first_control_point, degree_u, degree_v, uv); }
};

/// Work is counted a ray, not a packet: what Vulkan's invocations count.
FN uint64_t lane_count(mask lanes)
{
    return uint64_t(__builtin_popcount(lane_bits(lanes)));
}

/// Rectangles of one leaf, one a lane.
struct Rectangle {
    real2 middle;
    scalar2 half_side;
    RayBend bend; // around its middle
};

/// Newton's iteration in a rectangle, by lane
struct Search {
    mask settled;  // ended at a root
    mask exact;    // its last step is proved to end within rounding
    mask complete; // proved: the rectangle holds no root but this one, and none if it has not settled
    mask blurred;  // rounding decides whether the root is the patch's
    SurfacePoint s;
    SeenPoint seen;
    NewtonStep next;
    real2 uv;
};

/// The larger of |d| in half sides.
FN real farther(real2 d, scalar2 per_side)
{
    return max(abs(d.x) * per_side.x, abs(d.y) * per_side.y);
}

/// From the rectangle's middle, where the surface is `s`, in the lanes `moving`. Counts its `steps`.
FN_LARGE Search find_root(const NewtonPatch& newton, const LeafPlane& leaf, const Rectangle& rectangle,
                          const RayPlanes& planes, SurfacePoint s, SeenPoint seen, mask moving, uint64_t& steps)
{
    const real2 middle = rectangle.middle;
    const scalar2 half_side = rectangle.half_side;
    const scalar2 per_side(1.0f / half_side.x, 1.0f / half_side.y);
    Search search{mask(false), mask(false), mask(false), mask(false), s, seen, {}, middle};
    RootBox where{middle - real2(half_side), middle + real2(half_side)};
    mask none(false), near(false);
    // a lane that has settled stays where it is, so that the last round's point is every settled lane's
    for (int step = 0;; ++step) {
        real2& uv = search.uv;
        if (step > 0) {
            search.s = newton.at(uv);
            search.seen = seen_point(search.s, planes);
        }
        search.next = newton_step(search.seen, uv);
        const NewtonStep& next = search.next;
        const real off = farther(uv - middle, per_side);
        const RayBend from = bend_from(rectangle.bend, off);
        const real2 moved = next.uv - uv;
        const real turn = from.bend * farther(moved, per_side);
        const mask exact = newton_exact(leaf, search.s, next, moved, turn, newton.rounding, newton.enough);
        const mask found = moving && (exact || newton_settled(next, turn, near, newton.rounding));
        near = next.residual <= newton.rounding + next.blur;
        search.exact = select(found, exact, search.exact);
        search.settled = search.settled || found;
        moving = moving && !found;
        const RootBox less = narrowed(where, leaf, search.seen, uv, next.uv, from.bend, half_side, newton.rounding);
        const mask known = moving && !next.singular;
        where.lo = select(known, less.lo, where.lo);
        where.hi = select(known, less.hi, where.hi);
        const mask empty = moving && is_empty(where);
        none = none || empty;
        moving = moving && !empty;
        if (!any_lane(moving) || step == kNewtonSteps)
            break;
        steps += lane_count(moving);
        const real2 to =
            real2(kept_near(next.uv.x, middle.x, half_side.x), kept_near(next.uv.y, middle.y, half_side.y));
        const mask stuck = newton_stuck(next, uv, to);
        uv = select(moving, to, uv);
        moving = moving && !stuck;
    }
    // one root at most in a rectangle as large as to hold it
    const real off = max(farther(search.uv - middle, per_side), real(1.0f));
    search.blurred = search.settled && is_blurred(search.uv, root_blur(search.seen, newton.rounding));
    search.complete = none || (search.settled && holds_one(rectangle.bend, off));
    return search;
}

struct Root {
    mask found; // it lies on the patch
    real2 uv;
    real t;
    real3 normal;
};

/// S_u x S_v at uv, where the patch's point is s, for the lanes `asked`; beyond a side the one at the side, and at
/// a pole or along a degenerate side the one a little way inside.
FN_LARGE real3 patch_normal(const NewtonPatch& newton, SurfacePoint s, real2 uv, mask asked)
{
    const real2 within(clamp(uv.x, real(0.0f), real(1.0f)), clamp(uv.y, real(0.0f), real(1.0f)));
    // beyond a side that is one point the patch is turned inside out
    const mask beyond = asked && !(within.x == uv.x && within.y == uv.y);
    if (any_lane(beyond)) {
        const SurfacePoint side = newton.at(within);
        s.du = select(beyond, side.du, s.du);
        s.dv = select(beyond, side.dv, s.dv);
    }
    const real3 normal = cross(s.du, s.dv);
    const mask flat = dot(normal, normal) <= 1e-10f * dot(s.du, s.du) * dot(s.dv, s.dv) ||
                      dot(s.du, s.du) <= 1e-10f * dot(s.dv, s.dv) || dot(s.dv, s.dv) <= 1e-10f * dot(s.du, s.du);
    if (!any_lane(asked && flat))
        return normal;
    constexpr float kInwards = 1.0f / 2048;
    const SurfacePoint inside = newton.at(within + real2(0.5f - within.x, 0.5f - within.y) * real(kInwards));
    return select(flat, cross(inside.du, inside.dv), normal);
}

/// What the search ended at; accepted anywhere on the patch, so that leaves leave no gaps.
FN_LARGE Root end_of(const NewtonPatch& newton, const Search& search, real3 origin, real3 direction)
{
    Root end;
    const NewtonRoot root = newton_root(search.s, search.next, search.uv, search.exact, origin, direction);
    const real2 overlap = patch_overlap(root_blur(search.seen, newton.rounding));
    end.uv = root.uv;
    end.t = root.t;
    end.found =
        search.settled && abs(root.uv.x - 0.5f) <= 0.5f + overlap.x && abs(root.uv.y - 0.5f) <= 0.5f + overlap.y;
    end.normal = patch_normal(newton, search.s, search.uv, end.found);
    return end;
}

constexpr int kMostRoots = 12; // of a ray in a leaf

/// The roots of a packet's rays, in arrays by root and lane
struct RootLists {
    alignas(64) float t[kMostRoots][kLanes], u[kMostRoots][kLanes], v[kMostRoots][kLanes];
    alignas(64) float nx[kMostRoots][kLanes], ny[kMostRoots][kLanes], nz[kMostRoots][kLanes];
    int count[kLanes] = {};
};

/// Appends the roots that were found; false where they are too many.
FN bool list(const Root& root, int lane, RootLists& roots)
{
    alignas(64) float values[6][kLanes];
    const real* const from[6] = {&root.t, &root.uv.x, &root.uv.y, &root.normal.x, &root.normal.y, &root.normal.z};
    const uint found = lane_bits(root.found);
    if (found == 0)
        return true;
    for (int i = 0; i < 6; ++i)
        store(*from[i], values[i]);
    float(*const to[6])[kLanes] = {roots.t, roots.u, roots.v, roots.nx, roots.ny, roots.nz};
    for (uint bits = found; bits != 0; bits &= bits - 1) {
        int& count = roots.count[lane];
        if (count == kMostRoots)
            return false;
        for (int i = 0; i < 6; ++i)
            to[i][count][lane] = values[i][__builtin_ctz(bits)];
        ++count;
    }
    return true;
}

/// Of one ray, 16 rectangles of the leaf at once, and 16 of each in which that leaves something open. False: there
/// may be more roots than those listed.
FN_LARGE bool list_roots(const NewtonPatch& newton, const LeafPlane& leaf, const RayPlanes& ray, real3 origin,
                         real3 direction, int lane, RootLists& roots, uint64_t& steps)
{
    struct Part {
        float u, v; // its middle
        int depth;
    };
    Part stack[kLanes * kDeepestSplit];
    int waiting = 0, split = 0;
    bool all = true;
    stack[waiting++] = {leaf.middle.x, leaf.middle.y, 0};
    const integer numbers = lane_numbers();
    const real column = to_real(numbers & integer(3u)) * real(2.0f) - real(3.0f);
    const real row = to_real(numbers >> integer(2u)) * real(2.0f) - real(3.0f);
    while (waiting > 0) {
        const Part part = stack[--waiting];
        if (split++ == kMostSplits)
            return false;
        const bool last = part.depth + 1 == kDeepestSplit;
        const scalar share = split_share(part.depth + 1);
        Rectangle rectangle;
        rectangle.half_side = scalar2(leaf.half_side.x * share, leaf.half_side.y * share);
        rectangle.middle = real2(part.u + column * rectangle.half_side.x, part.v + row * rectangle.half_side.y);
        const SurfacePoint s = newton.at(rectangle.middle);
        const SeenPoint seen = seen_point(s, ray);
        steps += kLanes;
        rectangle.bend = bend_around(leaf, ray, seen, share);
        const mask met = !passes_by(leaf, ray, s, seen, share, newton.rounding);
        const mask at_end = mask(last) || bends_as_ever(leaf, s, share);
        const mask moving = met && (holds_one(rectangle.bend, real(1.0f)) || at_end || mask(part.depth == 0));
        mask open = met;
        if (any_lane(moving)) {
            const Search search = find_root(newton, leaf, rectangle, ray, s, seen, moving, steps);
            open = met && !search.complete;
            all = all && !any_lane(moving && search.blurred);
            const Root root = end_of(newton, search, origin, direction);
            all = list(root, lane, roots) && all;
        }
        all = all && !any_lane(open && at_end);
        open = open && !at_end;
        alignas(64) float u[kLanes], v[kLanes];
        store(rectangle.middle.x, u);
        store(rectangle.middle.y, v);
        for (uint bits = lane_bits(open); bits != 0; bits &= bits - 1) {
            const int i = __builtin_ctz(bits);
            stack[waiting++] = {u[i], v[i], part.depth + 1};
        }
    }
    return all;
}

SHARED_CLOSE
#endif
