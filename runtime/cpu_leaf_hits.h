// A packet of 16 rays against one leaf: its roots, the face's domain and its trims. Included once per target by
// cpu_packet.h.
#if defined(TRIMRAY_CPU_LEAF_HITS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_LEAF_HITS_H
#undef TRIMRAY_CPU_LEAF_HITS_H
#else
#define TRIMRAY_CPU_LEAF_HITS_H
#endif

#include "runtime/cpu_evaluate.h"
#include "runtime/cpu_fetch.h"
#include "runtime/cpu_lanes.h"
#include "runtime/cpu_leaf_roots.h"
#include "runtime/cpu_trim.h"
#include "runtime/cpu_trim_reference.h"
#include "runtime/cpu_write.h"
#include "runtime/face_uv.h"
#include "runtime/plain_newton.h"
#include "shaders/shared/leaf_start.h"
#include "shaders/shared/quadric.h"
#include "shaders/shared/rim.h"
#include "shaders/shared/torus.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>
#include <utility>

SHARED_OPEN

/// Where a leaf's plane is kept, and whether it is there.
struct KeptMiddle {
    LeafMiddle& values;
    bool known;
};

/// The last native patches that a packet was tested against: one with several leaves need not be met again.
class RecentPatches {
public:
    void clear() { count_ = 0; }
    /// Whether the patch is among them; if not, it is from now on.
    bool has(uint instance, uint patch)
    {
        const uint64_t key = uint64_t(instance) << 32 | patch;
        for (uint i = 0; i < std::min(count_, kKept); ++i)
            if (keys_[i] == key)
                return true;
        keys_[count_++ % kKept] = key;
        return false;
    }

private:
    static constexpr uint kKept = 8;
    uint64_t keys_[kKept];
    uint count_ = 0;
};

/// The pixels' rays from the eye, as one patch has them: `at` is tau - tau_ref in mm.
struct EyeRays {
    static constexpr bool kCertifies = true; // what stays open of them is told in PacketHit::doubt
    static constexpr bool kCollects = false;
    using Leaf = Candidate; // one of the scratch's
    const PatchView& view;
    const Packet& packet;

    float base() const { return view.base_mm; } // `at` of t is base + per_t t
    float per_t() const { return view.mm_per_t; }
    float slack() const { return view.slack_mm; } // rounding of `at`
    const mask& alive() const { return packet.alive; }
    HWY_ATTR mask is_ahead(real at) const { return at > packet.begin; }
    /// A pixel's width where the patch is, and at t; patch units.
    float footprint() const { return view.pixel * std::abs(view.tau); }
    HWY_ATTR real footprint(real t) const { return view.pixel * (view.tau + t); }

    /// Where the leaf's plane is kept: it counts as known from now on.
    static KeptMiddle kept_middle(BlockScratch& scratch, const Leaf& leaf)
    {
        const size_t candidate = size_t(&leaf - scratch.candidates.data());
        return {scratch.leaf_middles[candidate], std::exchange(scratch.has_middle[candidate], uint8_t{1}) != 0};
    }
};

/// Rays: what EyeRays has, and where kCollects is true, collect: where that takes the hits none is the nearest.
template <class Rays>
class LeafHits {
public:
    using Leaf = typename Rays::Leaf;

    LeafHits(const BlockJob& job, BlockScratch& scratch, const FetchSource& source, WorkCounts& work)
        : job_(job), scratch_(scratch), source_(source), work_(work), image_(job.scene.image)
    {
    }

    /// Offers the hits of the rays with one leaf: a ray's point at t is origin + t direction, patch space. True if a
    /// ray's nearest hit changed. `patch`: the leaf's.
    HWY_ATTR HWY_INLINE bool intersect(const Rays& rays, const Leaf& at, const PatchRecord& patch, const real3& origin,
                                       const real3& direction, PacketHit& hit)
    {
        const FaceRecord& face = image_.faces[patch.face];
        const bool rim = (face.flags & kFaceRims) != 0 && job_.view.instances[at.instance].outside;
        Target target{rays, at, patch, face, rim, direction, false};
        const scalar r = patch.param[0], second = patch.param[1];
        switch (patch.shape & 0xffu) {
        case kKindPlane: {
            const RootPair roots = plane_roots(origin, direction);
            const real t = roots.t0;
            doubt_touch(target, roots.touch, hit);
            const mask near = in_range(target, t, hit);
            if (any_lane(near))
                offer(target, near, t, plane_uv(origin + direction * t), plane_normal(), hit);
            break;
        }
        case kKindCylinder:
            offer_pair(
                target, cylinder_roots(r, origin, direction), origin, direction,
                [](real3 p) HWY_ATTR { return cylinder_uv(p); }, [](real3 p) HWY_ATTR { return cylinder_normal(p); },
                hit);
            break;
        case kKindCone:
            offer_pair(
                target, cone_roots(r, second, origin, direction), origin, direction,
                [=](real3 p) HWY_ATTR { return cone_uv(r, second, p); },
                [=](real3 p) HWY_ATTR { return cone_normal(r, second, p); }, hit);
            break;
        case kKindSphere:
            offer_pair(
                target, sphere_roots(r, origin, direction), origin, direction,
                [](real3 p) HWY_ATTR { return sphere_uv(p); }, [](real3 p) HWY_ATTR { return sphere_normal(p); }, hit);
            break;
        case kKindTorus:
            intersect_torus(target, origin, direction, hit);
            break;
        default:
            intersect_bezier(target, origin, direction, hit);
            break;
        }
        return target.changed;
    }

    bool rims_cut = false; // rims are no surface

private:
    struct Target {
        // what is as small as its address saves a way through memory by every leaf
        std::conditional_t<sizeof(Rays) <= 2 * sizeof(void*), const Rays, const Rays&> rays;
        const Leaf& at;
        const PatchRecord& patch;
        const FaceRecord& face;
        bool rim; // the face has one, and the eye sees it from outside
        const real3& direction;
        bool changed;
    };

    /// In front of the eye and not behind the nearest hit.
    HWY_ATTR mask in_range(const Target& target, real t, const PacketHit& hit) const
    {
        const real at = target.rays.base() + target.rays.per_t() * t;
        return target.rays.is_ahead(at) && at < hit.best + target.rays.slack() && t < kHuge;
    }

    /// Where rounding decides whether a ray meets a surface, what lies behind is not certain.
    HWY_ATTR HWY_INLINE void doubt_touch(const Target& target, real touch, PacketHit& hit) const
    {
        if (!any_lane(touch < kHuge))
            return;
        const real from = target.rays.base() - target.rays.slack() + target.rays.per_t() * touch;
        const mask ahead = touch < kHuge && (target.rays.is_ahead(from) || touch <= -kHuge);
        hit.doubt = select(ahead, min(from, hit.doubt), hit.doubt);
    }

    template <class Uv, class Normal>
    HWY_ATTR HWY_INLINE void offer_pair(Target& target, RootPair roots, real3 origin, real3 direction, Uv uv,
                                        Normal normal, PacketHit& hit)
    {
        doubt_touch(target, roots.touch, hit);
        for (const real& t : {roots.t0, roots.t1}) {
            const mask near = in_range(target, t, hit);
            if (!any_lane(near))
                continue;
            const real3 p = origin + direction * select(near, t, real(0.0f));
            offer(target, near, t, uv(p), normal(p), hit);
        }
    }

    HWY_ATTR HWY_NOINLINE void intersect_torus(Target& target, real3 origin, real3 direction, PacketHit& hit)
    {
        const scalar R = target.patch.param[0], r = target.patch.param[1];
        const TorusRoots roots = torus_roots(R, r, origin, direction);
        doubt_touch(target, roots.touch, hit);
        for (const real& t : {roots.t0, roots.t1, roots.t2, roots.t3}) {
            const mask near = in_range(target, t, hit);
            if (!any_lane(near))
                continue;
            const real3 p = origin + direction * select(near, t, real(0.0f));
            offer(target, near, t, torus_uv(R, r, p), torus_normal(R, r, p), hit);
        }
    }

    /// All roots of the lanes that meet the leaf's box, where its bend allows a proof that they are all.
    HWY_ATTR HWY_NOINLINE void intersect_bezier(Target& target, real3 origin, real3 direction, PacketHit& hit)
    {
        constexpr float kBoxMargin = 1e-6f; // patch units: the ray's rounding
        const LeafBox box = decode_leaf(image_.leaves[target.at.leaf]);
        const BoxHit in_box = leaf_box_hit(box, origin, direction, kBoxMargin);
        const auto base = target.rays.base();
        const float per_t = target.rays.per_t();
        mask moving = in_box.hit && target.rays.alive() &&
                      base + per_t * in_box.near < hit.best + target.rays.slack() &&
                      target.rays.is_ahead(base + per_t * in_box.far);
        if (!any_lane(moving))
            return;
        const NewtonPatch newton = newton_patch(target);
        if (job_.stochastic)
            return intersect_once(target, newton, box, moving, origin, direction, hit);
        const LeafPlane leaf = middle_of(newton, box, target.patch.param, target.at);
        const RayPlanes planes = ray_planes(origin, direction);
        const SurfacePoint middle{real3(leaf.p), real3(leaf.du), real3(leaf.dv)};
        const SeenPoint seen = seen_point(middle, planes);
        const RayBend bend = middle_bend(leaf, seen);
        const mask grazing = !holds_one(bend, real(1.0f));
        if (any_lane(moving && grazing))
            moving =
                moving && !(grazing && passes_by(sight_of(leaf, planes, middle, seen, real(1.0f), newton.rounding)));
        const mask searched = moving && is_searched(bend);
        mask open = moving && !searched, doubtful(false);
        if (any_lane(searched)) {
            const scalar2 per_side(1.0f / leaf.half_side.x, 1.0f / leaf.half_side.y);
            const Rectangle whole{leaf.middle, leaf.half_side, per_side, real(1.0f), bend, mask(false)};
            const Search search = find_root(newton, leaf, whole, planes, middle, seen, searched, work_.newton_steps);
            open = open || (searched && !search.complete);
            const Root root = end_of(newton, search, origin, direction);
            const mask ahead = in_range(target, root.t, hit);
            doubtful = searched && (root.doubtful || is_unsure(target, newton, search, root, direction, ahead));
            const mask near = root.found && ahead;
            if (any_lane(near))
                offer(target, near, root.t, root.uv, root.normal, hit);
        }
        open = open && base + per_t * in_box.near < hit.best + target.rays.slack();
        if (any_lane(open))
            doubtful = doubtful || split(target, newton, leaf, planes, middle, seen, open, origin, direction, hit);
        if (!any_lane(doubtful))
            return;
        // what it found may lie a little before its box, on the next leaf
        const real from = min(base + per_t * in_box.near, hit.best);
        hit.doubt = select(doubtful, min(from, hit.doubt), hit.doubt);
    }

    HWY_ATTR NewtonPatch newton_patch(const Target& target) const
    {
        const PatchRecord& patch = target.patch;
        const int degree_u = int(patch.shape >> 8 & 0xffu), degree_v = int(patch.shape >> 16 & 0xffu);
        return {source_,
                patch.first_control_point,
                degree_u,
                degree_v,
                find_evaluate(patch.shape),
                last_residual(job_.error_px * target.rays.footprint()),
                patch_rounding(degree_u, degree_v),
                patch_slack(scalar2(patch.uv_scale[0], patch.uv_scale[1])),
                (patch.shape & kShapeRational) != 0};
    }

    /// Roots of which rounding decides more than a certificate leaves open: how far they are, or whether the face holds
    /// them. Of the lanes `asked`.
    HWY_ATTR HWY_INLINE mask is_unsure(const Target& target, const NewtonPatch& newton, const Search& search,
                                       const Root& root, real3 direction, mask asked)
    {
        if constexpr (!Rays::kCertifies)
            return mask(false);
        const real footprint = target.rays.footprint(root.t);
        const real off = more_than_hair(footprint, newton.rounding);
        asked = asked && search.settled && off > 0.0f && footprint > 0.0f;
        if (!any_lane(asked))
            return asked;
        const real more = off * (1.0f / newton.rounding);
        const real2 blur(more * search.blur.x, more * search.blur.y);
        const mask there = asked && root.found;
        return (asked && is_beside_side(root.uv, blur, newton.slack)) ||
               (there && is_depth_unsure(search.s, direction, off, footprint)) ||
               is_beside_border(target, root.uv, blur, there);
    }

    /// Lanes of `asked` whose root lies on the other side of a border of the face if it is moved by `blur`.
    HWY_ATTR HWY_NOINLINE mask is_beside_border(const Target& target, real2 uv_patch, real2 blur, mask asked)
    {
        const PatchRecord& patch = target.patch;
        const real2 uv = face_uv(patch, uv_patch);
        const real2 uv_blur(blur.x * std::abs(patch.uv_scale[0]), blur.y * std::abs(patch.uv_scale[1]));
        mask beside = asked && is_beside_side(uv, uv_blur, scalar2(kDomainSlack, kDomainSlack));
        if ((target.face.flags & kFaceNaturalBorder) != 0)
            return beside;
        const mask open = asked && !beside && !lies_clear(source_, target.face, uv, uv_blur, asked);
        if (!any_lane(open))
            return beside;
        // by the cells, where there are some, whatever hits are held against
        const auto inside = [&](real2 at) HWY_ATTR {
            return target.face.grid == 0 ? inside_loops(target, clamp_to_domain(at), open)
                                         : inside_trims(source_, TrimMode::Exact, patch.face, target.face,
                                                        clamp_to_domain(at), open, work_.curve_tests);
        };
        const mask here = inside(uv);
        for (int corner = 0; corner < kCornerCount; ++corner)
            beside = beside || (open && differ(inside(corner_around(uv, uv_blur, corner)), here));
        return beside;
    }

    /// The leaf's plane, evaluated when it is first asked for.
    HWY_ATTR LeafPlane middle_of(const NewtonPatch& newton, const LeafBox& box, const float (&lost)[2], const Leaf& at)
    {
        static_assert(sizeof(LeafPlane) <= sizeof(LeafMiddle));
        const KeptMiddle kept = Rays::kept_middle(scratch_, at);
        LeafPlane leaf;
        if (!kept.known) {
            const SurfacePoint s = newton.at(real2(leaf_middle(box)));
            leaf = leaf_plane(box, first_lane(s.p), first_lane(s.du), first_lane(s.dv),
                              derivative_loss(box, scalar2(lost[0], lost[1]), newton.degree_u, newton.degree_v));
            std::memcpy(&kept.values, &leaf, sizeof leaf);
        }
        std::memcpy(&leaf, &kept.values, sizeof leaf);
        return leaf;
    }

    /// Plain Newton from the frame's start in the leaf, in the lanes `moving`.
    HWY_ATTR HWY_NOINLINE void intersect_once(Target& target, const NewtonPatch& newton, const LeafBox& box,
                                              mask moving, real3 origin, real3 direction, PacketHit& hit)
    {
        const RayPlanes planes = ray_planes(origin, direction);
        const auto [start_u, start_v] = job_.stochastic->start;
        const PlainEnd end =
            plain_newton([&](real2 uv) HWY_ATTR { return newton.at(uv); },
                         [&](mask lanes) HWY_ATTR { work_.newton_steps += lane_count(lanes); }, planes, box,
                         newton.enough, leaf_start(scalar2(start_u, start_v), box.uv_lo, box.uv_hi), moving);
        if (!any_lane(end.settled))
            return;
        const real2 overlap = patch_overlap(root_blur(seen_point(end.s, planes), newton.rounding), newton.slack);
        const mask inside =
            end.settled && abs(end.uv.x - 0.5f) <= 0.5f + overlap.x && abs(end.uv.y - 0.5f) <= 0.5f + overlap.y;
        const real t = dot(end.s.p - origin, direction) / dot(direction, direction);
        const mask near = inside && in_range(target, t, hit);
        if (any_lane(near))
            offer(target, near, t, end.uv, patch_normal(newton, end.s, end.uv, near), hit);
    }

    /// Offers all roots of the rays `open`, found by splitting the leaf. Returns the rays that may have more.
    HWY_ATTR HWY_NOINLINE mask split(Target& target, const NewtonPatch& newton, const LeafPlane& leaf,
                                     const RayPlanes& planes, const SurfacePoint& middle, const SeenPoint& seen,
                                     mask open, real3 origin, real3 direction, PacketHit& hit)
    {
        RootLists roots;
        const PacketRays rays{origin, direction, planes};
        const Sight sight = sight_of(leaf, planes, middle, seen, real(1.0f), newton.rounding);
        const uint doubtful = list_roots(
            newton, leaf, rays, sight, open,
            [&](const Search& search, const Root& root, real3 along)
                HWY_ATTR { return is_unsure(target, newton, search, root, along, mask(true)); },
            roots, work_.newton_steps);
        const int most = *std::max_element(roots.count, roots.count + kLanes);
        for (int i = 0; i < most; ++i) {
            uint has = 0;
            for (int lane = 0; lane < kLanes; ++lane)
                has |= uint(i < roots.count[lane]) << lane;
            const mask lanes = open && lanes_of(has);
            const real t = select(lanes, load(roots.t[i]), real(kHuge));
            const mask near = lanes && in_range(target, t, hit);
            if (any_lane(near))
                offer(target, near, t, real2(load(roots.u[i]), load(roots.v[i])),
                      real3(load(roots.nx[i]), load(roots.ny[i]), load(roots.nz[i])), hit);
        }
        return lanes_of(doubtful);
    }

    /// Takes the roots that lie in the face's domain and inside its trims.
    HWY_ATTR HWY_INLINE void offer(Target& target, mask near, real t, real2 uv_patch, real3 normal, PacketHit& hit)
    {
        const PatchRecord& patch = target.patch;
        real2 uv = face_uv(patch, uv_patch);
        if ((patch.shape & 0xffu) == kKindTorus)
            uv = unwrapped(patch, uv);
        mask taken = near && in_slack_domain(uv);
        if (!any_lane(taken))
            return;
        uv = clamp_to_domain(uv);
        // of two hits within rounding the one of the lower instance and leaf stays, whatever the order
        const real at = target.rays.base() + target.rays.per_t() * t;
        const integer leaf(target.at.leaf), instance(target.at.instance);
        const mask first = instance < hit.instance || (instance == hit.instance && leaf < hit.leaf);
        taken = taken && at < hit.best + select(first, real(target.rays.slack()), real(-target.rays.slack()));
        if (!any_lane(taken))
            return;
        if ((target.face.flags & kFaceNaturalBorder) == 0) {
            taken = taken && inside_loops(target, uv, taken);
            if (!any_lane(taken))
                return;
        }
        if constexpr (Rays::kCollects)
            if (target.rays.collect(taken, at, meets_back(target, normal), target.at, target.face.tolerance_mm))
                return;
        mask back(false);
        if (target.rim) {
            back = meets_back(target, normal);
            if (rims_cut && any_lane(taken && back)) {
                taken = taken && !in_rim(target, taken && back, uv);
                if (!any_lane(taken))
                    return;
            }
        }
        hit.best = select(taken, at, hit.best);
        hit.leaf = select(taken, leaf, hit.leaf);
        hit.instance = select(taken, instance, hit.instance);
        hit.uv_face = select(taken, uv, hit.uv_face);
        hit.normal = select(taken, normal, hit.normal);
        hit.back = select(taken, back, hit.back);
        target.changed = true;
    }

    /// Lanes of `asked` that lie inside the loops of a face that has some.
    HWY_ATTR mask inside_loops(const Target& target, real2 uv, mask asked)
    {
        const uint face = target.patch.face;
        return job_.reference != nullptr
                   ? inside_by_reference(job_, face, uv, asked, scratch_)
                   : inside_trims(source_, job_.trim, face, target.face, uv, asked, work_.curve_tests);
    }

    /// Lanes that meet the face from behind.
    HWY_ATTR mask meets_back(const Target& target, real3 normal) const
    {
        const uint patch = image_.leaves[target.at.leaf].patch;
        const bool turned = ((target.face.flags & kFaceReversed) != 0) != (job_.scene.left_handed[patch] != 0);
        const real along = dot(target.direction, normal);
        return turned ? along < 0.0f : along > 0.0f;
    }

    /// Lanes of `asked`, hits inside of the face, that lie in its rim.
    HWY_ATTR HWY_NOINLINE mask in_rim(const Target& target, mask asked, real2 uv)
    {
        mask beside_rim = asked;
        for (int corner = 0; corner < kCornerCount && any_lane(beside_rim); ++corner) {
            const real2 q = corner_around(uv, real2(rim_width(target.face.flags)), corner);
            beside_rim = beside_rim && in_domain(q);
            if ((target.face.flags & kFaceNaturalBorder) == 0 && any_lane(beside_rim))
                beside_rim = beside_rim && inside_loops(target, clamp_to_domain(q), beside_rim);
        }
        return asked && !beside_rim;
    }

    const BlockJob& job_;
    BlockScratch& scratch_;
    const FetchSource& source_;
    WorkCounts& work_;
    const PackImage& image_;
};

SHARED_CLOSE
#endif
