// Packets of 16 rays that begin anywhere: those of shadows, occlusion and mirrors. They walk the trees from the top,
// each packet by itself, and meet leaves as the eye's rays do. Included once per target by cpu_packet.h.
#if defined(TRIMRAY_CPU_FREE_RAYS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_FREE_RAYS_H
#undef TRIMRAY_CPU_FREE_RAYS_H
#else
#define TRIMRAY_CPU_FREE_RAYS_H
#endif

#include "runtime/cpu_lanes.h"
#include "runtime/cpu_leaf_hits.h"
#include "runtime/cpu_write.h"
#include "shaders/light_layout.h"
#include "shaders/section_layout.h"
#include "shaders/shared/bvh_node.h"
#include "shaders/shared/leaf_box.h"
#include "shaders/shared/light.h"
#include "shaders/shared/section.h"

#include <array>
#include <utility>

SHARED_OPEN

/// 16 rays: origin + s direction, 0 < s < reach; the top tree's units, the direction unit.
struct FreePacket {
    real3 origin;
    real3 direction;
    real reach;
    mask alive;
    float footprint; // how well hits must be known: a pixel's width where the rays come from
};

struct FreeLeaf {
    uint leaf, instance;
};

/// The surfaces that a packet's rays cross, unordered.
struct Crossings {
    float per_mm; // the top tree's units
    float at[kLanes][kMostCrossings];
    uint what[kLanes][kMostCrossings]; // instance << 1 | kCrossingLeaves
    uint leaf[kLanes][kMostCrossings];
    uint count[kLanes];
    uint lost; // lanes that crossed more than are kept
};

/// Two hits of one instance that both enter or both leave within `apart` are one: faces overlap there.
[[maybe_unused]] static HWY_ATTR HWY_NOINLINE void add_crossings(Crossings& crossings, mask taken, real at, real apart,
                                                                 mask leaves, const FreeLeaf& leaf)
{
    alignas(64) float s[kLanes], slack[kLanes];
    store(at, s);
    store(apart, slack);
    const uint leaving = lane_bits(leaves);
    for (uint left = lane_bits(taken); left != 0; left &= left - 1) {
        const int lane = __builtin_ctz(left);
        const uint what = leaf.instance << 1 | (leaving >> lane & 1u);
        uint& count = crossings.count[lane];
        bool known = false;
        for (uint i = 0; i < count && !known; ++i)
            known = crossings.what[lane][i] == what && std::abs(crossings.at[lane][i] - s[lane]) <= slack[lane];
        if (known)
            continue;
        if (count == kMostCrossings) {
            crossings.lost |= 1u << lane;
            continue;
        }
        crossings.at[lane][count] = s[lane];
        crossings.what[lane][count] = what;
        crossings.leaf[lane][count] = leaf.leaf;
        ++count;
    }
}

/// What a packet's rays are for a patch: `at` is s.
struct FreeRays {
    static constexpr bool kCertifies = false;
    static constexpr bool kCollects = true;
    using Leaf = FreeLeaf;
    mask on;
    real from; // s at t = 0
    real rounding;
    float pixel;          // patch units
    Crossings* crossings; // takes all hits; null: the nearest is looked for

    real base() const { return from; }
    float per_t() const { return 1; }
    real slack() const { return rounding; }
    const mask& alive() const { return on; }
    HWY_ATTR mask is_ahead(real at) const { return at > 0.0f; }
    float footprint() const { return pixel; }
    HWY_ATTR real footprint(real) const { return real(pixel); }

    static KeptMiddle kept_middle(BlockScratch& scratch, const Leaf& leaf)
    {
        FreeMiddles& kept = scratch.free_middles;
        const size_t slot = leaf.leaf % FreeMiddles::kCount;
        return {kept.middle[slot], std::exchange(kept.leaf[slot], leaf.leaf) == leaf.leaf};
    }

    HWY_ATTR HWY_INLINE bool collect(mask taken, real at, mask leaves, const Leaf& leaf, float tolerance_mm) const
    {
        if (!crossings)
            return false;
        add_crossings(*crossings, taken, at, rounding * 4.0f + tolerance_mm * crossings->per_mm, leaves, leaf);
        return true;
    }
};

class FreeWalk {
public:
    FreeWalk(const BlockJob& job, BlockScratch& scratch, const FetchSource& source, WorkCounts& work)
        : job_(job), work_(work), image_(job.scene.image), leaf_hits_(job, scratch, source, work)
    {
        FreeMiddles& kept = scratch.free_middles;
        kept.middle.resize(FreeMiddles::kCount);
        kept.leaf.resize(FreeMiddles::kCount, ~0u);
    }

    /// The nearest hits; hit.best is s. With `any` a ray ends at the first hit that is found. With crossings all hits
    /// go there, rims' backs too, and none is the nearest.
    HWY_ATTR HWY_NOINLINE PacketHit trace(const FreePacket& rays, bool any, Crossings* crossings = nullptr)
    {
        crossings_ = crossings;
        any_ = any;
        leaf_hits_.rims_cut = crossings == nullptr;
        PacketHit hit;
        hit.best = select(rays.alive, rays.reach, real(-kHuge));
        hit.leaf = integer(~0u);
        hit.instance = integer(~0u);
        hit.uv_face = real2(real(0.0f), real(0.0f));
        hit.normal = real3(real(0.0f), real(0.0f), real(1.0f));
        hit.back = mask(false);
        hit.doubt = real(kHuge);
        work_.free_rays += lane_count(rays.alive);
        recent_.clear();
        const auto enter = [&](uint instance) HWY_ATTR { meet_instance(rays, instance, hit); };
        if (job_.view.alone)
            enter(*job_.view.alone);
        else if (const auto& top_nodes = job_.view.placed.top_nodes; !top_nodes.empty())
            walk(top_nodes.data(), tree_packet(rays.origin, rays.direction), hit, enter);
        return hit;
    }

private:
    static constexpr int kMostWaiting = 3 * int(kMaxBvhDepth) + 2; // a visit takes one and leaves up to four

    /// A packet in the units of one tree.
    struct TreePacket {
        real3 origin, inverse;
    };
    static HWY_ATTR TreePacket tree_packet(real3 origin, real3 direction)
    {
        return {origin, real3(safe_inverse(direction.x), safe_inverse(direction.y), safe_inverse(direction.z))};
    }

    HWY_ATTR void meet_instance(const FreePacket& rays, uint instance, PacketHit& hit)
    {
        const PartRecord& part = image_.parts[image_.instances[instance].part];
        if (part.node_count == 0)
            return;
        const WorldToPart& to = job_.to_part[instance];
        const scalar3 row_x(to.row_x[0], to.row_x[1], to.row_x[2]), row_y(to.row_y[0], to.row_y[1], to.row_y[2]),
            row_z(to.row_z[0], to.row_z[1], to.row_z[2]);
        const real3 origin =
            project(row_x, row_y, row_z, rays.origin) + scalar3(to.offset[0], to.offset[1], to.offset[2]);
        const real3 direction = project(row_x, row_y, row_z, rays.direction);
        walk(image_.part_nodes.data() + part.first_node, tree_packet(origin, direction), hit, [&](uint leaf) HWY_ATTR {
            meet_leaf(rays, part.first_leaf + leaf, instance, origin, direction, to.scale * rays.footprint, hit);
            if (any_)
                hit.best = select(hit.leaf != integer(~0u), real(-kHuge), hit.best);
        });
    }

    HWY_ATTR void meet_leaf(const FreePacket& rays, uint leaf_id, uint instance, real3 part_origin,
                            real3 part_direction, float part_footprint, PacketHit& hit)
    {
        constexpr float kBoxMargin = 1e-6f; // patch units: as for the eye's rays
        const LeafRecord& leaf = image_.leaves[leaf_id];
        const PatchRecord& patch = image_.patches[leaf.patch];
        if (any_ && job_.materials && job_.materials->of(patch.face, instance).opacity < 1)
            return; // light comes through
        const scalar3 x(patch.axis_x[0], patch.axis_x[1], patch.axis_x[2]);
        const scalar3 y(patch.axis_y[0], patch.axis_y[1], patch.axis_y[2]);
        const scalar3 z(patch.axis_z[0], patch.axis_z[1], patch.axis_z[2]);
        const scalar3 hi(patch.origin_hi[0], patch.origin_hi[1], patch.origin_hi[2]);
        const scalar3 lo(patch.origin_lo[0], patch.origin_lo[1], patch.origin_lo[2]);
        const float per_scale = 1 / patch.scale;
        const real3 far_origin = project(x, y, z, (part_origin - hi) - lo) * real(per_scale);
        const real3 direction = project(x, y, z, part_direction) * real(per_scale);
        // t = 0 where the ray is nearest to the patch's middle, so that what is large has cancelled
        const real square = dot(direction, direction);
        const real from = -dot(far_origin, direction) / square;
        const real3 origin = far_origin + direction * from;
        const real rounding = free_rounding(length(origin), sqrt(square), from, length(rays.origin));
        const BoxHit in_box = leaf_box_hit(decode_leaf(leaf), origin, direction, kBoxMargin);
        const mask alive =
            in_box.hit && hit.best > -kHuge && from + in_box.far > 0.0f && from + in_box.near < hit.best + rounding;
        if (!any_lane(alive) || (job_.scene.shared_patch[leaf.patch] && recent_.has(instance, leaf.patch)))
            return;
        work_.free_leaf_visits += lane_count(alive);
        const FreeRays free{rays.alive && hit.best > -kHuge, from, rounding, part_footprint * per_scale, crossings_};
        leaf_hits_.intersect(free, {leaf_id, instance}, patch, origin, direction, hit);
    }

    struct Waiting {
        uint item;
        float near; // least s of the rays that meet it
    };

    /// Calls meet(leaf) for the leaves of a tree whose boxes a ray meets before its hit, about the nearest first.
    template <class Meet>
    HWY_ATTR void walk(const BvhNode* nodes, const TreePacket& packet, const PacketHit& hit, Meet meet)
    {
        std::array<Waiting, kMostWaiting> stack;
        stack[0] = {0, 0};
        for (int count = 1; count > 0;) {
            const Waiting next = stack[--count];
            if (next.near > largest_lane(hit.best))
                continue;
            if ((next.item & kBvhLeaf) != 0) {
                meet(next.item & ~kBvhLeaf);
                continue;
            }
            const BvhNode& node = nodes[next.item];
            ++work_.node_visits;
            const NodeRay ray = node_ray(node, packet.origin, packet.inverse);
            const int first = count;
            for (int child = 0; child < 4; ++child) {
                if (node.child[child] == kBvhEmpty)
                    continue;
                const ChildHit in_box = child_hit(node, ray, child, real(0.0f), hit.best);
                const mask meets = in_box.hit && hit.best > -kHuge;
                if (!any_lane(meets))
                    continue;
                const float near = -largest_lane(select(meets, -in_box.near, real(-kHuge)));
                int at = count++;
                for (; at > first && stack[at - 1].near < near; --at)
                    stack[at] = stack[at - 1];
                stack[at] = {node.child[child], near};
            }
        }
    }

    const BlockJob& job_;
    WorkCounts& work_;
    const PackImage& image_;
    LeafHits<FreeRays> leaf_hits_;
    Crossings* crossings_ = nullptr;
    bool any_ = false;
    RecentPatches recent_;
};

/// Hits of rays from anywhere, within what section planes leave.
class FreeTracer {
public:
    FreeTracer(const BlockJob& job, BlockScratch& scratch, const FetchSource& source, WorkCounts& work)
        : section_(job.section), walk_(job, scratch, source, work)
    {
    }

    /// The nearest hits; hit.best is s.
    HWY_ATTR PacketHit closest(const FreePacket& rays) { return trace(rays, false); }

    /// The rays that anything stops.
    HWY_ATTR mask stopped(const FreePacket& rays) { return rays.alive && trace(rays, true).leaf != integer(~0u); }

private:
    HWY_ATTR PacketHit trace(FreePacket rays, bool any)
    {
        if (section_)
            rays.reach = cut_free_ray(*section_, rays.origin, rays.direction, rays.reach);
        return walk_.trace(rays, any);
    }

    /// Where a ray that begins in what is left leaves it, if that is before `reach`.
    static HWY_ATTR real cut_free_ray(const SectionView& section, real3 origin, real3 direction, real reach)
    {
        for (uint i = 0; i < section.count; ++i) {
            const SectionPlaneView& plane = section.planes[i];
            const scalar3 normal(plane.normal[0], plane.normal[1], plane.normal[2]);
            reach = cut_reach(dot(real3(normal), origin) - plane.offset, dot(real3(normal), direction), reach);
        }
        return reach;
    }

    const SectionView* section_;
    FreeWalk walk_;
};

SHARED_CLOSE
#endif
