#include "runtime/bench_effects.h"

#include "runtime/bench_turns.h"
#include "runtime/bench_view.h"
#include "runtime/command_trace.h"
#include "runtime/differing_pixels.h"
#include "runtime/median.h"
#include "runtime/nearest_word.h"
#include "runtime/surface_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace trimray {
namespace {

struct Effect {
    const char* name;
    void (*ask)(SceneRequest& request);
};

void cut_in_the_middle(SceneRequest& request, CapStyle caps)
{
    request.look.section.planes = {{{}, {1, 0, 0}}}; // through the model's middle, see picture_of
    request.look.section.caps = caps;
}

/// Gives all faces a material of which one field is set.
template <class T>
void make_material(SceneRequest& request, std::optional<T> Material::*field, const T& value)
{
    request.look.materials = {MaterialRule{}};
    request.look.materials[0].material.*field = value;
}

/// A grey sky.
void surround(SceneRequest& request)
{
    constexpr uint32_t kWidth = 64, kHeight = 32;
    request.look.environment = std::make_shared<Environment>(
        Environment{kWidth, kHeight, std::vector<float>(size_t{3} * kWidth * kHeight, 0.5f), "bench effects"});
}

template <SurfaceMap map>
void draw_map(SceneRequest& request)
{
    request.look.map.map = map;
}

const Effect kEffects[] = {
    {"none", [](SceneRequest&) {}},
    {"edges", [](SceneRequest& r) { r.edges = EdgeLines::Sharp; }},
    {"silhouettes", [](SceneRequest& r) { r.silhouettes = true; }},
    {"antialias-trims", [](SceneRequest& r) { r.antialias_trims = true; }},
    {"hard-shadows", [](SceneRequest& r) { r.shadows = ShadowKind::Hard; }},
    {"soft-shadows", [](SceneRequest& r) { r.shadows = ShadowKind::Soft; }},
    {"occlusion", [](SceneRequest& r) { r.look.occlusion.samples = 16; }},
    {"section", [](SceneRequest& r) { cut_in_the_middle(r, CapStyle::None); }},
    {"section-caps", [](SceneRequest& r) { cut_in_the_middle(r, CapStyle::Filled); }},
    {"materials",
     [](SceneRequest& r) {
         make_material(r, &Material::color, {0.5f, 0.25f, 0.1f});
     }},
    {"xray", [](SceneRequest& r) { r.look.xray = 0.3f; }},
    {"mirror", [](SceneRequest& r) { make_material(r, &Material::mirror, 0.5f); }},
    {"environment", surround},
    {"zebra", draw_map<SurfaceMap::Zebra>},
    {"isophotes", draw_map<SurfaceMap::Isophotes>},
    {"curvature-gaussian", draw_map<SurfaceMap::CurvatureGaussian>},
    {"curvature-mean", draw_map<SurfaceMap::CurvatureMean>},
    {"curvature-max", draw_map<SurfaceMap::CurvatureMax>},
    {"curvature-min", draw_map<SurfaceMap::CurvatureMin>},
    {"draft", draw_map<SurfaceMap::Draft>},
    {"orthographic", [](SceneRequest& r) { r.cameras.emplace_back().parallel = true; }},
    {"unspecialised", [](SceneRequest&) {}},
};

/// One effect's tracer and what was measured of it.
struct Measured {
    std::unique_ptr<Tracer> tracer;
    RenderOptions render;
    Frame frame;
    std::vector<double> round_ms; // empty: the tracer has it not
    EffectFigures figures;
};

Result<RenderOptions> picture_of(const Effect& effect, const PackImage& image, const EffectsBenchOptions& options)
{
    SceneRequest request;
    effect.ask(request);
    const SceneCamera asked = request.cameras.empty() ? SceneCamera{} : request.cameras.front();
    const Result<Camera> camera = camera_of(asked, image, options.width, options.height);
    if (!camera.ok())
        return camera.error();
    for (SectionPlane& plane : request.look.section.planes)
        plane.point_mm = camera->target;
    RenderOptions render = picture_options(options, *camera);
    render.specialise = std::string(effect.name) != "unspecialised";
    if (const Status applied = apply_request(request, diagonal_mm(image), render); !applied.ok())
        return applied.error();
    return render;
}

Result<std::unique_ptr<Tracer>> tracer_of(const std::shared_ptr<const Scene>& scene, const EffectsBenchOptions& options)
{
    std::string note;
    return options.device == "cpu" ? make_cpu_tracer(scene, options.instruction_set)
                                   : make_tracer(scene, options.device, note);
}

/// The effects that are asked for, in their order here. Fails: Usage.
Result<std::vector<const Effect*>> chosen(const std::vector<std::string>& names)
{
    for (const std::string& name : names)
        if (const std::vector<std::string> known = effect_names();
            std::find(known.begin(), known.end(), name) == known.end())
            return Error{ErrorCode::Usage, "--effects",
                         fmt::format("no effect '{}'{}", name, did_you_mean(name, known))};
    std::vector<const Effect*> effects;
    for (const Effect& effect : kEffects)
        if (names.empty() || std::find(names.begin(), names.end(), effect.name) != names.end())
            effects.push_back(&effect);
    return effects;
}

/// Makes the picture once, with a tracer of its own.
Status measure_once(const std::shared_ptr<const Scene>& scene, const EffectsBenchOptions& options, Measured& measured)
{
    Result<std::unique_ptr<Tracer>> tracer = tracer_of(scene, options);
    if (!tracer.ok())
        return tracer.error();
    measured.tracer = std::move(*tracer);
    Result<Frame> frame = measured.tracer->render(measured.render, measured.figures.stats);
    if (!frame.ok() && frame.error().code == ErrorCode::UnsupportedFormat)
        measured.figures.unsupported = frame.error().detail;
    else if (!frame.ok())
        return frame.error();
    else
        measured.frame = std::move(*frame);
    return Done{};
}

/// Adds a round's time of an effect, if the tracer has it. Fails: as Tracer::render.
Status time_once(Measured& one)
{
    if (!one.figures.unsupported.empty())
        return Done{};
    RenderOptions twice = one.render;
    twice.frames = 2; // the first fetches what the second finds in the caches
    RenderStats stats;
    if (const Result<Frame> frame = one.tracer->render(twice, stats); !frame.ok())
        return frame.error();
    one.round_ms.push_back(frame_times(stats).back());
    return Done{};
}

} // namespace

std::vector<std::string> effect_names()
{
    std::vector<std::string> names;
    for (const Effect& effect : kEffects)
        names.emplace_back(effect.name);
    return names;
}

Result<EffectsReport> bench_effects(const std::shared_ptr<const Scene>& scene, const EffectsBenchOptions& options,
                                    const std::function<void(const std::string&)>& progress)
{
    const Result<std::vector<const Effect*>> effects = chosen(options.effects);
    if (!effects.ok())
        return effects.error();
    const Result<Camera> camera = camera_of({}, scene->pack.image, options.width, options.height);
    if (!camera.ok())
        return camera.error();
    std::vector<Measured> measured;
    EffectsReport report;
    report.camera = *camera;
    for (const Effect* effect : *effects) {
        progress(effect->name);
        const Result<RenderOptions> render = picture_of(*effect, scene->pack.image, options);
        if (!render.ok())
            return render.error();
        Measured& one = measured.emplace_back();
        one.render = *render;
        one.figures.effect = effect->name;
        if (const Status made = measure_once(scene, options, one); !made.ok())
            return made.error();
        report.device = one.tracer->device_name();
    }
    const Status timed = take_turns(options.rounds, measured.size(), [&](uint32_t round, size_t i) {
        progress(fmt::format("round {} of {}", round + 1, options.rounds));
        return time_once(measured[i]);
    });
    if (!timed.ok())
        return timed.error();
    const bool has_none = measured.front().figures.effect == "none";
    for (Measured& one : measured) {
        EffectFigures& figures = one.figures;
        if (!one.round_ms.empty())
            figures.frame_ms = median(one.round_ms);
        if (has_none && figures.unsupported.empty()) {
            const std::vector<double> ratios = time_ratios(one.round_ms, measured.front().round_ms);
            figures.time_to_none = ratios.empty() ? 0 : median(ratios);
            figures.differing_pixels = differing_pixels(measured.front().frame, one.frame);
        }
        report.figures.push_back(std::move(figures));
    }
    return report;
}

} // namespace trimray
