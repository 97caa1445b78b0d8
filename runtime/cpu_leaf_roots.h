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
#include "runtime/patch_normal.h"
#include "shaders/shared/leaf_proof.h"

#include <algorithm>
#include <cassert>
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
    scalar2 slack;   // patch_slack
    bool rational;

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
    real2 per_side; // 1 / half_side
    real share;     // of the leaf's size
    RayBend bend;   // around its middle
    mask last;      // it will not be split
};

/// Newton's iteration in a rectangle, by lane
struct Search {
    mask settled;  // ended at a root
    mask exact;    // its last step is proved to end within rounding
    mask complete; // proved: the rectangle holds no root but this one, and none if it has not settled
    mask blurred;  // rounding decides whether the root is the patch's
    SurfacePoint s;
    NewtonStep next;
    real2 uv;
    real2 blur; // root_blur there
};

/// From the rectangle's middle, where the surface is `s`, in the lanes `moving`. Counts its `steps`.
FN_LARGE Search find_root(const NewtonPatch& newton, const LeafPlane& leaf, const Rectangle& rectangle,
                          const RayPlanes& planes, const SurfacePoint& s, SeenPoint seen, mask moving, uint64_t& steps)
{
    const real2 middle = rectangle.middle, half_side = rectangle.half_side, per_side = rectangle.per_side;
    Search search; // not zeroed: it is large
    search.settled = search.exact = mask(false);
    search.s = s;
    real2& uv = search.uv = middle;
    RootBox where{middle - half_side, middle + half_side};
    mask none(false), near(false);
    const mask straight = holds_one(rectangle.bend, real(1.0f));
    // a lane that has settled stays where it is, so that the last round's point is every settled lane's
    for (int step = 0;; ++step) {
        const NewtonStep next = newton_step(seen, uv);
        const real2 moved = next.uv - uv;
        const real off = farther(uv - middle, per_side);
        const real turn = rectangle.bend.bend * farther(moved, per_side), left = bend_left(rectangle.bend, off);
        const mask little = turns_little(turn, left);
        const mask exact =
            newton_exact(leaf, search.s, next, moved, turn, left, little, newton.rounding, newton.enough);
        const mask found = moving && (exact || newton_settled(next, little, near, newton.rounding));
        search.exact = search.exact || (found && exact);
        search.settled = search.settled || found;
        moving = moving && !found;
        near = next.residual <= newton.rounding + next.blur;
        // a step that ends in the rectangle leaves a root there
        const mask beyond = moving && !next.singular && farther(next.uv - middle, per_side) > 1.0f;
        if (any_lane(beyond)) {
            real bend = bend_from(rectangle.bend, off);
            if (any_lane(beyond && !straight))
                bend = select(straight, bend, bend_around(leaf, planes, seen, rectangle.share).bend);
            const RootBox less = narrowed(where, leaf, seen, uv, next.uv, bend, per_side, newton.rounding);
            where.lo = select(beyond, less.lo, where.lo);
            where.hi = select(beyond, less.hi, where.hi);
            const mask empty = beyond && is_empty(where);
            none = none || empty;
            moving = moving && !empty;
        }
        moving = moving && (straight || rectangle.last || mask(step < kGrazingSteps));
        if (!any_lane(moving) || step == kNewtonSteps) {
            search.next = next;
            search.blur = root_blur(seen, newton.rounding);
            // one root at most in a rectangle as large as to hold it
            search.complete = none || (search.settled && holds_one(rectangle.bend, max(off, real(1.0f))));
            break;
        }
        steps += lane_count(moving);
        const real2 to =
            real2(kept_near(next.uv.x, middle.x, half_side.x), kept_near(next.uv.y, middle.y, half_side.y));
        const mask stuck = newton_stuck(next, uv, to);
        uv = select(moving, to, uv);
        moving = moving && !stuck;
        search.s = newton.at(uv);
        seen = seen_point(search.s, planes);
    }
    search.blurred = search.settled && is_blurred(search.uv, search.blur);
    const mask open = search.settled && !search.complete;
    if (any_lane(open)) {
        const RayBend around = bend_around(leaf, planes, seen, rectangle.share);
        search.complete = search.complete || (open && is_only_root(where, search.uv, around, per_side));
    }
    return search;
}

struct Root {
    mask found;    // it lies on the patch
    mask doubtful; // or may not
    real2 uv;
    real t;
    real3 normal;
};

/// S_u x S_v at uv, where the patch's point is s, for the lanes `asked`; beyond a side the one at the side, and at
/// a pole or along a degenerate side the one a little way inside.
FN_LARGE real3 patch_normal(const NewtonPatch& newton, SurfacePoint s, real2 uv, mask asked)
{
    return bezier_normal([&](real2 at) HWY_ATTR { return newton.at(at); }, s, uv, asked);
}

/// What the search ended at; accepted anywhere on the patch, so that leaves leave no gaps.
FN_LARGE Root end_of(const NewtonPatch& newton, const Search& search, real3 origin, real3 direction)
{
    Root end;
    const NewtonRoot root = newton_root(search.s, search.next, search.uv, search.exact, origin, direction);
    const real2 overlap = patch_overlap(search.blur, newton.slack);
    end.uv = root.uv;
    end.t = root.t;
    end.found =
        search.settled && abs(root.uv.x - 0.5f) <= 0.5f + overlap.x && abs(root.uv.y - 0.5f) <= 0.5f + overlap.y;
    // where weights may not stay positive beyond a side, it is not certain that the patch goes on
    end.doubtful = search.blurred || (mask(newton.rational) && end.found && is_beyond_sides(root.uv));
    end.normal = patch_normal(newton, search.s, search.uv, end.found);
    return end;
}

/// A packet's rays in a patch's space.
struct PacketRays {
    real3 origin;
    real3 direction;
    RayPlanes planes;
};

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

/// Parts of a leaf, one a lane, each for a ray of the packet.
struct Parts {
    mask lanes;
    integer ray;
    integer depth; // how often the leaf was split
    real2 middle;
};

struct PartsInMemory {
    alignas(64) uint ray[kLanes], depth[kLanes];
    alignas(64) float u[kLanes], v[kLanes];
};

FN PartsInMemory in_memory(const Parts& parts)
{
    PartsInMemory to;
    store(parts.ray, to.ray);
    store(parts.depth, to.depth);
    store(parts.middle.x, to.u);
    store(parts.middle.y, to.v);
    return to;
}

/// Parts that wait.
class WaitingParts {
public:
    int count() const { return count_; }

    void push(uint ray, uint depth, float u, float v)
    {
        assert(count_ < kMost && "a ray has kMostParts, and 16 that are not split");
        ray_[count_] = ray;
        depth_[count_] = depth;
        u_[count_] = u;
        v_[count_] = v;
        ++count_;
    }

    /// Those of `lanes`.
    HWY_ATTR void push(const Parts& parts, mask lanes)
    {
        const PartsInMemory from = in_memory(parts);
        for (uint bits = lane_bits(lanes); bits != 0; bits &= bits - 1) {
            const int i = __builtin_ctz(bits);
            push(from.ray[i], from.depth[i], from.u[i], from.v[i]);
        }
    }

    /// The last ones; the lanes without one get the bits of another.
    HWY_ATTR Parts take()
    {
        const int n = std::min(count_, int(kLanes));
        count_ -= n;
        for (int i = count_ + n; i < count_ + kLanes; ++i) {
            ray_[i] = ray_[count_];
            depth_[i] = depth_[count_];
            u_[i] = u_[count_];
            v_[i] = v_[count_];
        }
        return {lanes_of((1u << n) - 1u), load(ray_ + count_), load(depth_ + count_),
                real2(load(u_ + count_), load(v_ + count_))};
    }

private:
    static constexpr int kMost = kLanes * (kMostParts + 16);
    int count_ = 0;
    uint ray_[kMost + kLanes], depth_[kMost + kLanes];
    float u_[kMost + kLanes], v_[kMost + kLanes];
};

/// Splits the leaf for the rays of a packet, as far as each may.
class LeafSplitter {
public:
    LeafSplitter(const LeafPlane& leaf, WaitingParts& waiting) : leaf_(leaf), waiting_(waiting)
    {
        std::fill_n(left_, kLanes, kMostParts);
    }

    /// Lanes of parts whose rays have too many.
    HWY_ATTR mask is_spent(const Parts& parts) const
    {
        return ((integer(spent_) >> parts.ray) & integer(1u)) == integer(1u);
    }
    uint spent() const { return spent_; } // rays

    /// Puts the quarters that rays do not pass by to those waiting, of the parts `lanes` with these half sides.
    HWY_ATTR void split(const Parts& parts, const Sight& sight, real2 half_side, mask lanes)
    {
        uint met[4], any = 0;
        for (int quarter = 0; quarter < 4; ++quarter)
            any |= met[quarter] = lane_bits(lanes && !passes_quarter(sight, quarter));
        if (any == 0)
            return;
        const PartsInMemory of = in_memory(parts);
        alignas(64) float half_u[kLanes], half_v[kLanes];
        store(0.5f * half_side.x, half_u);
        store(0.5f * half_side.y, half_v);
        for (; any != 0; any &= any - 1) {
            const int i = __builtin_ctz(any);
            const uint ray = of.ray[i];
            if ((spent_ >> ray & 1) != 0)
                continue;
            for (const uint by : met)
                left_[ray] -= int(by >> i & 1);
            if (left_[ray] < 0) {
                push_sixteenths(ray);
                continue;
            }
            for (int quarter = 0; quarter < 4; ++quarter)
                if ((met[quarter] >> i & 1) != 0)
                    waiting_.push(ray, of.depth[i] + 1, of.u[i] + (quarter & 1 ? half_u[i] : -half_u[i]),
                                  of.v[i] + (quarter & 2 ? half_v[i] : -half_v[i]));
        }
    }

private:
    void push_sixteenths(uint ray)
    {
        spent_ |= 1u << ray;
        for (int i = 0; i < 16; ++i)
            waiting_.push(ray, 2, leaf_.middle.x + leaf_.half_side.x * (0.5f * float(i & 3) - 0.75f),
                          leaf_.middle.y + leaf_.half_side.y * (0.5f * float(i >> 2) - 0.75f));
    }

    const LeafPlane& leaf_;
    WaitingParts& waiting_;
    uint spent_ = 0;
    int left_[kLanes];
};

/// The roots of the rays `open`, found in the leaf's quarters and in those of each that leaves something open: 16 at
/// once, of any of the rays, and those searched apart from those that rays pass by. `sight`: of the whole leaf. Returns
/// the rays that may have more roots than those listed, or one that is_unsure(search, root, direction): where too many
/// parts stay open, 16 that are not split stand for the leaf.
template <class IsUnsure>
FN_LARGE uint list_roots(const NewtonPatch& newton, const LeafPlane& leaf, const PacketRays& rays, const Sight& sight,
                         mask open, IsUnsure is_unsure, RootLists& roots, uint64_t& steps)
{
    alignas(64) constexpr float kShares[kLanes] = {1.0f,      1.0f / 2,  1.0f / 4, 1.0f / 8,
                                                   1.0f / 16, 1.0f / 32, 1.0f / 64}; // by depth
    static_assert(kDeepestSplit == 6);
    const real shares = load(kShares);
    const scalar2 per_side(1.0f / leaf.half_side.x, 1.0f / leaf.half_side.y);
    WaitingParts untested, unsearched;
    LeafSplitter splitter(leaf, untested);
    uint doubtful = 0;
    splitter.split({open, lane_numbers(), integer(0u), leaf.middle}, sight, leaf.half_side, open);
    while (untested.count() > 0 || unsearched.count() > 0) {
        const bool search = untested.count() == 0 || unsearched.count() >= kLanes;
        const Parts part = search ? unsearched.take() : untested.take();
        const RayPlanes planes{lanes_from(rays.planes.n1, part.ray), lanes_from(rays.planes.d1, part.ray),
                               lanes_from(rays.planes.n2, part.ray), lanes_from(rays.planes.d2, part.ray)};
        Rectangle rectangle;
        rectangle.middle = part.middle;
        rectangle.share = lanes_from(shares, part.depth);
        rectangle.half_side = real2(leaf.half_side.x * rectangle.share, leaf.half_side.y * rectangle.share);
        const real per_share = 1.0f / rectangle.share;
        rectangle.per_side = real2(per_side.x * per_share, per_side.y * per_share);
        const SurfacePoint s = newton.at(rectangle.middle);
        const SeenPoint seen = seen_point(s, planes);
        rectangle.bend = bend_around(leaf, planes, seen, rectangle.share);
        rectangle.last = part.depth == integer(uint(kDeepestSplit)) || splitter.is_spent(part) ||
                         splits_in_vain(leaf, s, rectangle.bend, rectangle.share);
        const auto split = [&](const Sight& of_part, mask lanes)
                               HWY_ATTR { splitter.split(part, of_part, rectangle.half_side, lanes); };
        mask unknown = part.lanes;
        if (!search) {
            steps += lane_count(part.lanes);
            const Sight of_part = sight_of(leaf, planes, s, seen, rectangle.share, newton.rounding);
            unknown = unknown && !passes_by(of_part);
            const mask searched = unknown && (is_searched(rectangle.bend) || rectangle.last);
            unsearched.push(part, searched);
            split(of_part, unknown && !searched);
        } else {
            const Search found = find_root(newton, leaf, rectangle, planes, s, seen, unknown, steps);
            unknown = unknown && !found.complete;
            const real3 origin = lanes_from(rays.origin, part.ray), direction = lanes_from(rays.direction, part.ray);
            alignas(64) uint ray[kLanes];
            store(part.ray, ray);
            const Root root = end_of(newton, found, origin, direction);
            doubtful |= list(root, ray, roots);
            const mask unsure = part.lanes && (root.doubtful || is_unsure(found, root, direction));
            for (uint bits = lane_bits(unsure || (unknown && rectangle.last)); bits != 0; bits &= bits - 1)
                doubtful |= 1u << ray[__builtin_ctz(bits)];
            unknown = unknown && !rectangle.last;
            if (any_lane(unknown))
                split(sight_of(leaf, planes, s, seen, rectangle.share, newton.rounding), unknown);
        }
    }
    return doubtful | splitter.spent();
}

SHARED_CLOSE
#endif
