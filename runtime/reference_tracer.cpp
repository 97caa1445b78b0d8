// The reference for closest hits as a tracer: one ray a pixel in double, every AOV, no effects. Slow; what pictures of
// the other tracers are compared with.
#include "format/closest_reference.h"
#include "runtime/arrangement.h"
#include "runtime/effect_plan.h"
#include "runtime/frame_effects.h"
#include "runtime/frame_size.h"
#include "runtime/image_io.h"
#include "runtime/reference_rays.h"
#include "runtime/tracer.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <limits>
#include <mutex>
#include <utility>

#include <fmt/format.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace trimray {
namespace {

using reference::dot;
using reference::length;
using reference::Vec3;
using reference::operator*;

constexpr uint32_t kLookDone = kLookOrthographic | kLookArrangement; // LookBit
constexpr uint kDefaultColor = 0xffb4b0acu;                          // of what has none, sRGB

/// The colour of a hit, linear light: what shaders/shared/shading.h computes, written anew in double.
Vec3 shaded(uint rgba, const Vec3& normal, const Vec3& to_eye)
{
    constexpr double kAmbient = 0.14, kSky = 0.10, kDiffuse = 0.72, kSpecular = 0.12;
    const double cosine = dot(normal, to_eye), facing = std::min(std::abs(cosine), 1.0);
    const double up = cosine < 0 ? -normal[2] : normal[2];
    const double light = kAmbient + kSky * (0.5 + 0.5 * up) + kDiffuse * facing;
    const double highlight = kSpecular * std::pow(facing, 32);
    Vec3 out;
    for (size_t i = 0; i < 3; ++i)
        out[i] = double(srgb_to_linear(float(rgba >> 8 * i & 0xffu) / 255)) * light + highlight;
    return out;
}

class ReferenceTracer final : public Tracer {
public:
    explicit ReferenceTracer(std::shared_ptr<const Scene> scene)
        : scene_(std::move(scene)), closest_(scene_->pack.image)
    {
    }

    DeviceKind device_kind() const override { return DeviceKind::Reference; }
    std::string device_name() const override { return "reference"; }

    Result<Frame> render(const RenderOptions& options, RenderStats& stats) override
    {
        if (const Status possible = check_size(options); !possible.ok())
            return possible.error();
        if (has_effects(options))
            return Error{ErrorCode::Usage, "--device reference",
                         "draws no lines and smooths no borders; leave out --edges, --silhouettes, --style and "
                         "--antialias, or use --device cpu"};
        if (const Status done = check_look(options, kLookDone, "reference"); !done.ok())
            return done.error();
        if (options.closest == ClosestPolicy::Stochastic)
            return Error{ErrorCode::Usage, "--device reference", "draws no starts; --closest must be certified"};
        if (options.trim == TrimMode::Sdf || options.trim == TrimMode::Hybrid || options.trim == TrimMode::Kd)
            return Error{ErrorCode::Usage, "--device reference",
                         "counts crossings of the trims' pieces and reads nothing else; --trim must be auto or exact"};
        const PackImage& image = scene_->pack.image;
        const Result<bool> rearranged = arrangement_.change_to(image, options.look.arrangement);
        if (!rearranged.ok())
            return rearranged.error();
        if (const PlacementView placed = arrangement_.view(image); *rearranged)
            closest_.place(placed.instances, placed.visible);
        stats.device = device_name();
        stats.trim = TrimMode::Reference;
        stats.kd_bytes = stats.border_bytes = 0;
        stats.frame_ms.clear();
        stats.frame_cpu_ms.clear();
        stats.trim_queries.clear();
        Frame frame;
        resize(frame, options.width, options.height);
        tbb::task_arena arena(options.threads > 0 ? int(std::min(options.threads, 1024u))
                                                  : tbb::info::default_concurrency());
        for (uint32_t i = 0; i < std::max(options.frames, 1u); ++i) {
            const auto start = std::chrono::steady_clock::now();
            arena.execute([&] { trace(options, stats.work, frame); });
            const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - start;
            stats.frame_ms.push_back(spent.count());
        }
        return frame;
    }

private:
    void trace(const RenderOptions& options, WorkCounts& work, Frame& frame) const
    {
        const ReferenceRays rays(options.camera, options.width, options.height);
        std::atomic<uint64_t> patches{0}, uncertified{0};
        std::mutex telling;
        uint32_t rows_done = 0;
        tbb::parallel_for(0u, options.height, [&](uint32_t y) {
            for (uint32_t x = 0; x < options.width; ++x) {
                const reference::Ray ray = rays.through(x + 0.5, y + 0.5);
                const ReferenceHit hit = closest_.closest(ray);
                write(options, ray, hit, size_t(y) * options.width + x, frame);
                patches.fetch_add(hit.patches, std::memory_order_relaxed);
                uncertified.fetch_add(hit.open || hit.contact, std::memory_order_relaxed);
            }
            const std::lock_guard lock(telling);
            ++rows_done;
            if (options.progress)
                options.progress(double(rows_done) / options.height);
        });
        work = WorkCounts{};
        work.rays = uint64_t(options.width) * options.height;
        work.leaf_visits = patches; // whole patches: it has no leaves
        work.uncertified_pixels = uncertified;
    }

    void write(const RenderOptions& options, const reference::Ray& ray, const ReferenceHit& hit, size_t pixel,
               Frame& frame) const
    {
        frame.certified[pixel] = !hit.open && !hit.contact;
        if (!hit.hit) { // the frame is new: zeros elsewhere
            frame.depth_mm[pixel] = std::numeric_limits<float>::infinity();
            frame.face[pixel] = frame.instance[pixel] = -1;
            return;
        }
        const Vec3 to_eye = ray.direction * (-1 / length(ray.direction));
        const Vec3 normal = dot(hit.normal, hit.normal) > 0 ? hit.normal : to_eye;
        const PackImage& image = scene_->pack.image;
        const uint of_instance = image.instances[hit.instance].color_rgba;
        const FaceRecord& face = image.faces[hit.face];
        const uint rgba = (face.flags & kFaceHasColor) != 0 ? face.color_rgba
                          : of_instance >> 24 != 0          ? of_instance
                                                            : kDefaultColor;
        const Vec3 color = options.shade ? shaded(rgba, normal, to_eye) : Vec3{};
        for (size_t i = 0; i < 3; ++i) {
            frame.rgba[4 * pixel + i] = float(color[i]);
            frame.normal[3 * pixel + i] = float(normal[i]);
        }
        frame.rgba[4 * pixel + 3] = 1;
        frame.depth_mm[pixel] = float(hit.distance_mm);
        for (size_t i = 0; i < 2; ++i)
            frame.uv[2 * pixel + i] = float(hit.uv_file[i]);
        frame.face[pixel] = int32_t(hit.face);
        frame.instance[pixel] = int32_t(hit.instance);
    }

    std::shared_ptr<const Scene> scene_;
    ClosestReference closest_; // its placements are the arrangement's
    KeptArrangement arrangement_;
};

} // namespace

std::unique_ptr<Tracer> make_reference_tracer(std::shared_ptr<const Scene> scene)
{
    return std::make_unique<ReferenceTracer>(std::move(scene));
}

} // namespace trimray
