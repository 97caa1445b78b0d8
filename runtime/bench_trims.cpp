#include "runtime/bench_trims.h"

#include "runtime/bench_turns.h"
#include "runtime/bench_view.h"
#include "runtime/command_json.h"
#include "runtime/command_trace.h"
#include "runtime/cpu_lanes.h"
#include "runtime/derived_scene.h"
#include "runtime/median.h"
#include "runtime/thread_clock.h"
#include "runtime/trim_mode.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

namespace trimray {
namespace {

/// A setting ready to trace. The textures' settings have copies of the pack, with those textures in it.
struct Contestant {
    TrimSetting setting;
    std::shared_ptr<const Scene> scene;
    std::unique_ptr<Tracer> tracer;
};

Result<std::vector<Contestant>> make_contestants(const std::shared_ptr<const Scene>& scene,
                                                 const TrimBenchOptions& options)
{
    const Result<KdTrims>& kd = scene->prepared->kd_trims();
    if (!kd.ok())
        return kd.error();
    const double kd_bytes = static_cast<double>(kd->size_bytes());
    std::vector<Contestant> contestants;
    for (const TrimSetting& setting : trim_settings(options.memories)) {
        Contestant c;
        c.setting = setting;
        c.scene = scene;
        if (setting.has_textures()) {
            // sdf and hybrid read the same textures
            const auto same = std::find_if(contestants.begin(), contestants.end(), [&](const Contestant& other) {
                return other.setting.has_textures() && other.setting.memory == setting.memory &&
                       other.setting.textures.source == setting.textures.source &&
                       other.setting.textures.layout == setting.textures.layout;
            });
            c.scene = same != contestants.end() ? same->scene
                                                : with_textures(*scene, setting.textures, setting.memory * kd_bytes);
        }
        Result<std::unique_ptr<Tracer>> tracer = make_cpu_tracer(c.scene, options.instruction_set);
        if (!tracer.ok())
            return tracer.error();
        c.tracer = std::move(*tracer);
        contestants.push_back(std::move(c));
    }
    return contestants;
}

uint64_t trim_bytes(const Contestant& contestant)
{
    const MemoryBytes bytes = memory_bytes(contestant.scene->pack.image);
    switch (contestant.setting.mode) {
    case TrimMode::Kd: // the tracer has built them
        return contestant.scene->prepared->kd_trims()->size_bytes();
    case TrimMode::Sdf:
        return bytes.trim_sdf;
    case TrimMode::Hybrid:
        return bytes.trim_exact + bytes.trim_sdf;
    default:
        return bytes.trim_exact;
    }
}

/// The queries of a picture: those that are asked, and how the modes answer them.
class QueryLoop {
public:
    QueryLoop(std::vector<TrimQueries> queries, AnswerTrims answer)
        : queries_(std::move(queries)), inside_(queries_.size()), answer_(answer)
    {
        for (const TrimQueries& q : queries_)
            asked_ += static_cast<uint64_t>(std::popcount(q.asked));
    }

    /// Seconds to answer all of them once, and how many answers are wrong.
    std::pair<double, uint64_t> run(const CpuScene& scene, TrimMode mode)
    {
        const double start = thread_cpu_seconds();
        answer_(scene, mode, queries_, inside_);
        const double spent = thread_cpu_seconds() - start;
        uint64_t wrong = 0;
        for (size_t i = 0; i < queries_.size(); ++i)
            wrong += static_cast<uint64_t>(std::popcount((inside_[i] ^ queries_[i].inside) & queries_[i].asked));
        return {spent, wrong};
    }

    uint64_t asked() const { return asked_; }

private:
    std::vector<TrimQueries> queries_;
    std::vector<uint16_t> inside_;
    AnswerTrims answer_;
    uint64_t asked_ = 0;
};

/// What the rounds time of one setting.
struct Times {
    std::vector<double> frame_ms;
    double query_seconds = std::numeric_limits<double>::infinity(); // least
};

/// Traces the reference's picture and takes its queries.
Result<Frame> trace_reference(Tracer& tracer, RenderOptions render, std::vector<TrimQueries>& queries)
{
    render.trim = TrimMode::Reference;
    render.threads = 1; // queries come in one thread's order
    render.record_trim_queries = true;
    RenderStats stats;
    Result<Frame> frame = tracer.render(render, stats);
    queries = std::move(stats.trim_queries);
    return frame;
}

Result<TrimView> measure_view(const std::string& name, const Camera& camera, const TrimReference& reference,
                              const std::vector<Contestant>& contestants, const TrimBenchOptions& options,
                              const std::function<void(const std::string&)>& progress)
{
    RenderOptions render = picture_options(options, camera);
    render.frames = 2; // the first fetches what the second finds in the caches
    progress(fmt::format("{}: reference", name));
    std::vector<TrimQueries> asked;
    const Result<Frame> right = trace_reference(*contestants.front().tracer, render, asked);
    if (!right.ok())
        return right.error();
    QueryLoop queries(std::move(asked), find_answer_trims(options.instruction_set));

    const CameraRays rays = camera_rays(camera, options.width, options.height);
    const size_t count = contestants.size();
    TrimView view{name, camera, std::vector<TrimFigures>(count)};
    std::vector<Times> times(count);
    const Status timed = take_turns(options.rounds, count, [&](uint32_t round, size_t i) -> Status {
        const Contestant& contestant = contestants[i];
        progress(fmt::format("{}: round {} of {}", name, round + 1, options.rounds));
        render.trim = contestant.setting.mode;
        render.edges = contestant.setting.edges ? EdgeLines::Sharp : EdgeLines::None;
        RenderStats stats;
        const Result<Frame> frame = contestant.tracer->render(render, stats);
        if (!frame.ok())
            return frame.error();
        times[i].frame_ms.push_back(frame_times(stats).back());
        const auto [seconds, wrong] = queries.run(*contestant.scene->prepared, contestant.setting.mode);
        times[i].query_seconds = std::min(times[i].query_seconds, seconds);
        view.figures[i].wrong_queries = wrong;
        view.figures[i].bytes = trim_bytes(contestant) + stats.border_bytes;
        if (round == 0)
            view.figures[i].errors = trim_errors(contestant.scene->pack.image, reference, rays, *frame, *right);
        if (contestant.setting.edges) // the reference's picture has none
            view.figures[i].errors.psnr_db = std::numeric_limits<double>::quiet_NaN();
        return Done{};
    });
    if (!timed.ok())
        return timed.error();
    for (size_t i = 0; i < count; ++i) {
        TrimFigures& figures = view.figures[i];
        figures.setting = contestants[i].setting;
        figures.frame_ms = median(times[i].frame_ms);
        figures.speed_to_kd = median(time_ratios(times[0].frame_ms, times[i].frame_ms));
        figures.queries = queries.asked();
        figures.ns_per_query =
            times[i].query_seconds * 1e9 / static_cast<double>(std::max<uint64_t>(queries.asked(), 1));
    }
    return view;
}

} // namespace

std::vector<TrimSetting> trim_settings(const std::vector<double>& memories)
{
    std::vector<TrimSetting> settings;
    settings.push_back({TrimMode::Kd, {}, 0, false});
    settings.push_back({TrimMode::Exact, {}, 0, false});
    settings.push_back({TrimMode::Exact, {}, 0, true});
    for (const TrimMode mode : {TrimMode::Hybrid, TrimMode::Sdf})
        for (const TrimSource source : {TrimSource::Curve, TrimSource::Mask})
            for (const TrimLayout layout : {TrimLayout::Isotropic, TrimLayout::Square})
                for (const double memory : memories)
                    settings.push_back({mode, {source, layout}, memory, false});
    return settings;
}

Result<TrimReport> bench_trims(const std::shared_ptr<const Scene>& scene, const TrimBenchOptions& options,
                               const std::function<void(const std::string&)>& progress)
{
    progress("making textures");
    const Result<std::vector<Contestant>> contestants = make_contestants(scene, options);
    if (!contestants.ok())
        return contestants.error();
    const TrimReference reference(scene->pack.image);
    TrimReport report{contestants->front().tracer->device_name(), {}};
    for (const std::string& name : options.views) {
        const Result<Camera> camera = bench_view(name, scene, options.width, options.height, options.magnification);
        if (!camera.ok())
            return camera.error();
        Result<TrimView> view = measure_view(name, *camera, reference, *contestants, options, progress);
        if (!view.ok())
            return view.error();
        report.views.push_back(std::move(*view));
    }
    return report;
}

} // namespace trimray
