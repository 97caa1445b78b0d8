// A packet of 16 rays against the leaves of its tile. Included once per target by cpu_lanes.cpp.
//
// A block's candidate leaves come sorted by their nearest point. Each 16 x 16 tile keeps those that its pixels can
// meet, each packet of 4 x 4 pixels goes through the tile's in order and stops when the next is behind all it has.
#if defined(TRIMRAY_CPU_PACKET_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_PACKET_H
#undef TRIMRAY_CPU_PACKET_H
#else
#define TRIMRAY_CPU_PACKET_H
#endif

#include "runtime/cpu_edges.h"
#include "runtime/cpu_evaluate.h"
#include "runtime/cpu_fetch.h"
#include "runtime/cpu_lanes.h"
#include "runtime/cpu_leaf_roots.h"
#include "runtime/cpu_stochastic.h"
#include "runtime/cpu_trim.h"
#include "runtime/cpu_trim_reference.h"
#include "runtime/cpu_write.h"
#include "shaders/shared/leaf_start.h"
#include "shaders/shared/quadric.h"
#include "shaders/shared/rim.h"
#include "shaders/shared/torus.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <cstring>
#include <limits>

SHARED_OPEN

class BlockTracer {
public:
    BlockTracer(const BlockJob& job, BlockScratch& scratch, Frame& frame, WorkCounts& work)
        : job_(job), scratch_(scratch), frame_(frame), work_(work), image_(job.scene.image),
          source_(fetch_source(job.scene.image, job.kd)), edges_(job, scratch, source_, work)
    {
    }

    HWY_ATTR void trace(const Block& block)
    {
        const float middle_x = 0.5f * float(job_.width), middle_y = 0.5f * float(job_.height);
        collect_candidates(job_.scene, job_.view, pixel_rect(block), scratch_.walk, scratch_.candidates, work_);
        scratch_.has_view.assign(scratch_.candidates.size(), 0);
        scratch_.patch_views.resize(std::max(scratch_.patch_views.size(), scratch_.candidates.size()));
        scratch_.has_middle.assign(scratch_.candidates.size(), 0);
        scratch_.leaf_middles.resize(std::max(scratch_.leaf_middles.size(), scratch_.candidates.size()));
        alignas(64) float offset_x[kLanes], offset_y[kLanes];
        for (int i = 0; i < kLanes; ++i) {
            offset_x[i] = float(i % 4) + 0.5f - middle_x;
            offset_y[i] = float(i / 4) + 0.5f - middle_y;
        }
        const bool has_borders = job_.edges && edges_.concerns(scratch_.candidates);
        const bool keeps = job_.stochastic && job_.stochastic->kept;
        const bool draws_lines = has_borders && job_.edges->drawer; // once it is traced; until then the block is kept
        for (uint32_t ty = block.y0; ty < block.y1; ty += kTileSide) {
            const uint32_t tile_y1 = std::min(ty + kTileSide, block.y1);
            const uint32_t strip_y0 = draws_lines ? block.y0 : ty;
            for (uint32_t tx = block.x0; tx < block.x1; tx += kTileSide) {
                const Block tile{tx, ty, std::min(tx + kTileSide, block.x1), tile_y1};
                choose_candidates(pixel_rect(tile));
                for (uint32_t y = tile.y0; y < tile.y1; y += 4) {
                    for (uint32_t x = tile.x0; x < tile.x1; x += 4) {
                        Packet packet;
                        packet.x = load(offset_x) + real(float(x));
                        packet.y = load(offset_y) + real(float(y));
                        packet.alive = packet.x < float(tile.x1) - middle_x && packet.y < float(tile.y1) - middle_y;
                        kept_ = keeps ? &job_.stochastic->kept->of_packet(x, y) : nullptr;
                        PacketHit hit = trace_twice(packet, pixel_rect({x, y, x + 4, y + 4}));
                        if (keeps)
                            keep_nearer(hit, packet.alive, *kept_);
                        write_packet(job_, packet, hit, x - block.x0, y - strip_y0, scratch_.strip, work_);
                        if (has_borders)
                            edges_.find(packet, hit, x, y, &scratch_.strip.rgba[y - strip_y0][4 * (x - block.x0)]);
                    }
                }
            }
            if (!draws_lines)
                write_strip(scratch_.strip, block.x0, ty, block.x1 - block.x0, tile_y1 - ty, frame_);
        }
        if (draws_lines) {
            edges_.draw_lines(block, scratch_.strip);
            write_strip(scratch_.strip, block.x0, block.y0, block.x1 - block.x0, block.y1 - block.y0, frame_);
        }
        hwy::FlushStream();
        work_.rays += uint64_t(block.x1 - block.x0) * (block.y1 - block.y0);
    }

private:
    PixelRect pixel_rect(const Block& block) const
    {
        const float x = 0.5f * float(job_.width), y = 0.5f * float(job_.height);
        return {float(block.x0) - x, float(block.x1) - x, float(block.y0) - y, float(block.y1) - y};
    }

    /// Copies the candidates that meet the tile into the scratch's arrays.
    void choose_candidates(const PixelRect& rect)
    {
        const std::vector<Candidate>& all = scratch_.candidates;
        BlockScratch& s = scratch_;
        if (s.x0.size() < all.size() + kLanes)
            for (std::vector<float>* v : {&s.x0, &s.x1, &s.y0, &s.y1, &s.near_mm})
                v->resize(all.size() + kLanes);
        s.index.resize(std::max(s.index.size(), all.size() + kLanes));
        tile_count_ = 0;
        for (size_t i = 0; i < all.size(); ++i) {
            const Candidate& c = all[i];
            s.x0[tile_count_] = c.rect.x0;
            s.x1[tile_count_] = c.rect.x1;
            s.y0[tile_count_] = c.rect.y0;
            s.y1[tile_count_] = c.rect.y1;
            s.near_mm[tile_count_] = c.near_mm;
            s.index[tile_count_] = uint32_t(i);
            tile_count_ += c.rect.x0 <= rect.x1 && c.rect.x1 >= rect.x0 && c.rect.y0 <= rect.y1 && c.rect.y1 >= rect.y0;
        }
        for (size_t i = tile_count_; i < tile_count_ + kLanes; ++i) {
            s.x0[i] = std::numeric_limits<float>::infinity(); // meets no packet
            s.x1[i] = s.y0[i] = s.y1[i] = s.near_mm[i] = 0;
        }
    }

    /// A rim's back counts as a surface first, for few rays meet one: where it is what they see they are traced again.
    HWY_ATTR PacketHit trace_twice(const Packet& packet, const PixelRect& rect)
    {
        rims_cut_ = false;
        const PacketHit hit = trace_packet(packet, rect);
        if (!any_lane(hit.back))
            return hit;
        rims_cut_ = true;
        return trace_packet(packet, rect);
    }

    HWY_ATTR PacketHit trace_packet(const Packet& packet, const PixelRect& rect)
    {
        PacketHit hit;
        hit.best = select(packet.alive, real(kHuge), real(-kHuge));
        hit.leaf = integer(~0u);
        hit.instance = integer(~0u);
        hit.uv_face = real2(real(0.0f), real(0.0f));
        hit.normal = real3(real(0.0f), real(0.0f), real(1.0f));
        hit.back = mask(false);
        hit.doubt = real(job_.stochastic ? -kHuge : kHuge); // plain Newton claims nothing
        float farthest = kHuge;
        if (kept_ != nullptr) {
            load_kept(*kept_, packet.alive, hit);
            farthest = largest_lane(hit.best);
        }
        recent_count_ = 0;
        for (size_t first = 0; first < tile_count_; first += kLanes) {
            if (scratch_.near_mm[first] > farthest)
                break;
            const mask meets = load(&scratch_.x0[first]) <= rect.x1 && load(&scratch_.x1[first]) >= rect.x0 &&
                               load(&scratch_.y0[first]) <= rect.y1 && load(&scratch_.y1[first]) >= rect.y0;
            for (uint bits = lane_bits(meets); bits != 0; bits &= bits - 1) {
                const size_t i = first + size_t(__builtin_ctz(bits));
                if (scratch_.near_mm[i] > farthest)
                    break;
                if (intersect(packet, scratch_.index[i], hit))
                    farthest = largest_lane(hit.best);
            }
        }
        return hit;
    }

    /// Tests one candidate; true if a ray's nearest hit changed.
    HWY_ATTR bool intersect(const Packet& packet, uint32_t candidate_index, PacketHit& hit)
    {
        const Candidate& candidate = scratch_.candidates[candidate_index];
        const uint patch_id = image_.leaves[candidate.leaf].patch;
        const PatchRecord& patch = image_.patches[patch_id];
        if (job_.scene.shared_patch[patch_id] && was_tested(candidate.instance, patch_id))
            return false;
        work_.leaf_visits += lane_count(packet.alive);
        if (!scratch_.has_view[candidate_index]) {
            scratch_.patch_views[candidate_index] =
                make_patch_view(patch, job_.view.instances[candidate.instance], job_.view.tau_ref);
            scratch_.has_view[candidate_index] = 1;
        }
        const PatchView& view = scratch_.patch_views[candidate_index];
        const real3 across = packet.x * scalar3(view.step_x[0], view.step_x[1], view.step_x[2]) +
                             packet.y * scalar3(view.step_y[0], view.step_y[1], view.step_y[2]);
        const scalar3 middle(view.origin[0], view.origin[1], view.origin[2]);
        const scalar3 w0(view.w0[0], view.w0[1], view.w0[2]);
        const real3 origin = middle + across * real(view.tau);
        const real3 direction = w0 + across;
        const FaceRecord& face = image_.faces[patch.face];
        const bool rim = (face.flags & kFaceRims) != 0 && job_.view.instances[candidate.instance].outside;
        Target target{candidate, view, patch, face, rim, direction, false};
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
            intersect_bezier(packet, target, origin, direction, candidate_index, hit);
            break;
        }
        return target.changed;
    }

    struct Target {
        const Candidate& candidate;
        const PatchView& view;
        const PatchRecord& patch;
        const FaceRecord& face;
        bool rim; // the face has one, and the eye sees it from outside
        const real3& direction;
        bool changed;
    };

    /// In front of the eye and not behind the nearest hit.
    HWY_ATTR mask in_range(const Target& target, real t, const PacketHit& hit) const
    {
        const real at = target.view.base_mm + target.view.mm_per_t * t;
        return at > -float(job_.view.tau_ref) && at < hit.best + target.view.slack_mm && t < kHuge;
    }

    /// Where rounding decides whether a ray meets a surface, what lies behind is not certain.
    HWY_ATTR HWY_INLINE void doubt_touch(const Target& target, real touch, PacketHit& hit) const
    {
        const PatchView& view = target.view;
        if (!any_lane(touch < kHuge))
            return;
        const real from = view.base_mm - view.slack_mm + view.mm_per_t * touch;
        const mask ahead = touch < kHuge && (from > -float(job_.view.tau_ref) || touch <= -kHuge);
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
    HWY_ATTR HWY_NOINLINE void intersect_bezier(const Packet& packet, Target& target, real3 origin, real3 direction,
                                                uint32_t candidate_index, PacketHit& hit)
    {
        constexpr float kBoxMargin = 1e-6f; // patch units: the ray's rounding
        const LeafBox box = decode_leaf(image_.leaves[target.candidate.leaf]);
        const BoxHit in_box = leaf_box_hit(box, origin, direction, kBoxMargin);
        const float base = target.view.base_mm, per_t = target.view.mm_per_t;
        mask moving = in_box.hit && packet.alive && base + per_t * in_box.near < hit.best + target.view.slack_mm &&
                      base + per_t * in_box.far > -float(job_.view.tau_ref);
        if (!any_lane(moving))
            return;
        const NewtonPatch newton = newton_patch(target);
        if (job_.stochastic)
            return intersect_once(target, newton, box, moving, origin, direction, hit);
        const LeafPlane leaf = middle_of(newton, box, target.patch.param, candidate_index);
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
        open = open && base + per_t * in_box.near < hit.best + target.view.slack_mm;
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
                last_residual(job_.error_px * target.view.pixel * std::abs(target.view.tau)),
                patch_rounding(degree_u, degree_v),
                patch_slack(scalar2(patch.uv_scale[0], patch.uv_scale[1])),
                (patch.shape & kShapeRational) != 0};
    }

    /// Roots of which rounding decides more than a certificate leaves open: how far they are, or whether the face holds
    /// them. Of the lanes `asked`.
    HWY_ATTR HWY_INLINE mask is_unsure(const Target& target, const NewtonPatch& newton, const Search& search,
                                       const Root& root, real3 direction, mask asked)
    {
        const real footprint = target.view.pixel * (target.view.tau + root.t);
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

    /// The leaf's plane, evaluated when the block first asks.
    HWY_ATTR LeafPlane middle_of(const NewtonPatch& newton, const LeafBox& box, const float (&lost)[2],
                                 uint32_t candidate_index)
    {
        static_assert(sizeof(LeafPlane) <= sizeof(LeafMiddle));
        LeafMiddle& kept = scratch_.leaf_middles[candidate_index];
        LeafPlane leaf;
        if (!scratch_.has_middle[candidate_index]) {
            const SurfacePoint s = newton.at(real2(leaf_middle(box)));
            leaf = leaf_plane(box, first_lane(s.p), first_lane(s.du), first_lane(s.dv),
                              derivative_loss(box, scalar2(lost[0], lost[1]), newton.degree_u, newton.degree_v));
            std::memcpy(&kept, &leaf, sizeof leaf);
            scratch_.has_middle[candidate_index] = 1;
        }
        std::memcpy(&leaf, &kept, sizeof leaf);
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

    /// But for the torus' second angle, which is unwrapped.
    HWY_ATTR static real2 face_uv(const PatchRecord& patch, real2 uv_patch)
    {
        return real2(patch.uv_offset[0] + patch.uv_scale[0] * uv_patch.x,
                     patch.uv_offset[1] + patch.uv_scale[1] * uv_patch.y);
    }

    /// Takes the roots that lie in the face's domain and inside its trims.
    HWY_ATTR HWY_INLINE void offer(Target& target, mask near, real t, real2 uv_patch, real3 normal, PacketHit& hit)
    {
        const PatchRecord& patch = target.patch;
        real2 uv = face_uv(patch, uv_patch);
        if ((patch.shape & 0xffu) == kKindTorus) {
            // pack_layout.h: the torus' v is unwrapped upwards
            const float half_turn = kPi * patch.uv_scale[1];
            uv.y = select(uv.y < 0.5f - half_turn, uv.y + 2.0f * half_turn, uv.y);
        }
        mask taken = near && abs(uv.x - 0.5f) <= 0.5f + kDomainSlack && abs(uv.y - 0.5f) <= 0.5f + kDomainSlack;
        if (!any_lane(taken))
            return;
        uv = clamp_to_domain(uv);
        // of two hits within rounding the one of the lower instance and leaf stays, whatever the order
        const real at = target.view.base_mm + target.view.mm_per_t * t;
        const integer leaf(target.candidate.leaf), instance(target.candidate.instance);
        const mask first = instance < hit.instance || (instance == hit.instance && leaf < hit.leaf);
        taken = taken && at < hit.best + select(first, real(target.view.slack_mm), real(-target.view.slack_mm));
        if (!any_lane(taken))
            return;
        if ((target.face.flags & kFaceNaturalBorder) == 0) {
            taken = taken && inside_loops(target, uv, taken);
            if (!any_lane(taken))
                return;
        }
        mask back(false);
        if (target.rim) {
            back = meets_back(target, normal);
            if (rims_cut_ && any_lane(taken && back)) {
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
        const uint patch = image_.leaves[target.candidate.leaf].patch;
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

    bool was_tested(uint instance, uint patch)
    {
        constexpr uint kRecent = 8;
        const uint64_t key = uint64_t(instance) << 32 | patch;
        for (uint i = 0; i < std::min(recent_count_, kRecent); ++i)
            if (recent_[i] == key)
                return true;
        recent_[recent_count_++ % kRecent] = key;
        return false;
    }

    const BlockJob& job_;
    BlockScratch& scratch_;
    Frame& frame_;
    WorkCounts& work_;
    const PackImage& image_;
    const FetchSource source_;
    EdgeFinder edges_;
    size_t tile_count_ = 0;
    uint64_t recent_[8];
    uint recent_count_ = 0;
    bool rims_cut_ = false;      // rims are no surface
    KeptPacket* kept_ = nullptr; // of the packet at hand, where hits are kept from frame to frame
};

SHARED_CLOSE
#endif
