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
    const RenderOptions render = picture_options(options, *camera);
    progress(fmt::format("{}: reference", name));
    Result<ReferencePicture> reference = ReferencePicture::make(scene, render);
    if (!reference.ok())
        return reference.error();
    const Result<Picture> smooth = smooth_picture(contenders, render);
    if (!smooth.ok())
        return smooth.error();

    AccuracyView view{name, *camera, std::vector<AccuracyPoint>(contenders.size())};
    const auto first = [&](size_t i, const Made& made) {
        view.points[i].work = made.stats.work;
        view.points[i].bytes = contenders[i].bytes + made.stats.buffer_bytes;
        return hold_against(*reference, *smooth, contenders[i].smooth, made.frame, view.points[i]);
    };
    Result<TurnTimes> times = time_in_turns(contenders, render, options.rounds, first, [&](const std::string& text) {
        progress(fmt::format("{}: {}", name, text));
    });
    if (!times.ok())
        return times.error();
    for (size_t i = 0; i < contenders.size(); ++i) {
        view.points[i].time_to_default = median(time_ratios((*times)[i], times->front()));
        view.points[i].picture_ms = (*times)[i];
    }
    return view;
}

} // namespace trimray
