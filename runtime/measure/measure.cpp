#include "runtime/measure/measure.h"

#include "runtime/bench_view.h"
#include "runtime/command_json.h"
#include "runtime/command_trace.h"
#include "runtime/cpu_view.h"
#include "runtime/derived_scene.h"
#include "runtime/measure/ssim.h"
#include "runtime/median.h"
#include "runtime/psnr.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

namespace trimray {
namespace {

/// The pack as a setting has it.
std::shared_ptr<const Scene> scene_of(const std::shared_ptr<const Scene>& scene, const AccuracySetting& setting,
                                      double kd_bytes)
{
    if (setting.cut) {
        LeafOptions leaves = scene->pack.image.leaf_options;
        setting.cut(leaves);
        return with_leaves(*scene, leaves);
    }
    if (setting.trims && setting.trims->has_textures())
        return with_textures(*scene, setting.trims->textures, setting.trims->memory * kd_bytes);
    return scene;
}

/// Of one picture, its frames together.
double picture_ms(const RenderStats& stats)
{
    const std::vector<double>& ms = stats.frame_cpu_ms.empty() ? stats.frame_ms : stats.frame_cpu_ms;
    return std::accumulate(ms.begin(), ms.end(), 0.0);
}

struct Made {
    Frame frame;
    RenderStats stats;
};

Result<Made> make_picture(const Contender& contender, RenderOptions render)
{
    contender.ask(render);
    Made made;
    Result<Frame> frame = trace_picture(*contender.tracer, render, contender.samples, made.stats);
    if (!frame.ok())
        return Error{frame.error().code, frame.error().where, contender.name + ": " + frame.error().detail};
    made.frame = std::move(*frame);
    return made;
}

/// What the smooth contenders are held against, over white; empty where there are none.
Result<Picture> smooth_picture(const std::vector<Contender>& contenders, const RenderOptions& render)
{
    if (std::none_of(contenders.begin(), contenders.end(), [](const Contender& c) { return c.smooth; }))
        return Picture{};
    RenderStats stats;
    const Result<Frame> frame = trace_picture(*contenders.front().tracer, render, kSmoothSamples, stats);
    if (!frame.ok())
        return frame.error();
    return over_white(*frame);
}

/// Fills in a point's errors and their pictures.
Status hold_against(ReferencePicture& reference, const Picture& smooth_picture, bool smooth, const Frame& frame,
                    AccuracyPoint& point)
{
    if (smooth) {
        const Picture picture = over_white(frame);
        point.errors.answers.psnr_db = psnr_db(picture, smooth_picture);
        point.errors.ssim = ssim(picture, smooth_picture);
        return Done{};
    }
    point.errors = picture_errors(reference, frame);
    Result<ErrorPictures> pictures = error_pictures(reference, frame, point.errors.answers.ties);
    if (!pictures.ok())
        return pictures.error();
    point.pictures = std::move(*pictures);
    return Done{};
}

} // namespace

uint64_t bytes_read(const Scene& scene, TrimMode trim)
{
    const MemoryBytes bytes = memory_bytes(scene.pack.image);
    const uint64_t surfaces = bytes.geometry + bytes.bvh + scene.prepared->bytes();
    switch (trim) {
    case TrimMode::Kd: // RenderStats counts the trees
        return surfaces;
    case TrimMode::Sdf:
        return surfaces + bytes.trim_sdf;
    case TrimMode::Hybrid:
        return surfaces + bytes.trim_exact + bytes.trim_sdf;
    default:
        return surfaces + bytes.trim_exact;
    }
}

Result<std::vector<Contender>> make_contenders(const std::shared_ptr<const Scene>& scene,
                                               const AccuracyOptions& options, std::string& note)
{
    const Result<KdTrims>& kd = scene->prepared->kd_trims();
    if (!kd.ok())
        return kd.error();
    std::vector<Contender> contenders;
    for (const AccuracySetting& setting : accuracy_settings(options.quick)) {
        const std::shared_ptr<const Scene> own = scene_of(scene, setting, double(kd->size_bytes()));
        std::string none;
        Result<std::unique_ptr<Tracer>> tracer =
            setting.in_double ? make_tracer(own, "reference", none) : make_tracer(own, options.device, note);
        if (!tracer.ok())
            return tracer.error();
        const TrimMode trim = setting.trims ? setting.trims->mode : TrimMode::Exact;
        const DeviceKind device = (*tracer)->device_kind();
        const bool counts_all = device == DeviceKind::Vulkan || device == DeviceKind::SoftwareVulkan;
        Contender contender;
        contender.dial = setting.dial;
        contender.name = setting.name;
        contender.tracer = std::move(*tracer);
        contender.bytes = counts_all ? 0 : bytes_read(*own, trim);
        contender.paper = setting.paper;
        contender.samples = setting.samples;
        contender.smooth = setting.smooth;
        contender.ask = [ask = setting.ask, trim](RenderOptions& render) {
            render.trim = trim;
            ask(render);
        };
        contenders.push_back(std::move(contender));
    }
    return contenders;
}

Result<AccuracyView> measure_view(const std::string& name, const std::shared_ptr<const Scene>& scene,
                                  const std::vector<Contender>& contenders, const AccuracyOptions& options,
                                  const std::function<void(const std::string&)>& progress)
{
    const Result<Camera> camera = bench_view(name, scene, options.width, options.height, options.magnification);
    if (!camera.ok())
        return camera.error();
    RenderOptions render;
    render.width = options.width;
    render.height = options.height;
    render.threads = options.threads;
    render.camera = *camera;
    progress(fmt::format("{}: reference", name));
    Result<ReferencePicture> reference = ReferencePicture::make(scene, render);
    if (!reference.ok())
        return reference.error();
    const Result<Picture> smooth = smooth_picture(contenders, render);
    if (!smooth.ok())
        return smooth.error();

    const size_t count = contenders.size();
    AccuracyView view{name, *camera, std::vector<AccuracyPoint>(count)};
    for (uint32_t round = 0; round < options.rounds; ++round)
        for (size_t turn = 0; turn < count; ++turn) {
            const size_t i = round % 2 == 0 ? turn : count - 1 - turn;
            AccuracyPoint& point = view.points[i];
            if (round > 0 && point.picture_ms.front() > kLongPicture_ms)
                continue;
            progress(fmt::format("{}: round {} of {}: {}", name, round + 1, options.rounds, contenders[i].name));
            Result<Made> made = make_picture(contenders[i], render);
            if (!made.ok())
                return made.error();
            if (round == 0) {
                if (const Status held = hold_against(*reference, *smooth, contenders[i].smooth, made->frame, point);
                    !held.ok())
                    return held.error();
                point.work = made->stats.work;
                point.bytes = contenders[i].bytes + made->stats.buffer_bytes;
            }
            if (picture_ms(made->stats) <= kLongPicture_ms) {
                made = make_picture(contenders[i], render);
                if (!made.ok())
                    return made.error();
            }
            point.picture_ms.push_back(picture_ms(made->stats));
        }
    for (AccuracyPoint& point : view.points) {
        std::vector<double> ratios;
        for (size_t round = 0; round < point.picture_ms.size(); ++round)
            ratios.push_back(point.picture_ms[round] / view.points.front().picture_ms[round]);
        point.time_to_default = median(std::move(ratios));
    }
    return view;
}

} // namespace trimray
