#include "runtime/bench_moving.h"

#include "runtime/command_trace.h"
#include "runtime/differing_pixels.h"
#include "runtime/median.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

namespace trimray {
namespace {

/// The camera turned about its target, around its up. Source: Rodrigues' rotation formula.
Camera turned(Camera camera, double degrees)
{
    const double angle = degrees * std::numbers::pi / 180, cosine = std::cos(angle), sine = std::sin(angle);
    std::array<double, 3> k = camera.up, v;
    const double length = std::hypot(k[0], k[1], k[2]);
    double along = 0;
    for (size_t i = 0; i < 3; ++i) {
        k[i] /= length;
        v[i] = camera.eye[i] - camera.target[i];
        along += k[i] * v[i];
    }
    // v cos + (k x v) sin + k (k . v) (1 - cos)
    for (size_t i = 0; i < 3; ++i) {
        const size_t j = (i + 1) % 3, l = (i + 2) % 3;
        camera.eye[i] =
            camera.target[i] + v[i] * cosine + (k[j] * v[l] - k[l] * v[j]) * sine + k[i] * along * (1 - cosine);
    }
    return camera;
}

/// Those of all pictures made in one way.
struct Pictures {
    std::vector<double> ms;
    WorkCounts work;

    void add(const RenderStats& stats)
    {
        ms.push_back(stats.frame_ms.back());
        work += stats.work;
    }
    MovingFigures figures() const
    {
        const auto a_ray = [&](uint64_t count) { return double(count) / double(work.rays); };
        return {median(ms), a_ray(work.node_visits), a_ray(work.leaf_visits), a_ray(work.newton_steps)};
    }
};

} // namespace

Result<MovingReport> bench_moving(const std::shared_ptr<const Scene>& scene, const MovingBenchOptions& options,
                                  const std::function<void(const std::string&)>& progress)
{
    progress("making the tracer");
    std::string note;
    const Result<std::unique_ptr<Tracer>> tracer = make_tracer(scene, options.device, note);
    if (!tracer.ok())
        return tracer.error();
    const Result<Camera> camera = camera_of({}, scene->pack.image, options.width, options.height);
    if (!camera.ok())
        return camera.error();
    RenderOptions render;
    render.width = options.width;
    render.height = options.height;
    render.camera = *camera;
    render.reuse_last = true;
    RenderStats stats;
    if (const Result<Frame> first = (*tracer)->render(render, stats); !first.ok())
        return first.error();

    MovingReport report;
    report.device = (*tracer)->device_name();
    report.camera = *camera;
    std::array<Pictures, 2> ways; // without reuse, with it
    std::vector<double> speedups;
    render.frames = 2; // the first fetches what the second finds in the caches
    for (uint32_t picture = 1; picture <= options.pictures; ++picture) {
        progress(fmt::format("picture {} of {}", picture, options.pictures));
        render.camera = turned(*camera, picture * options.degrees);
        std::array<Frame, 2> frames;
        for (size_t turn = 0; turn < 2; ++turn) {
            const size_t way = (turn + picture) % 2;
            render.reuse_last = way == 1;
            Result<Frame> frame = (*tracer)->render(render, stats);
            if (!frame.ok())
                return frame.error();
            if (render.reuse_last && !stats.reused_last)
                return Error{ErrorCode::UnsupportedFormat, "--device",
                             fmt::format("{} reuses nothing: packets of rays meet leaves in the order of their nearest "
                                         "points, so that no earlier hit spares them one; use --device vulkan",
                                         report.device)};
            frames[way] = std::move(*frame);
            ways[way].add(stats);
        }
        report.differing_pixels += differing_pixels(frames[0], frames[1]);
        speedups.push_back(ways[0].ms.back() / ways[1].ms.back());
    }
    report.plain = ways[0].figures();
    report.reusing = ways[1].figures();
    report.speedup = median(std::move(speedups));
    return report;
}

} // namespace trimray
