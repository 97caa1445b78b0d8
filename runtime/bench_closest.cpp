#include "runtime/bench_closest.h"

#include "runtime/bench_turns.h"
#include "runtime/bench_view.h"
#include "runtime/command_trace.h"
#include "runtime/derived_scene.h"
#include "runtime/median.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace trimray {
namespace {

/// The tracers of the pack as it is and with one leaf a patch.
struct Tracers {
    std::unique_ptr<Tracer> pack, one_leaf;
    Tracer& with(bool one) const { return one ? *one_leaf : *pack; }
};

Result<Tracers> make_tracers(const std::shared_ptr<const Scene>& scene, const std::string& instruction_set)
{
    Tracers tracers;
    for (const bool one : {false, true}) {
        Result<std::unique_ptr<Tracer>> made =
            make_cpu_tracer(one ? with_leaf_budget(*scene, 1) : scene, instruction_set);
        if (!made.ok())
            return made.error();
        (one ? tracers.one_leaf : tracers.pack) = std::move(*made);
    }
    return tracers;
}

/// What the rounds compare: one frame each.
struct Way {
    ClosestPolicy policy;
    bool one_leaf;
};
constexpr Way kWays[] = {
    {ClosestPolicy::Stochastic, true}, {ClosestPolicy::Stochastic, false}, {ClosestPolicy::Certified, false}};
constexpr size_t kPlain = 1, kCertified = 2, kWayCount = std::size(kWays);

/// Milliseconds of each way in each round.
Result<std::vector<std::vector<double>>> time_first_frames(const Tracers& tracers, RenderOptions render,
                                                           const ClosestBenchOptions& options)
{
    std::vector<std::vector<double>> ms(kWayCount);
    render.frames = 1;
    const Status timed = take_turns(options.rounds, kWayCount, [&](uint32_t, size_t which) -> Status {
        render.closest = kWays[which].policy;
        RenderStats stats;
        for (int warm = 0; warm < 2; ++warm) { // the first fetches what the second finds in the caches
            const Result<Frame> frame = tracers.with(kWays[which].one_leaf).render(render, stats);
            if (!frame.ok())
                return frame.error();
        }
        ms[which].push_back(frame_times(stats).back());
        return Done{};
    });
    if (!timed.ok())
        return timed.error();
    return ms;
}

Result<ClosestFigures> measure_picture(Tracer& tracer, RenderOptions render, bool one_leaf, ReferencePicture& reference)
{
    RenderStats stats;
    const Result<Frame> frame = tracer.render(render, stats);
    if (!frame.ok())
        return frame.error();
    ClosestFigures figures;
    figures.policy = render.closest;
    figures.one_leaf = one_leaf;
    figures.frames = render.frames;
    figures.frame_ms = median(frame_times(stats));
    figures.newton_steps = double(stats.work.newton_steps) / double(stats.work.rays);
    figures.errors = reference.errors(*frame);
    return figures;
}

Result<ClosestView> measure_view(const std::string& name, const Camera& camera,
                                 const std::shared_ptr<const Scene>& scene, const Tracers& tracers,
                                 const ClosestBenchOptions& options,
                                 const std::function<void(const std::string&)>& progress)
{
    RenderOptions render = picture_options(options, camera);
    render.trim = TrimMode::Exact;
    progress(fmt::format("{}: reference", name));
    Result<ReferencePicture> reference = ReferencePicture::make(scene, render);
    if (!reference.ok())
        return reference.error();
    progress(fmt::format("{}: {} rounds", name, options.rounds));
    const Result<std::vector<std::vector<double>>> ms = time_first_frames(tracers, render, options);
    if (!ms.ok())
        return ms.error();

    ClosestView view{name, camera, 0, {}};
    view.certified_cost = median(time_ratios((*ms)[kCertified], (*ms)[kPlain]));
    for (size_t which = 0; which < kWayCount; ++which) {
        const auto [policy, one_leaf] = kWays[which];
        const bool certified = policy == ClosestPolicy::Certified;
        render.closest = policy;
        const size_t first = view.figures.size();
        for (const uint32_t frames : certified ? std::vector<uint32_t>{1} : options.frames) {
            progress(
                fmt::format("{}: {}", name, certified ? "certified" : fmt::format("{} stochastic frames", frames)));
            render.frames = frames;
            const Result<ClosestFigures> figures =
                measure_picture(tracers.with(one_leaf), render, one_leaf, *reference);
            if (!figures.ok())
                return figures.error();
            view.figures.push_back(*figures);
        }
        const double longest_ms = view.figures.back().frame_ms;
        for (size_t i = first; i < view.figures.size(); ++i)
            view.figures[i].frame_ms = view.figures[i].frames == 1 ? median((*ms)[which]) : longest_ms;
    }
    return view;
}

} // namespace

Result<ClosestReport> bench_closest(const std::shared_ptr<const Scene>& scene, const ClosestBenchOptions& options,
                                    const std::function<void(const std::string&)>& progress)
{
    progress("making tracers");
    const Result<Tracers> tracers = make_tracers(scene, options.instruction_set);
    if (!tracers.ok())
        return tracers.error();
    const PackImage& image = scene->pack.image;
    const auto is_bezier = [](const PatchRecord& patch) { return (patch.shape & 0xffu) == kKindBezier; };
    ClosestReport report;
    report.device = tracers->pack->device_name();
    report.patches = uint64_t(std::count_if(image.patches.begin(), image.patches.end(), is_bezier));
    report.leaves = uint64_t(std::count_if(image.leaves.begin(), image.leaves.end(), [&](const LeafRecord& leaf) {
        return is_bezier(image.patches[leaf.patch]);
    }));
    for (const std::string& name : options.views) {
        SceneCamera asked;
        asked.view = name;
        const Result<Camera> camera = camera_of(asked, image, options.width, options.height);
        if (!camera.ok())
            return Error{ErrorCode::Usage, "--views", camera.error().detail};
        Result<ClosestView> view = measure_view(name, *camera, scene, *tracers, options, progress);
        if (!view.ok())
            return view.error();
        report.views.push_back(std::move(*view));
    }
    return report;
}

} // namespace trimray
