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

#include "runtime/cpu_candidates.h"
#include "runtime/cpu_caps.h"
#include "runtime/cpu_edges.h"
#include "runtime/cpu_fetch.h"
#include "runtime/cpu_lanes.h"
#include "runtime/cpu_leaf_hits.h"
#include "runtime/cpu_light.h"
#include "runtime/cpu_stochastic.h"
#include "runtime/cpu_write.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <limits>
#include <optional>

SHARED_OPEN

/// What a BlockTracer can do beside showing the pack in its own colours under the light at the eye.
enum class Effects {
    None,
    Look,  // lights, materials, maps and environments, where the job has them
    Spans, // these, and rays that begin on their way, at section planes or behind surfaces that let light through
};

template <Effects kEffects>
class BlockTracer {
    static constexpr bool kLook = kEffects != Effects::None, kSpans = kEffects == Effects::Spans;

public:
    HWY_ATTR BlockTracer(const BlockJob& job, BlockScratch& scratch, Frame& frame, WorkCounts& work)
        : job_(job), scratch_(scratch), frame_(frame), work_(work), image_(job.scene.image),
          source_(fetch_source(job.scene.image, job.kd)), leaf_hits_(job, scratch, source_, work),
          edges_(job, scratch, source_, work)
    {
        if constexpr (kLook)
            if (job.light)
                light_.emplace(job, scratch, source_, work);
        span_ = {real(-float(job.view.depth_ref)), real(kHuge), integer(kNoPlane)};
        if constexpr (kSpans)
            if (job.section)
                caps_.emplace(job, scratch, source_, work);
    }

    HWY_ATTR void trace(const Block& block)
    {
        const float middle_x = 0.5f * float(job_.width), middle_y = 0.5f * float(job_.height);
        collect_candidates(job_.scene, job_.view, pixel_rect(block), scratch_, work_);
        list_rects();
        scratch_.has_view.assign(scratch_.candidates.size(), 0);
        scratch_.patch_views.resize(std::max(scratch_.patch_views.size(), scratch_.candidates.size()));
        scratch_.has_middle.assign(scratch_.candidates.size(), 0);
        scratch_.leaf_middles.resize(std::max(scratch_.leaf_middles.size(), scratch_.candidates.size()));
        alignas(64) float offset_x[kLanes], offset_y[kLanes];
        for (int i = 0; i < kLanes; ++i) {
            offset_x[i] = float(i % 4) + 0.5f - middle_x;
            offset_y[i] = float(i / 4) + 0.5f - middle_y;
        }
        if (job_.map != nullptr && job_.map->measures)
            scratch_.strip.map_value.resize(size_t{kBlockSide} * kBlockSide);
        const bool has_borders = job_.edges && edges_.concerns(scratch_.candidates);
        const bool keeps = job_.stochastic && job_.stochastic->kept;
        const bool draws_lines = has_borders && job_.edges->drawer; // once it is traced; until then the block is kept
        for (uint32_t ty = block.y0; ty < block.y1; ty += kTileSide) {
            const uint32_t tile_y1 = std::min(ty + kTileSide, block.y1);
            const uint32_t strip_y0 = draws_lines ? block.y0 : ty;
            for (uint32_t tx = block.x0; tx < block.x1; tx += kTileSide) {
                const Block tile{tx, ty, std::min(tx + kTileSide, block.x1), tile_y1};
                choose_candidates(centre_rect(tile));
                for (uint32_t y = tile.y0; y < tile.y1; y += 4) {
                    for (uint32_t x = tile.x0; x < tile.x1; x += 4) {
                        Packet packet;
                        packet.x = load(offset_x) + real(float(x));
                        packet.y = load(offset_y) + real(float(y));
                        packet.alive = packet.x < float(tile.x1) - middle_x && packet.y < float(tile.y1) - middle_y;
                        if constexpr (kSpans)
                            if (caps_)
                                span_ = caps_->span(packet);
                        packet.begin = span_.begin;
                        kept_ = keeps ? &job_.stochastic->kept->of_packet(x, y) : nullptr;
                        const PixelRect rect = centre_rect({x, y, x + 4, y + 4});
                        PacketHit hit = trace_twice(packet, rect);
                        if (keeps)
                            keep_nearer(hit, packet.alive, *kept_);
                        write(packet, rect, hit, x - block.x0, y - strip_y0);
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

    /// Where the centres of the block's pixels lie, and so its rays.
    PixelRect centre_rect(const Block& block) const
    {
        const PixelRect rect = pixel_rect(block);
        return {rect.x0 + 0.5f, rect.x1 - 0.5f, rect.y0 + 0.5f, rect.y1 - 0.5f};
    }

    static HWY_ATTR mask meets(const RectGroup& group, const PixelRect& rect)
    {
        return load(group.x0) <= rect.x1 && load(group.x1) >= rect.x0 && load(group.y0) <= rect.y1 &&
               load(group.y1) >= rect.y0;
    }

    static HWY_ATTR mask meets(const CandidateGroup& group, const PixelRect& rect)
    {
        mask met = meets(group.rect, rect);
        const real x(0.5f * (rect.x0 + rect.x1)), y(0.5f * (rect.y0 + rect.y1));
        for (const CandidateGroup::Strips& strip : group.strip) {
            const real at = x * load(strip.nx) + y * load(strip.ny);
            met = met && at >= load(strip.lo) && at <= load(strip.hi);
        }
        return met;
    }

    /// Lists where all candidates are, as the scratch's rects.
    void list_rects()
    {
        const std::vector<Candidate>& all = scratch_.candidates;
        rect_groups_ = (all.size() + kLanes - 1) / kLanes;
        scratch_.rects.resize(std::max(scratch_.rects.size(), rect_groups_));
        for (size_t i = 0; i < rect_groups_ * kLanes; ++i) {
            constexpr PixelRect kNowhere{std::numeric_limits<float>::infinity(), 0, 0, 0};
            const PixelRect& rect = i < all.size() ? all[i].rect : kNowhere;
            RectGroup& group = scratch_.rects[i / kLanes];
            group.x0[i % kLanes] = rect.x0;
            group.x1[i % kLanes] = rect.x1;
            group.y0[i % kLanes] = rect.y0;
            group.y1[i % kLanes] = rect.y1;
        }
    }

    /// Lists the candidates that meet the tile as the scratch's groups.
    HWY_ATTR void choose_candidates(const PixelRect& rect)
    {
        tile_count_ = 0;
        for (size_t first = 0; first < rect_groups_; ++first)
            for (uint bits = lane_bits(meets(scratch_.rects[first], rect)); bits != 0; bits &= bits - 1)
                list_candidate(uint32_t(first * kLanes) + uint32_t(__builtin_ctz(bits)));
        for (size_t i = tile_count_; i % kLanes != 0; ++i)
            scratch_.tile_groups[i / kLanes].rect.x0[i % kLanes] = std::numeric_limits<float>::infinity();
    }

    void list_candidate(uint32_t index)
    {
        const size_t at = tile_count_ % kLanes;
        if (scratch_.tile_groups.size() * kLanes <= tile_count_)
            scratch_.tile_groups.resize(2 * scratch_.tile_groups.size() + 1);
        CandidateGroup& group = scratch_.tile_groups[tile_count_++ / kLanes];
        const Candidate& c = scratch_.candidates[index];
        group.rect.x0[at] = c.rect.x0;
        group.rect.x1[at] = c.rect.x1;
        group.rect.y0[at] = c.rect.y0;
        group.rect.y1[at] = c.rect.y1;
        for (int i = 0; i < 2; ++i) {
            const PixelStrip& strip = c.strip[i];
            CandidateGroup::Strips& strips = group.strip[i];
            const float reach = 1.5f * (std::abs(strip.nx) + std::abs(strip.ny)); // from a packet's middle to its rays
            strips.nx[at] = strip.nx;
            strips.ny[at] = strip.ny;
            strips.lo[at] = strip.lo - reach;
            strips.hi[at] = strip.hi + reach;
        }
        group.near_mm[at] = c.near_mm;
        group.index[at] = index;
    }

    /// Puts the packet's pixels at (x, y) of the strip. A cap hides the hit behind it.
    HWY_ATTR void write(const Packet& packet, const PixelRect& rect, PacketHit& hit, uint32_t x, uint32_t y)
    {
        PacketCaps caps;
        if constexpr (kSpans)
            if (caps_)
                caps = caps_->find(packet, span_, hit);
        if (put_misses(job_, kLook && job_.environment, packet, hit, x, y, scratch_.strip, work_))
            return;
        SeenPacket seen =
            see_packet<kLook>(job_, packet, hit, kSpans && caps_ ? &caps : nullptr, light(), x, y, &scratch_.strip);
        real alpha = select(seen.hits, real(1.0f), real(0.0f));
        if constexpr (kSpans)
            if (job_.materials && job_.materials->transparent)
                alpha = see_through(packet, rect, hit, seen);
        if constexpr (kLook)
            if (job_.environment)
                alpha = see_environment(packet, alpha, seen);
        put_packet(seen, alpha, packet.alive, x, y, scratch_.strip, work_);
        if constexpr (kSpans)
            if (caps_)
                hit.best = select(caps.here, real(kHuge), hit.best);
    }

    PacketLight* light() { return kLook && light_ ? &*light_ : nullptr; }

    /// Blends what lies behind surfaces that let light through into seen.color; returns the pixels' alpha. Each layer
    /// is traced from behind the one before it, so layers come in their order along the ray.
    HWY_ATTR HWY_NOINLINE real see_through(const Packet& packet, const PixelRect& rect, const PacketHit& first,
                                           SeenPacket& seen)
    {
        const PixelPlaces places(*job_.places);
        const real speed = length(places.along(packet));
        real left = select(seen.hits, 1.0f - seen.opacity, real(0.0f));
        real3 sum = seen.color * (1.0f - left);
        KeptPacket* const kept = kept_;
        kept_ = nullptr;
        const CutSpan whole = span_;
        PacketHit hit = first;
        mask on = seen.hits && left > kLeastLeft;
        for (uint layer = 1; layer < kMostLayers && any_lane(on); ++layer) {
            const real past = select(on, hit.best, real(0.0f));
            const real away = start_distance(places.at(packet, past), places.footprint(past) * job_.error_px);
            span_.begin = select(on, past + away / speed, real(kHuge));
            const Packet rays{packet.x, packet.y, on, span_.begin};
            hit = trace_twice(rays, rect);
            const SeenPacket behind = see_packet<kLook>(job_, rays, hit, nullptr, light(), 0, 0, nullptr);
            on = on && behind.hits;
            const real share = select(on, left * behind.opacity, real(0.0f));
            sum = sum + select(on, behind.color, real3(real(0.0f), real(0.0f), real(0.0f))) * share;
            left = left - share;
            on = on && left > kLeastLeft;
        }
        span_ = whole;
        kept_ = kept;
        const real alpha = select(seen.hits, 1.0f - left, real(0.0f));
        seen.color = sum * (1.0f / select(alpha > 0.0f, alpha, real(1.0f)));
        return alpha;
    }

    /// Blends the environment behind what is seen; nothing shows through then.
    HWY_ATTR HWY_NOINLINE real see_environment(const Packet& packet, real alpha, SeenPacket& seen) const
    {
        const View& view = job_.view;
        const auto vector = [](const double(&v)[3]) { return scalar3(float(v[0]), float(v[1]), float(v[2])); };
        const real3 along = vector(view.w0) + packet.x * vector(view.step_x) + packet.y * vector(view.step_y);
        const real3 behind = environment_along(*job_.environment, along);
        seen.color = select(alpha > 0.0f, seen.color * alpha, real3(real(0.0f), real(0.0f), real(0.0f))) +
                     behind * (1.0f - alpha);
        return real(1.0f);
    }

    /// A rim's back counts as a surface first, for few rays meet one: where it is what they see they are traced again.
    HWY_ATTR PacketHit trace_twice(const Packet& packet, const PixelRect& rect)
    {
        leaf_hits_.rims_cut = false;
        const PacketHit hit = trace_packet(packet, rect);
        if (!any_lane(hit.back))
            return hit;
        leaf_hits_.rims_cut = true;
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
        if constexpr (kSpans) {
            hit.best = select(packet.alive && span_.begin < span_.end, min(span_.end, hit.best), real(-kHuge));
            farthest = largest_lane(hit.best);
        }
        if (kept_ != nullptr) {
            load_kept(*kept_, packet.alive, hit);
            farthest = largest_lane(hit.best);
        }
        recent_.clear();
        for (size_t first = 0; first < tile_count_; first += kLanes) {
            const CandidateGroup& group = scratch_.tile_groups[first / kLanes];
            if (group.near_mm[0] > farthest)
                break;
            for (uint bits = lane_bits(meets(group, rect)); bits != 0; bits &= bits - 1) {
                const int i = __builtin_ctz(bits);
                if (group.near_mm[i] > farthest)
                    break;
                if (intersect(packet, group.index[i], hit))
                    farthest = largest_lane(hit.best);
            }
        }
        if constexpr (kSpans)
            hit.best = select(hit.leaf == integer(~0u), real(kHuge), hit.best);
        return hit;
    }

    /// Tests one candidate; true if a ray's nearest hit changed.
    HWY_ATTR bool intersect(const Packet& packet, uint32_t candidate_index, PacketHit& hit)
    {
        const Candidate& candidate = scratch_.candidates[candidate_index];
        const uint patch_id = image_.leaves[candidate.leaf].patch;
        if (job_.scene.shared_patch[patch_id] && recent_.has(candidate.instance, patch_id))
            return false;
        work_.leaf_visits += lane_count(packet.alive);
        if (!scratch_.has_view[candidate_index]) {
            scratch_.patch_views[candidate_index] =
                make_patch_view(image_.patches[patch_id], job_.view.instances[candidate.instance], job_.view.tau_ref);
            scratch_.has_view[candidate_index] = 1;
        }
        const PatchView& view = scratch_.patch_views[candidate_index];
        const real3 across = packet.x * scalar3(view.step_x[0], view.step_x[1], view.step_x[2]) +
                             packet.y * scalar3(view.step_y[0], view.step_y[1], view.step_y[2]);
        const scalar3 middle(view.origin[0], view.origin[1], view.origin[2]);
        const scalar3 w0(view.w0[0], view.w0[1], view.w0[2]);
        const real3 origin = middle + across * real(view.tau), direction = w0 + across;
        const EyeRays rays{view, packet};
        return leaf_hits_.intersect(rays, candidate, image_.patches[patch_id], origin, direction, hit);
    }

    const BlockJob& job_;
    BlockScratch& scratch_;
    Frame& frame_;
    WorkCounts& work_;
    const PackImage& image_;
    const FetchSource source_;
    LeafHits<EyeRays> leaf_hits_;
    EdgeFinder edges_;
    std::optional<PacketLight> light_;
    std::optional<CapFinder> caps_;
    CutSpan span_; // of the packet at hand where kSpans; else it begins at the eye
    size_t rect_groups_ = 0, tile_count_ = 0;
    RecentPatches recent_;
    KeptPacket* kept_ = nullptr; // of the packet at hand, where hits are kept from frame to frame
};

SHARED_CLOSE
#endif
