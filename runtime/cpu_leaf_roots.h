// The roots of rays in a leaf of a Bezier patch, 16 at once: of 16 rays in the whole leaf, or of any of them in 16
// parts of it. Included once per target by cpu_packet.h.
#if defined(TRIMRAY_CPU_LEAF_ROOTS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_LEAF_ROOTS_H
#undef TRIMRAY_CPU_LEAF_ROOTS_H
#else
#define TRIMRAY_CPU_LEAF_ROOTS_H
#endif

#include "runtime/cpu_evaluate.h"
#include "runtime/cpu_fetch.h"
#include "shaders/shared/leaf_proof.h"

#include <algorithm>
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
    scalar2 slack;   // kDomainSlack in uv_patch

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
    real2 half_side;
    real share;   // of the leaf's size
    RayBend bend; // around its middle
    mask last;    // it will not be split
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

/// From the rectangle's middle, where the surface is `s`, in the lanes `moving`. Counts its `steps`.
FN_LARGE Search find_root(const NewtonPatch& newton, const LeafPlane& leaf, const Rectangle& rectangle,
                          const RayPlanes& planes, SurfacePoint s, SeenPoint seen, mask moving, uint64_t& steps)
{
    const real2 middle = rectangle.middle;
    const real2 half_side = rectangle.half_side;
    const real2 per_side(1.0f / half_side.x, 1.0f / half_side.y);
    Search search{mask(false), mask(false), mask(false), mask(false), s, seen, {}, middle};
    RootBox where{middle - half_side, middle + half_side};
    mask none(false), near(false);
    const mask straight = holds_one(rectangle.bend, real(1.0f));
    // a lane that has settled stays where it is, so that the last round's point is every settled lane's
    for (int step = 0;; ++step) {
        real2& uv = search.uv;
        if (step > 0) {
            search.s = newton.at(uv);
            search.seen = seen_point(search.s, planes);
        }
        search.next = newton_step(search.seen, uv);
        const NewtonStep& next = search.next;
        const auto bend_here = [&]()
                                   HWY_ATTR { return bend_from(rectangle.bend, farther(uv - middle, per_side)).bend; };
        const mask on_ray = next.residual <= newton.rounding + next.blur;
        if (any_lane(moving && (on_ray || next.residual <= newton.enough))) {
            const real2 moved = next.uv - uv;
            const real turn = bend_here() * farther(moved, per_side);
            const mask exact = newton_exact(leaf, search.s, next, moved, turn, newton.rounding, newton.enough);
            const mask found = moving && (exact || newton_settled(next, turn, near, newton.rounding));
            search.exact = select(found, exact, search.exact);
            search.settled = search.settled || found;
            moving = moving && !found;
        }
        near = on_ray;
        // a step that ends in the rectangle leaves a root there
        const mask beyond = moving && !next.singular && farther(next.uv - middle, per_side) > 1.0f;
        if (any_lane(beyond)) {
            real bend = bend_here();
            if (any_lane(beyond && !straight))
                bend = select(straight, bend, bend_around(leaf, planes, search.seen, rectangle.share).bend);
            const RootBox less = narrowed(where, leaf, search.seen, uv, next.uv, bend, per_side, newton.rounding);
            where.lo = select(beyond, less.lo, where.lo);
            where.hi = select(beyond, less.hi, where.hi);
            const mask empty = beyond && is_empty(where);
            none = none || empty;
            moving = moving && !empty;
        }
        moving = moving && (straight || rectangle.last || mask(step < kGrazingSteps));
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
    const mask open = search.settled && !search.complete;
    if (any_lane(open)) {
        const RayBend around = bend_around(leaf, planes, search.seen, rectangle.share);
        search.complete = search.complete || (open && is_only_root(where, search.uv, around, per_side));
    }
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
    const real2 overlap = patch_overlap(root_blur(search.seen, newton.rounding), newton.slack);
    end.uv = root.uv;
    end.t = root.t;
    end.found =
        search.settled && abs(root.uv.x - 0.5f) <= 0.5f + overlap.x && abs(root.uv.y - 0.5f) <= 0.5f + overlap.y;
    end.normal = patch_normal(newton, search.s, search.uv, end.found);
    return end;
}

/// A packet's rays in a patch's space, to be chosen from by lane.
struct PacketRays {
    alignas(64) float values[14][kLanes];
};

FN PacketRays packet_rays(real3 origin, real3 direction, const RayPlanes& planes)
{
    const real* const from[14] = {&origin.x,    &origin.y,    &origin.z,    &direction.x, &direction.y,
                                  &direction.z, &planes.n1.x, &planes.n1.y, &planes.n1.z, &planes.d1,
                                  &planes.n2.x, &planes.n2.y, &planes.n2.z, &planes.d2};
    PacketRays rays;
    for (int i = 0; i < 14; ++i)
        store(*from[i], rays.values[i]);
    return rays;
}

constexpr int kMostRoots = 12; // of a ray in a leaf

/// The roots of a packet's rays, in arrays by root and ray.
struct RootLists {
    alignas(64) float t[kMostRoots][kLanes], u[kMostRoots][kLanes], v[kMostRoots][kLanes];
    alignas(64) float nx[kMostRoots][kLanes], ny[kMostRoots][kLanes], nz[kMostRoots][kLanes];
    int count[kLanes] = {};
};

/// Appends the roots that were found, lane i's to those of ray[i]. Returns the rays that have too many.
FN uint list(const Root& root, const uint (&ray)[kLanes], RootLists& roots)
{
    const uint found = lane_bits(root.found);
    if (found == 0)
        return 0;
    alignas(64) float values[6][kLanes];
    const real* const from[6] = {&root.t, &root.uv.x, &root.uv.y, &root.normal.x, &root.normal.y, &root.normal.z};
    for (int i = 0; i < 6; ++i)
        store(*from[i], values[i]);
    float(*const to[6])[kLanes] = {roots.t, roots.u, roots.v, roots.nx, roots.ny, roots.nz};
    uint too_many = 0;
    for (uint bits = found; bits != 0; bits &= bits - 1) {
        const int lane = __builtin_ctz(bits);
        int& count = roots.count[ray[lane]];
        if (count == kMostRoots) {
            too_many |= 1u << ray[lane];
            continue;
        }
        for (int i = 0; i < 6; ++i)
            to[i][count][ray[lane]] = values[i][lane];
        ++count;
    }
    return too_many;
}

/// Parts of a leaf that wait to be searched, each for a ray of the packet.
class WaitingParts {
public:
    bool any() const { return count_ > 0; }

    /// The quarters of a part around (u, v) that is `depth` splits deep. False: there is no room.
    bool push_quarters(uint ray, float u, float v, uint depth, scalar2 half_side)
    {
        if (count_ + 4 > kMost)
            return false;
        for (int quarter = 0; quarter < 4; ++quarter) {
            ray_[count_] = ray;
            depth_[count_] = depth + 1;
            u_[count_] = u + (quarter & 1 ? half_side.x : -half_side.x);
            v_[count_] = v + (quarter & 2 ? half_side.y : -half_side.y);
            ++count_;
        }
        return true;
    }

    /// Takes the last ones, lane by lane; the lanes without one get the bits of none.
    struct Taken {
        uint lanes;
        alignas(64) uint ray[kLanes], depth[kLanes];
        alignas(64) float u[kLanes], v[kLanes];
    };
    void take(Taken& taken)
    {
        const int n = std::min(count_, int(kLanes));
        count_ -= n;
        taken.lanes = n == kLanes ? 0xffffu : (1u << n) - 1;
        for (int i = 0; i < kLanes; ++i) {
            const int from = count_ + std::min(i, n - 1);
            taken.ray[i] = ray_[from];
            taken.depth[i] = depth_[from];
            taken.u[i] = u_[from];
            taken.v[i] = v_[from];
        }
    }

private:
    static constexpr int kMost = 1024;
    int count_ = 0;
    uint ray_[kMost], depth_[kMost];
    float u_[kMost], v_[kMost];
};

/// The roots of the rays `open`, found in the leaf's quarters and in those of each that leaves something open: 16 at
/// once, of any of the rays. Returns the rays that may have more roots than those listed, or one that is_unsure(search,
/// root): where too many parts stay open, 16 that are not split stand for the leaf.
template <class IsUnsure>
FN_LARGE uint list_roots(const NewtonPatch& newton, const LeafPlane& leaf, const PacketRays& rays, uint open,
                         IsUnsure is_unsure, RootLists& roots, uint64_t& steps)
{
    WaitingParts parts;
    const auto share_of = [](uint depth) { return 1.0f / float(1u << depth); };
    const auto push = [&](uint ray, float u, float v, uint depth) {
        const scalar share = share_of(depth + 1);
        return parts.push_quarters(ray, u, v, depth, scalar2(leaf.half_side.x * share, leaf.half_side.y * share));
    };
    uint doubtful = 0, spent = 0;
    int left[kLanes];
    for (uint bits = open; bits != 0; bits &= bits - 1) {
        const uint ray = uint(__builtin_ctz(bits));
        left[ray] = kMostParts - 4;
        push(ray, leaf.middle.x, leaf.middle.y, 0);
    }
    WaitingParts::Taken part;
    while (parts.any()) {
        parts.take(part);
        alignas(64) float shares[kLanes];
        uint whole = 0; // parts that are not split
        for (int i = 0; i < kLanes; ++i) {
            shares[i] = share_of(part.depth[i]);
            whole |= uint(part.depth[i] == kDeepestSplit || (spent >> part.ray[i] & 1) != 0) << i;
        }
        const mask taken = lanes_of(part.lanes);
        const integer ray = load(part.ray);
        const auto of_ray = [&](int i) HWY_ATTR { return gather(rays.values[i], ray); };
        const real3 origin(of_ray(0), of_ray(1), of_ray(2)), direction(of_ray(3), of_ray(4), of_ray(5));
        const RayPlanes planes{real3(of_ray(6), of_ray(7), of_ray(8)), of_ray(9),
                               real3(of_ray(10), of_ray(11), of_ray(12)), of_ray(13)};
        Rectangle rectangle;
        rectangle.share = load(shares);
        rectangle.half_side = real2(leaf.half_side.x * rectangle.share, leaf.half_side.y * rectangle.share);
        rectangle.middle = real2(load(part.u), load(part.v));
        const SurfacePoint s = newton.at(rectangle.middle);
        const SeenPoint seen = seen_point(s, planes);
        steps += uint64_t(__builtin_popcount(part.lanes));
        rectangle.bend = bend_around(leaf, planes, seen, rectangle.share);
        mask unknown = taken && !passes_by(leaf, planes, s, seen, rectangle.share, newton.rounding);
        const mask at_end = lanes_of(whole) || splits_in_vain(leaf, s, rectangle.bend, rectangle.share);
        rectangle.last = at_end;
        const mask searched = unknown && (is_searched(rectangle.bend) || at_end);
        mask doubt(false);
        if (any_lane(searched)) {
            const Search search = find_root(newton, leaf, rectangle, planes, s, seen, searched, steps);
            unknown = unknown && !search.complete;
            const Root root = end_of(newton, search, origin, direction);
            doubt = searched && (search.blurred || is_unsure(search, root));
            doubtful |= list(root, part.ray, roots);
        }
        doubt = doubt || (unknown && at_end);
        for (uint bits = lane_bits(doubt); bits != 0; bits &= bits - 1)
            doubtful |= 1u << part.ray[__builtin_ctz(bits)];
        for (uint bits = lane_bits(unknown && !at_end); bits != 0; bits &= bits - 1) {
            const int i = __builtin_ctz(bits);
            const uint one = part.ray[i];
            left[one] -= 4;
            if ((spent >> one & 1) != 0 || (left[one] >= 0 && push(one, part.u[i], part.v[i], part.depth[i])))
                continue;
            spent |= 1u << one;
            doubtful |= 1u << one;
            for (int quarter = 0; quarter < 4; ++quarter)
                push(one, leaf.middle.x + (quarter & 1 ? 0.5f : -0.5f) * leaf.half_side.x,
                     leaf.middle.y + (quarter & 2 ? 0.5f : -0.5f) * leaf.half_side.y, 1);
        }
    }
    return doubtful;
}

SHARED_CLOSE
#endif
