#include "runtime/measure/speed.h"

#include "runtime/bench_view.h"
#include "runtime/closest_errors.h"
#include "runtime/command_converter.h"
#include "runtime/command_json.h"
#include "runtime/derived_scene.h"
#include "runtime/measure/mesh_tracer.h"
#include "runtime/measure/one_ray_tracer.h"
#include "runtime/measure/turns.h"
#include "runtime/median.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

namespace trimray {
namespace {
namespace fs = std::filesystem;
using Progress = std::function<void(const std::string&)>;

constexpr size_t kLeastForSpread = 3; // rounds

/// The model as it is traced, and what its pictures are timed beside.
struct Prepared {
    std::shared_ptr<const Scene> scene;
    SpeedCounts counts;                // of the pack
    std::vector<Contender> contenders; // the default, then the baselines that there are, the one-ray tracer first
    bool has_mesh = false;
    std::vector<std::string> notes;
};

SpeedCounts counts_of(const Scene& scene)
{
    const PackImage& image = scene.pack.image;
    const MemoryBytes bytes = memory_bytes(image);
    SpeedCounts counts;
    counts.faces = image.faces.size();
    counts.patches = image.patches.size();
    counts.leaves = image.leaves.size();
    counts.geometry_bytes = bytes.geometry;
    counts.bvh_bytes = bytes.bvh;
    counts.trim_exact_bytes = bytes.trim_exact;
    counts.trim_sdf_bytes = bytes.trim_sdf;
    counts.file_bytes = scene.pack.file_bytes;
    return counts;
}

void add_counts(const WorkCounts& work, SpeedCounts& counts)
{
    counts.rays = work.rays;
    counts.node_visits = work.node_visits;
    counts.leaf_visits = work.leaf_visits;
    counts.newton_steps = work.newton_steps;
    counts.curve_tests = work.curve_tests;
    counts.uncertified_pixels = work.uncertified_pixels;
}

/// Makes the pack that a user would have, but for previews. Returns how far a pcurve lies beside its edge at most, nm.
Result<uint64_t> convert(const std::string& model, const std::string& pack, std::vector<std::string>& notes)
{
    const Result<Json> report = run_converter(model, pack, {"--no-previews"});
    if (!report.ok())
        return report.error();
    for (const std::string& loss : losses(*report))
        notes.push_back("the pack: " + loss);
    const double deviation_mm = (*report)["trims"]["largest_pcurve_deviation_mm"].get<double>();
    return uint64_t(std::llround(deviation_mm * 1e6));
}

Contender one_ray_contender(const Scene& scene)
{
    return {"baseline", "one ray, one leaf a patch, kd-trees", make_one_ray_tracer(with_leaf_budget(scene, 1)),
            [](RenderOptions& render) {
                render.closest = ClosestPolicy::Stochastic;
                render.trim = TrimMode::Kd;
            }};
}

Result<std::unique_ptr<Tracer>> mesh_tracer(const std::string& model, const ScratchFolder& scratch,
                                            std::vector<std::string>& notes)
{
    const std::string file = scratch.file("mesh.trimesh");
    Result<Json> report = run_converter(model, file, {"--mesh", fmt::format("{:g}", kSpeedDeflection)});
    if (!report.ok())
        return report.error();
    (*report)["warnings"].clear(); // the pack's too, which are noted
    for (const std::string& loss : losses(*report))
        notes.push_back("triangles: " + loss);
    return open_mesh(file);
}

void add_mesh(const std::string& model, const ScratchFolder& scratch, Prepared& prepared)
{
    Result<std::unique_ptr<Tracer>> tracer = mesh_tracer(model, scratch, prepared.notes);
    prepared.has_mesh = tracer.ok();
    if (tracer.ok())
        prepared.contenders.push_back({"baseline", "triangles", std::move(*tracer), [](RenderOptions&) {}});
    else
        prepared.notes.push_back("triangles: " + tracer.error().detail);
}

Result<Prepared> prepare(const std::string& model, const SpeedOptions& options, const Progress& progress)
{
    const Result<ScratchFolder> scratch = ScratchFolder::make();
    if (!scratch.ok())
        return scratch.error();
    Prepared prepared;
    const bool from_cad = is_cad_file(model);
    const std::string pack = from_cad ? scratch->file("own.tray") : model;
    SpeedCounts::Count pcurve_deviation_nm;
    if (from_cad) {
        progress("converting");
        const Result<uint64_t> deviation = convert(model, pack, prepared.notes);
        if (!deviation.ok())
            return deviation.error();
        pcurve_deviation_nm = *deviation;
    }
    const Result<std::shared_ptr<const Scene>> scene = load_scene(pack);
    if (!scene.ok())
        return scene.error();
    prepared.scene = *scene;
    prepared.counts = counts_of(**scene);
    prepared.counts.pcurve_deviation_nm = pcurve_deviation_nm;
    Result<std::unique_ptr<Tracer>> tracer = make_cpu_tracer(*scene, options.instruction_set);
    if (!tracer.ok())
        return tracer.error();
    prepared.contenders.push_back({"default", "default", std::move(*tracer), [](RenderOptions&) {}});
    if (options.rounds > 0) {
        progress("making baselines");
        prepared.contenders.push_back(one_ray_contender(**scene));
        if (from_cad)
            add_mesh(model, *scratch, prepared);
    }
    return prepared;
}

/// Of a value a round; none: not measured, or in too few rounds.
struct Middle {
    std::optional<double> value, spread;
};
Middle middle(const std::vector<double>& values)
{
    if (values.empty())
        return {};
    return {median(values), values.size() >= kLeastForSpread ? std::optional(relative_spread(values)) : std::nullopt};
}

SpeedTimes times_of(const TurnTimes& ms, bool has_mesh)
{
    const Middle own = middle(ms[0]), one_ray = middle(time_ratios(ms[1], ms[0])),
                 mesh = has_mesh ? middle(time_ratios(ms[2], ms[0])) : Middle{};
    return {own.value, own.spread, one_ray.value, one_ray.spread, mesh.value, mesh.spread};
}

Result<SpeedLine> measure_line(const std::string& name, const Prepared& prepared, const SpeedOptions& options,
                               const Progress& progress)
{
    const Result<Camera> camera =
        bench_view(name, prepared.scene, options.width, options.height, options.magnification);
    if (!camera.ok())
        return camera.error();
    const RenderOptions render = picture_options(options, *camera);

    SpeedLine line;
    line.view = name;
    line.counts = prepared.counts;
    line.counts.width = options.width;
    line.counts.height = options.height;
    line.device = prepared.contenders.front().tracer->device_name();
    progress(name);
    const Result<Made> made = make_picture(prepared.contenders.front(), render);
    if (!made.ok())
        return made.error();
    add_counts(made->stats.work, line.counts);
    if (options.errors) {
        progress(name + ": reference");
        Result<ReferencePicture> reference = ReferencePicture::make(prepared.scene, render);
        if (!reference.ok())
            return reference.error();
        const ClosestErrors errors = reference->errors(made->frame);
        line.counts.missing = errors.missing;
        line.counts.extra = errors.extra;
        line.counts.wrong_depth = errors.wrong_depth;
    }
    if (options.rounds > 0) {
        const Result<TurnTimes> ms = time_in_turns(
            prepared.contenders, render, options.rounds, [](size_t, const Made&) -> Status { return Done{}; },
            [&](const std::string& text) { progress(name + ": " + text); });
        if (!ms.ok())
            return ms.error();
        line.times = times_of(*ms, prepared.has_mesh);
    }
    return line;
}

} // namespace

Result<SpeedModel> measure_speed(const std::string& model, const SpeedOptions& options, const Progress& progress)
{
    Result<Prepared> prepared = prepare(model, options, progress);
    if (!prepared.ok())
        return prepared.error();
    SpeedModel measured;
    measured.notes = std::move(prepared->notes);
    for (const std::string& view : options.views) {
        Result<SpeedLine> line = measure_line(view, *prepared, options, progress);
        if (!line.ok())
            return line.error();
        line->model = fs::path(model).filename().string();
        measured.lines.push_back(std::move(*line));
    }
    return measured;
}

} // namespace trimray
