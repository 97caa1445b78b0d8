#define TRIMRAY_ONE_RAY // the shared formulas for one ray, not for packets
#include "runtime/measure/one_ray_tracer.h"

#include "runtime/effect_plan.h"
#include "runtime/eye_side.h"
#include "runtime/frame_effects.h"
#include "runtime/frame_size.h"
#include "runtime/measure/one_ray_pixels.h"
#include "runtime/measure/one_ray_walk.h"
#include "runtime/stochastic_frames.h"
#include "runtime/timed_frames.h"

#include <algorithm>
#include <utility>

#include <tbb/enumerable_thread_specific.h>

namespace trimray {
namespace {

constexpr uint32_t kOneRayLook = kLookOrthographic; // LookBit
constexpr uint32_t kTileSide = 32;                  // pixels: neighbours' rays meet the same patches

/// What a thread keeps from tile to tile.
struct Scratch {
    one_ray::SeenPatches seen;
    WorkCounts work;
};

class OneRayTracer final : public Tracer {
public:
    explicit OneRayTracer(std::shared_ptr<const Scene> scene)
        : scene_(std::move(scene)), cpu_scene_(prepared(*scene_)), opened_(cpu_scene_->image)
    {
    }

    DeviceKind device_kind() const override { return DeviceKind::Cpu; }
    std::string device_name() const override { return "CPU, one ray at a time"; }

    Result<Frame> render(const RenderOptions& options, RenderStats& stats) override
    {
        if (const Status possible = check(options); !possible.ok())
            return possible.error();
        const Result<KdTrims>& kd = cpu_scene_->kd_trims();
        if (!kd.ok())
            return kd.error();
        stats = RenderStats{};
        stats.device = device_name();
        stats.trim = TrimMode::Kd;
        stats.kd_bytes = kd->size_bytes();
        Frame frame;
        resize(frame, options.width, options.height);
        kept_.assign(keeps_hits(options) ? frame.depth_mm.size() : 0, one_ray::NearestHit{});
        stats.buffer_bytes = stats.kd_bytes + opened_.size_bytes() + kept_.size() * sizeof(one_ray::NearestHit);
        time_frames(options, stats, [&](uint32_t number, const RunEach& run_each) {
            return render_once(options, *kd, number, run_each, frame);
        });
        return frame;
    }

private:
    static Status check(const RenderOptions& options)
    {
        const auto refusal = [](const char* detail) { return Error{ErrorCode::Usage, "the one-ray tracer", detail}; };
        if (const Status possible = check_size(options); !possible.ok())
            return possible;
        if (has_effects(options))
            return refusal("draws no lines and smooths no borders; leave out --edges, --silhouettes, --style and "
                           "--antialias");
        if (const Status done = check_look(options, kOneRayLook, "one-ray"); !done.ok())
            return done;
        if (options.closest != ClosestPolicy::Stochastic)
            return refusal("searches a leaf from one start and certifies nothing; --closest must be stochastic");
        if (options.trim != TrimMode::Auto && options.trim != TrimMode::Kd)
            return refusal("asks kd-trees about trims; --trim must be auto or kd");
        return Done{};
    }

    WorkCounts render_once(const RenderOptions& options, const KdTrims& kd, uint32_t frame_number,
                           const RunEach& run_each, Frame& frame)
    {
        const PackImage& image = cpu_scene_->image;
        View view =
            make_view(image, camera_rays(options.camera, options.width, options.height), options.width, options.height);
        const std::vector<uint8_t> outside = seen_from_outside(*cpu_scene_, image, options.camera.eye);
        for (size_t i = 0; i < outside.size(); ++i)
            view.instances[i].outside = outside[i] != 0;
        const auto [start_u, start_v] = start_of_frame(frame_number);
        one_ray::FrameJob job{*cpu_scene_,
                              view,
                              opened_,
                              {},
                              one_ray::tree_view(world_view(view), view.tau_ref),
                              one_ray::fetch_source(image, &kd),
                              options.error_px,
                              {start_u, start_v}};
        job.part_views.reserve(view.instances.size());
        for (const InstanceView& instance : view.instances)
            job.part_views.push_back(one_ray::tree_view(instance, view.tau_ref));
        for (Scratch& scratch : scratch_) {
            scratch.seen.clear();
            scratch.work = {};
        }
        const uint32_t columns = (options.width + kTileSide - 1) / kTileSide,
                       rows = (options.height + kTileSide - 1) / kTileSide;
        run_each(columns * rows, [&](uint32_t i) {
            trace_tile(options, job, i % columns * kTileSide, i / columns * kTileSide, frame);
        });
        WorkCounts sum;
        for (const Scratch& scratch : scratch_)
            sum += scratch.work;
        sum.uncertified_pixels = sum.rays;
        return sum;
    }

    void trace_tile(const RenderOptions& options, const one_ray::FrameJob& job, uint32_t x0, uint32_t y0, Frame& frame)
    {
        Scratch& scratch = scratch_.local();
        one_ray::RayTracer tracer(job, scratch.seen, scratch.work);
        const float middle_x = 0.5f * float(options.width), middle_y = 0.5f * float(options.height);
        const uint32_t x1 = std::min(x0 + kTileSide, options.width), y1 = std::min(y0 + kTileSide, options.height);
        for (uint32_t y = y0; y < y1; ++y) {
            for (uint32_t x = x0; x < x1; ++x) {
                const one_ray::Pixel at{float(x) + 0.5f - middle_x, float(y) + 0.5f - middle_y};
                const size_t pixel = size_t{y} * options.width + x;
                one_ray::NearestHit* const kept = kept_.empty() ? nullptr : &kept_[pixel];
                const one_ray::NearestHit hit = tracer.trace(at, kept);
                if (kept)
                    *kept = hit;
                if (hit.past < one_ray::kHuge)
                    write_hit(job, at, hit, options.shade, pixel, frame);
                else
                    one_ray::write_miss(pixel, frame);
            }
        }
    }

    std::shared_ptr<const Scene> scene_;
    std::shared_ptr<const CpuScene> cpu_scene_;
    one_ray::OpenedScene opened_;
    tbb::enumerable_thread_specific<Scratch> scratch_;
    std::vector<one_ray::NearestHit> kept_; // by pixel, where the picture at hand is made in several frames
};

} // namespace

std::unique_ptr<Tracer> make_one_ray_tracer(std::shared_ptr<const Scene> scene)
{
    return std::make_unique<OneRayTracer>(std::move(scene));
}

} // namespace trimray
