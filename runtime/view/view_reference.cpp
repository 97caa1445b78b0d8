#include "runtime/view/view_reference.h"

#include "runtime/closest_errors.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>
#include <utility>

#include <tbb/parallel_for.h>

namespace trimray {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Calls body(i) for each pixel, rows at once. False: it was given up.
template <class Body>
bool each_pixel(uint32_t width, uint32_t height, const std::function<bool()>& cancelled, const Body& body,
                const std::function<void(uint32_t rows_done)>& row_done = {})
{
    std::atomic<bool> stopped{false};
    std::mutex telling;
    uint32_t rows_done = 0;
    tbb::parallel_for(0u, height, [&](uint32_t y) {
        for (uint32_t x = 0; x < width && !stopped; ++x) {
            if (cancelled && cancelled())
                stopped = true;
            else
                body(size_t{y} * width + x);
        }
        if (!row_done || stopped)
            return;
        const std::lock_guard lock(telling);
        row_done(++rows_done);
    });
    return !stopped;
}

} // namespace

ViewReference::ViewReference(std::shared_ptr<const Scene> scene, const RenderOptions& options)
    : scene_(std::move(scene)), arrangement_(std::make_unique<KeptArrangement>()),
      rays_(options.camera, options.width, options.height), width_(options.width), height_(options.height),
      in_double_(options.look.section.planes.empty()), depth_mm_(size_t{width_} * height_, kInfinity),
      face_(depth_mm_.size(), -1), instance_(depth_mm_.size(), -1), beside_(depth_mm_.size(), PixelVerdict::Right),
      asked_(depth_mm_.size(), 0)
{
}

Result<ViewReference> ViewReference::make(std::shared_ptr<const Scene> scene, const RenderOptions& options,
                                          const std::function<void(double)>& progress)
{
    ViewReference made(std::move(scene), options);
    const Status traced = made.in_double_ ? made.trace_in_double(options, progress) : made.trace_best(options);
    if (!traced.ok())
        return traced.error();
    return made;
}

Status ViewReference::trace_in_double(const RenderOptions& options, const std::function<void(double)>& progress)
{
    if (options.is_cancelled())
        return given_up();
    const PackImage& image = scene_->pack.image;
    closest_ = std::make_unique<ClosestReference>(image);
    const Result<bool> rearranged = arrangement_->change_to(image, options.look.arrangement);
    if (!rearranged.ok())
        return rearranged.error();
    if (const PlacementView placed = arrangement_->view(image); *rearranged)
        closest_->place(placed.instances, placed.visible);
    const bool whole = each_pixel(
        width_, height_, options.cancelled,
        [&](size_t i) {
            const ReferenceHit hit = closest_->closest(ray_at(i, 0, 0));
            if (!hit.hit)
                return;
            depth_mm_[i] = hit.distance_mm;
            face_[i] = int32_t(hit.face);
            instance_[i] = int32_t(hit.instance);
        },
        [&](uint32_t rows_done) {
            if (progress)
                progress(double(rows_done) / height_);
        });
    if (!whole)
        return given_up();
    return Done{};
}

Status ViewReference::trace_best(const RenderOptions& options)
{
    RenderOptions best;
    best.width = width_;
    best.height = height_;
    best.camera = options.camera;
    best.trim = TrimMode::Exact;
    best.error_px = kBestErrorPx;
    best.shade = false;
    best.threads = options.threads;
    best.cancelled = options.cancelled;
    best.look.section = options.look.section;
    best.look.arrangement = options.look.arrangement;
    const Result<std::unique_ptr<Tracer>> tracer = make_cpu_tracer(scene_);
    if (!tracer.ok())
        return tracer.error();
    RenderStats stats;
    Result<Frame> frame = (*tracer)->render(best, stats);
    if (!frame.ok())
        return frame.error();
    std::copy(frame->depth_mm.begin(), frame->depth_mm.end(), depth_mm_.begin());
    face_ = std::move(frame->face);
    instance_ = std::move(frame->instance);
    return Done{};
}

/// The ray through (x, y) from pixel i's middle.
reference::Ray ViewReference::ray_at(size_t i, double x, double y) const
{
    return rays_.through(double(i % width_) + 0.5 + x, double(i / width_) + 0.5 + y);
}

/// A pixel's width where pixel i hits, world mm. Domain: it hits.
double ViewReference::footprint_mm(size_t i) const
{
    return rays_.footprint_mm(double(i % width_) + 0.5, double(i / width_) + 0.5, depth_mm_[i]);
}

/// The worst of what rays a hair beside the pixel's middle make of the answer there.
PixelVerdict ViewReference::changes_within_a_hair(size_t i) const
{
    constexpr int kDirections = 8;
    const bool hits = std::isfinite(depth_mm_[i]);
    PixelVerdict worst = PixelVerdict::Right;
    for (int k = 0; k < kDirections; ++k) {
        const double angle = 2 * std::numbers::pi * k / kDirections;
        const ReferenceHit beside = closest_->closest(ray_at(i, kHairPx * std::cos(angle), kHairPx * std::sin(angle)));
        if (beside.hit != hits || (hits && std::abs(beside.distance_mm - depth_mm_[i]) > kWrongDepth * footprint_mm(i)))
            return PixelVerdict::Wrong;
        if (hits && (int32_t(beside.face) != face_[i] || int32_t(beside.instance) != instance_[i]))
            worst = PixelVerdict::OtherFace;
    }
    return worst;
}

/// Whether the face that the frame shows lies at the reference's depth too. Domain: both hit.
bool ViewReference::is_tie(const Frame& frame, size_t i) const
{
    const PackImage& image = scene_->pack.image;
    if (size_t(frame.instance[i]) >= image.instances.size() || size_t(frame.face[i]) >= image.faces.size())
        return false; // a cap of a section, or something that is not the pack's
    const ReferenceHit other = closest_->closest_of(ray_at(i, 0, 0), uint(frame.instance[i]), uint(frame.face[i]));
    return other.hit && std::abs(other.distance_mm - depth_mm_[i]) <= kHairPx * footprint_mm(i);
}

PixelVerdict ViewReference::verdict(const Frame& frame, size_t i, double depth_px)
{
    const double depth_mm = double(frame.depth_mm[i]), right_mm = depth_mm_[i];
    const bool hits = std::isfinite(depth_mm), right_hits = std::isfinite(right_mm);
    if (!hits && !right_hits)
        return PixelVerdict::Right;
    const bool is_wrong = hits != right_hits || std::abs(depth_mm - right_mm) > depth_px * footprint_mm(i);
    if (!is_wrong && frame.face[i] == face_[i] && frame.instance[i] == instance_[i])
        return PixelVerdict::Right;
    const PixelVerdict verdict = is_wrong ? PixelVerdict::Wrong : PixelVerdict::OtherFace;
    if (!in_double_)
        return verdict;
    if (asked_[i] == 0) {
        beside_[i] = changes_within_a_hair(i);
        asked_[i] = 1;
    }
    const bool is_open =
        is_wrong ? beside_[i] == PixelVerdict::Wrong : beside_[i] != PixelVerdict::Right || is_tie(frame, i);
    return is_open ? PixelVerdict::Open : verdict;
}

Result<std::vector<PixelVerdict>> ViewReference::verdicts(const Frame& frame, double depth_px,
                                                          const std::function<bool()>& cancelled)
{
    assert(frame.width == width_ && frame.height == height_ && "a frame of the same view");
    std::vector<PixelVerdict> all(depth_mm_.size(), PixelVerdict::Right);
    if (!each_pixel(width_, height_, cancelled, [&](size_t i) { all[i] = verdict(frame, i, depth_px); }))
        return given_up();
    return all;
}

Result<ViewErrors> ViewReference::errors(const Frame& frame, const std::function<bool()>& cancelled)
{
    const Result<std::vector<PixelVerdict>> judged = verdicts(frame, kWrongDepth, cancelled);
    if (!judged.ok())
        return judged.error();
    ViewErrors errors;
    errors.pixels = judged->size();
    std::vector<double> depth_mm, depth_px;
    double sum_px = 0;
    for (size_t i = 0; i < judged->size(); ++i) {
        const PixelVerdict verdict = (*judged)[i];
        errors.wrong += verdict == PixelVerdict::Wrong;
        errors.other_face += verdict == PixelVerdict::OtherFace;
        errors.open += verdict == PixelVerdict::Open;
        errors.uncertified += frame.certified[i] == 0;
        if (verdict == PixelVerdict::Open)
            continue;
        const bool both_hit = std::isfinite(frame.depth_mm[i]) && std::isfinite(depth_mm_[i]);
        double error_px = verdict == PixelVerdict::OtherFace || (verdict == PixelVerdict::Wrong && !both_hit) ? 1 : 0;
        if (both_hit) {
            depth_mm.push_back(std::abs(double(frame.depth_mm[i]) - depth_mm_[i]));
            depth_px.push_back(depth_mm.back() / footprint_mm(i));
            error_px = std::max(error_px, std::min(depth_px.back(), 1.0));
        }
        sum_px += error_px;
    }
    errors.depth_mm = spread(std::move(depth_mm));
    errors.depth_px = spread(std::move(depth_px));
    errors.mean_error_px = errors.pixels > 0 ? sum_px / double(errors.pixels) : 0;
    return errors;
}

} // namespace trimray
