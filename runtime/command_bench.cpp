#include "format/command_report.h"
#include "runtime/bench_closest.h"
#include "runtime/bench_effects.h"
#include "runtime/bench_moving.h"
#include "runtime/bench_trims.h"
#include "runtime/command_json.h"
#include "runtime/command_trace.h"
#include "runtime/commands.h"
#include "runtime/trim_mode.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace trimray {
namespace {

struct BenchArguments {
    std::vector<std::string> packs;
    std::string size = "960x540";
    std::vector<double> memory_percent{50, 100, 200, 400};
    TrimBenchOptions options;
    bool json = false;
};

struct ClosestArguments {
    std::vector<std::string> packs;
    std::string size = "640x360";
    ClosestBenchOptions options;
    bool json = false;
};

struct MovingArguments {
    std::vector<std::string> packs;
    std::string size = "640x360";
    MovingBenchOptions options;
    bool json = false;
};

struct EffectsArguments {
    std::vector<std::string> packs;
    std::string size = "320x180";
    EffectsBenchOptions options;
    bool json = false;
};

const char* source_name(TrimSource source)
{
    return source == TrimSource::Curve ? "curve" : "mask";
}
const char* layout_name(TrimLayout layout)
{
    return layout == TrimLayout::Isotropic ? "isotropic" : "square";
}

double per_million(uint64_t count, uint64_t of)
{
    return of > 0 ? 1e6 * static_cast<double>(count) / static_cast<double>(of) : 0;
}

Json camera_json(const Camera& camera)
{
    return {{"eye", camera.eye}, {"target", camera.target}, {"up", camera.up}, {"fov", camera.fov_deg}};
}

Json figures_json(const TrimFigures& figures)
{
    const TrimSetting& setting = figures.setting;
    Json row;
    row["mode"] = trim_name(setting.mode);
    row["source"] = setting.has_textures() ? Json(source_name(setting.textures.source)) : Json();
    row["layout"] = setting.has_textures() ? Json(layout_name(setting.textures.layout)) : Json();
    row["memory_percent"] = setting.has_textures() ? Json(100 * setting.memory) : Json();
    row["edges"] = setting.edges;
    row["bytes"] = figures.bytes;
    row["frame_ms"] = figures.frame_ms;
    row["speed_to_kd"] = figures.speed_to_kd;
    row["ns_per_query"] = figures.ns_per_query;
    row["queries"] = figures.queries;
    row["wrong_queries"] = figures.wrong_queries;
    row["wrong_rays"] = figures.errors.wrong_rays;
    row["wrong_rays_per_million"] = per_million(figures.errors.wrong_rays, figures.errors.rays);
    row["border_error_px"] = figures.errors.largest_border_error_px;
    // null: equal, or with edges, which the reference's picture has not
    row["psnr_db"] = std::isfinite(figures.errors.psnr_db) ? Json(figures.errors.psnr_db) : Json();
    return row;
}

Json view_json(const TrimView& view)
{
    Json object;
    object["view"] = view.name;
    object["camera"] = camera_json(view.camera);
    object["settings"] = Json::array();
    for (const TrimFigures& figures : view.figures)
        object["settings"].push_back(figures_json(figures));
    return object;
}

void print_view(const std::string& pack, const TrimView& view)
{
    const Camera& c = view.camera;
    fmt::print("{}, {}: --eye {},{},{} --target {},{},{} --up {},{},{}\n", printable(pack), view.name, c.eye[0],
               c.eye[1], c.eye[2], c.target[0], c.target[1], c.target[2], c.up[0], c.up[1], c.up[2]);
    fmt::print("{:<30}{:>12}{:>10}{:>8}{:>10}{:>9}{:>12}{:>12}{:>10}\n", "trims", "bytes", "frame ms", "x kd",
               "ns/query", "PSNR dB", "wrong/M rays", "wrong/M qu.", "border px");
    for (const TrimFigures& f : view.figures) {
        std::string name = trim_name(f.setting.mode);
        if (f.setting.edges)
            name += " with edges";
        if (f.setting.has_textures())
            name += fmt::format(" {} {} {:g} %", source_name(f.setting.textures.source),
                                layout_name(f.setting.textures.layout), 100 * f.setting.memory);
        fmt::print("{:<30}{:>12}{:>10.2f}{:>8.3f}{:>10.3f}{:>9}{:>12.2f}{:>12.2f}{:>10.3f}\n", name, f.bytes,
                   f.frame_ms, f.speed_to_kd, f.ns_per_query,
                   f.setting.edges ? "" : fmt::format("{:.2f}", f.errors.psnr_db),
                   per_million(f.errors.wrong_rays, f.errors.rays), per_million(f.wrong_queries, f.queries),
                   f.errors.largest_border_error_px);
    }
    fmt::print("\n");
}

Json figures_json(const ClosestFigures& figures)
{
    const ClosestErrors& errors = figures.errors;
    Json row;
    row["closest"] = closest_name(figures.policy);
    row["leaves"] = figures.one_leaf ? "one" : "pack";
    row["frames"] = figures.frames;
    row["frame_ms"] = figures.frame_ms;
    row["newton_steps"] = figures.newton_steps;
    row["psnr_db"] = std::isfinite(errors.psnr_db) ? Json(errors.psnr_db) : Json(); // null: equal
    row["missing"] = errors.missing;
    row["extra"] = errors.extra;
    row["wrong_depth"] = errors.wrong_depth;
    row["wrong_per_million"] = per_million(errors.wrong(), errors.pixels);
    row["tangent"] = errors.tangent;
    return row;
}

Json view_json(const ClosestView& view)
{
    Json object;
    object["view"] = view.name;
    object["camera"] = camera_json(view.camera);
    object["certified_cost"] = view.certified_cost;
    object["settings"] = Json::array();
    for (const ClosestFigures& figures : view.figures)
        object["settings"].push_back(figures_json(figures));
    return object;
}

void print_view(const std::string& pack, const ClosestView& view)
{
    fmt::print("{}, {}: a certified frame costs {:.3f} of the first stochastic one\n", printable(pack), view.name,
               view.certified_cost);
    fmt::print("{:<12}{:<8}{:>7}{:>10}{:>11}{:>9}{:>10}{:>9}{:>13}{:>9}\n", "closest", "leaves", "frames", "frame ms",
               "steps/ray", "PSNR dB", "missing", "extra", "wrong depth", "tangent");
    for (const ClosestFigures& f : view.figures)
        fmt::print("{:<12}{:<8}{:>7}{:>10.2f}{:>11.3f}{:>9.2f}{:>10}{:>9}{:>13}{:>9}\n", closest_name(f.policy),
                   f.one_leaf ? "one" : "pack", f.frames, f.frame_ms, f.newton_steps, f.errors.psnr_db,
                   f.errors.missing, f.errors.extra, f.errors.wrong_depth, f.errors.tangent);
    fmt::print("\n");
}

Json figures_json(const MovingFigures& figures)
{
    return {{"frame_ms", figures.frame_ms},
            {"node_visits", figures.node_visits},
            {"leaf_visits", figures.leaf_visits},
            {"newton_steps", figures.newton_steps}};
}

void print_moving(const std::string& pack, const MovingReport& report)
{
    fmt::print("{}: {:.3f} times as fast with reuse; {} pixels differ\n", printable(pack), report.speedup,
               report.differing_pixels);
    fmt::print("{:<10}{:>10}{:>12}{:>13}{:>11}\n", "reuse", "frame ms", "nodes/ray", "leaves/ray", "steps/ray");
    for (const bool reuse : {false, true}) {
        const MovingFigures& f = reuse ? report.reusing : report.plain;
        fmt::print("{:<10}{:>10.2f}{:>12.3f}{:>13.3f}{:>11.3f}\n", reuse ? "last hits" : "none", f.frame_ms,
                   f.node_visits, f.leaf_visits, f.newton_steps);
    }
    fmt::print("\n");
}

Json figures_json(const EffectFigures& figures)
{
    Json row;
    row["effect"] = figures.effect;
    row["unsupported"] = figures.unsupported.empty() ? Json() : Json(figures.unsupported);
    if (!figures.unsupported.empty())
        return row;
    const RenderStats& stats = figures.stats;
    const WorkCounts& work = stats.work;
    row["frame_ms"] = figures.frame_ms > 0 ? Json(figures.frame_ms) : Json();
    row["time_to_none"] = figures.time_to_none > 0 ? Json(figures.time_to_none) : Json();
    row["differing_pixels"] = figures.differing_pixels;
    row["buffer_bytes"] = stats.buffer_bytes;
    row["dispatches"] = stats.dispatches;
    row["pipelines"] = Json::array();
    for (const PipelineStats& pipeline : stats.pipelines)
        row["pipelines"].push_back({{"shader", pipeline.shader},
                                    {"constants", pipeline.constants},
                                    {"bytes", pipeline.bytes > 0 ? Json(pipeline.bytes) : Json()}});
    row["work"] = {{"node_visits", work.node_visits},
                   {"leaf_visits", work.leaf_visits},
                   {"newton_steps", work.newton_steps},
                   {"curve_tests", work.curve_tests},
                   {"edge_tests", work.edge_tests},
                   {"free_rays", work.free_rays},
                   {"free_leaf_visits", work.free_leaf_visits}};
    return row;
}

void print_effects(const std::string& pack, const EffectsReport& report)
{
    fmt::print("{}, {}\n", printable(pack), report.device);
    fmt::print("{:<20}{:>10}{:>8}{:>13}{:>11}{:>13}{:>11}{:>12}\n", "effect", "frame ms", "x none", "buffer bytes",
               "dispatches", "leaf visits", "free rays", "differing");
    for (const EffectFigures& f : report.figures)
        if (f.unsupported.empty())
            fmt::print("{:<20}{:>10.2f}{:>8.3f}{:>13}{:>11}{:>13}{:>11}{:>12}\n", f.effect, f.frame_ms, f.time_to_none,
                       f.stats.buffer_bytes, f.stats.dispatches,
                       f.stats.work.leaf_visits + f.stats.work.free_leaf_visits, f.stats.work.free_rays,
                       f.differing_pixels);
        else
            fmt::print("{:<20}  {}\n", f.effect, f.unsupported);
    fmt::print("\n");
}

/// Benches one pack after the other; `take` gets each report. The exit code: that of the first pack that failed, which
/// is reported, or kExitOk.
template <class Bench, class Take>
int bench_each(const std::vector<std::string>& packs, Bench bench, Take take)
{
    for (const std::string& pack : packs) {
        const Result<std::shared_ptr<const Scene>> scene = load_scene(pack);
        if (!scene.ok())
            return report_error(scene.error());
        const auto report = bench(*scene, [&](const std::string& text) { report_progress(pack + ": " + text); });
        report_progress("");
        if (!report.ok())
            return report_error(report.error());
        take(pack, *report);
    }
    return kExitOk;
}

int run_bench_trims(BenchArguments arguments)
{
    const Result<PictureSize> size = parse_size(arguments.size, 1);
    if (!size.ok())
        return report_error(size.error());
    TrimBenchOptions& options = arguments.options;
    options.width = size->width;
    options.height = size->height;
    options.memories.clear();
    for (const double percent : arguments.memory_percent)
        options.memories.push_back(percent / 100);

    Json packs = Json::array();
    std::string device;
    const auto bench = [&](const auto& scene, const auto& progress) { return bench_trims(scene, options, progress); };
    const auto take = [&](const std::string& pack, const TrimReport& report) {
        device = report.device;
        Json object;
        object["pack"] = pack;
        object["views"] = Json::array();
        for (const TrimView& view : report.views) {
            object["views"].push_back(view_json(view));
            if (!arguments.json)
                print_view(pack, view);
        }
        packs.push_back(std::move(object));
    };
    if (const int code = bench_each(arguments.packs, bench, take); code != kExitOk)
        return code;
    if (arguments.json)
        print_json({{"device", device},
                    {"width", size->width},
                    {"height", size->height},
                    {"threads", options.threads},
                    {"rounds", options.rounds},
                    {"packs", packs}});
    return kExitOk;
}

int run_bench_closest(ClosestArguments arguments)
{
    const Result<PictureSize> size = parse_size(arguments.size, 1);
    if (!size.ok())
        return report_error(size.error());
    ClosestBenchOptions& options = arguments.options;
    options.width = size->width;
    options.height = size->height;
    std::sort(options.frames.begin(), options.frames.end());

    Json packs = Json::array();
    std::string device;
    double log_costs = 0; // summed over all views
    size_t views = 0;
    const auto bench = [&](const auto& scene, const auto& progress) { return bench_closest(scene, options, progress); };
    const auto take = [&](const std::string& pack, const ClosestReport& report) {
        device = report.device;
        Json object;
        object["pack"] = pack;
        object["bezier_patches"] = report.patches;
        object["bezier_leaves"] = report.leaves;
        object["views"] = Json::array();
        for (const ClosestView& view : report.views) {
            log_costs += std::log(view.certified_cost);
            ++views;
            object["views"].push_back(view_json(view));
            if (!arguments.json)
                print_view(pack, view);
        }
        packs.push_back(std::move(object));
    };
    if (const int code = bench_each(arguments.packs, bench, take); code != kExitOk)
        return code;
    const double cost = std::exp(log_costs / static_cast<double>(views));
    if (arguments.json)
        print_json({{"device", device},
                    {"width", size->width},
                    {"height", size->height},
                    {"threads", options.threads},
                    {"rounds", options.rounds},
                    {"certified_cost", cost},
                    {"packs", packs}});
    else
        fmt::print("Certified frames cost {:.3f} of the first stochastic ones (geometric mean of {} views)\n", cost,
                   views);
    return kExitOk;
}

/// The picture's size, and whether the device is a known one.
template <class Options>
Status set_picture(const std::string& size_text, Options& options)
{
    const Result<PictureSize> size = parse_size(size_text, 1);
    if (!size.ok())
        return size.error();
    options.width = size->width;
    options.height = size->height;
    return check_choice(device_choice(), options.device);
}

int run_bench_moving(MovingArguments arguments)
{
    MovingBenchOptions& options = arguments.options;
    if (const Status set = set_picture(arguments.size, options); !set.ok())
        return report_error(set.error());

    Json packs = Json::array();
    std::string device;
    const auto bench = [&](const auto& scene, const auto& progress) { return bench_moving(scene, options, progress); };
    const auto take = [&](const std::string& pack, const MovingReport& report) {
        device = report.device;
        packs.push_back({{"pack", pack},
                         {"camera", camera_json(report.camera)},
                         {"speedup", report.speedup},
                         {"differing_pixels", report.differing_pixels},
                         {"plain", figures_json(report.plain)},
                         {"reusing", figures_json(report.reusing)}});
        if (!arguments.json)
            print_moving(pack, report);
    };
    if (const int code = bench_each(arguments.packs, bench, take); code != kExitOk)
        return code;
    if (arguments.json)
        print_json({{"device", device},
                    {"width", options.width},
                    {"height", options.height},
                    {"frames", options.pictures},
                    {"degrees", options.degrees},
                    {"packs", packs}});
    return kExitOk;
}

int run_bench_effects(EffectsArguments arguments)
{
    EffectsBenchOptions& options = arguments.options;
    if (const Status set = set_picture(arguments.size, options); !set.ok())
        return report_error(set.error());

    Json packs = Json::array();
    std::string device;
    const auto bench = [&](const auto& scene, const auto& progress) { return bench_effects(scene, options, progress); };
    const auto take = [&](const std::string& pack, const EffectsReport& report) {
        device = report.device;
        Json object{{"pack", pack}, {"camera", camera_json(report.camera)}, {"effects", Json::array()}};
        for (const EffectFigures& figures : report.figures)
            object["effects"].push_back(figures_json(figures));
        packs.push_back(std::move(object));
        if (!arguments.json)
            print_effects(pack, report);
    };
    if (const int code = bench_each(arguments.packs, bench, take); code != kExitOk)
        return code;
    if (arguments.json)
        print_json({{"device", device},
                    {"width", options.width},
                    {"height", options.height},
                    {"threads", options.threads},
                    {"rounds", options.rounds},
                    {"packs", packs}});
    return kExitOk;
}

/// What all benches ask for.
template <class Arguments>
void add_packs(CLI::App& command, Arguments& a)
{
    command.add_option("PACK", a.packs, "Scene packs (.tray)")->required();
    command.add_option("--size", a.size, "WIDTHxHEIGHT in pixels")->capture_default_str();
    command.add_flag("--json", a.json, "Print one JSON object: all figures by pack and view");
}

/// What those on the CPU tracer ask for beside.
template <class Arguments>
void add_cpu_rounds(CLI::App& command, Arguments& a)
{
    command.add_option("--rounds", a.options.rounds, "How often each setting is timed; medians are reported")
        ->capture_default_str()
        ->check(CLI::Range(1u, 10000u));
    command.add_option("--threads", a.options.threads, "CPU threads; 0: all cores")
        ->capture_default_str()
        ->check(CLI::Range(0u, 1024u));
    command.add_option("--instruction-set", a.options.instruction_set, "avx512, avx2 or sse4; default: the best");
}

void register_bench_closest(CLI::App& bench, int& exit_code)
{
    CLI::App* closest = bench.add_subcommand("closest", "Time and errors of both policies for closest hits");
    const auto a = std::make_shared<ClosestArguments>();
    add_packs(*closest, *a);
    add_cpu_rounds(*closest, *a);
    closest->add_option("--views", a->options.views, "iso, front, back, left, right, top and bottom, with commas")
        ->delimiter(',')
        ->capture_default_str();
    closest->add_option("--frames", a->options.frames, "How many stochastic frames pictures are made of, with commas")
        ->delimiter(',')
        ->capture_default_str()
        ->check(CLI::Range(1u, 10000u));
    closest->footer(
        "Stochastic frames, the paper's, are made with one leaf a patch ('one') and with the pack's leaves; the\n"
        "certified frame with the pack's. Each picture is compared with that of the reference in double: PSNR (sRGB\n"
        "over white), and pixels that miss a hit, have one too many, or lie more than 0.1 of a pixel's footprint off;\n"
        "'tangent' are those among them whose answer changes where the ray moves by 0.001 pixels. The cost is the\n"
        "median over the rounds, in which first frames are timed in turns.\n\n"
        "Examples:\n"
        "  trimray bench closest model.tray\n"
        "  trimray bench closest part.tray hull.tray --size 1920x1080 --frames 1,10 --json");
    closest->callback([a, &exit_code] { exit_code = run_bench_closest(*a); });
}

void register_bench_moving(CLI::App& bench, int& exit_code)
{
    CLI::App* moving = bench.add_subcommand("moving", "What a moving camera gains from the last picture's hits");
    const auto a = std::make_shared<MovingArguments>();
    add_packs(*moving, *a);
    moving
        ->add_option("--degrees", a->options.degrees,
                     "How far the camera turns about the model from picture to picture")
        ->capture_default_str()
        ->check(CLI::Range(-360.0, 360.0));
    moving->add_option("--frames", a->options.pictures, "How many pictures are measured, after one to begin from")
        ->capture_default_str()
        ->check(CLI::Range(1u, 10000u));
    moving->add_option("--device", a->options.device, "auto, cpu, vulkan or reference; only vulkan reuses hits")
        ->capture_default_str();
    moving->footer(
        "Each picture is traced with reuse (each ray searches first where the last picture suggests, and its hit "
        "there\n"
        "bounds the search) and without, in turns. Times are medians; work is a ray's, in the mean over the pictures.\n"
        "Pixels that differ in any channel are counted.\n\n"
        "Examples:\n"
        "  trimray bench moving model.tray\n"
        "  trimray bench moving part.tray hull.tray --degrees 0.5 --size 1920x1080 --json");
    moving->callback([a, &exit_code] { exit_code = run_bench_moving(*a); });
}

void register_bench_effects(CLI::App& bench, int& exit_code)
{
    CLI::App* effects = bench.add_subcommand("effects", "Time, memory and work of a picture with each effect alone");
    const auto a = std::make_shared<EffectsArguments>();
    add_packs(*effects, *a);
    effects->add_option("--device", a->options.device, "auto, cpu, vulkan or reference")->capture_default_str();
    effects->add_option("--effects", a->options.effects, "Which, with commas; default: all, and none")->delimiter(',');
    effects->add_option("--rounds", a->options.rounds, "How often each is timed; 0: each picture is made once, untimed")
        ->capture_default_str()
        ->check(CLI::Range(0u, 10000u));
    effects->add_option("--threads", a->options.threads, "CPU threads; 0: all cores")
        ->capture_default_str()
        ->check(CLI::Range(0u, 1024u));
    effects->add_option("--instruction-set", a->options.instruction_set, "avx512, avx2 or sse4; default: the best");
    effects->footer(
        "Frames are timed in turns: 'x none' is the median over the rounds of the frame's time over that of the frame\n"
        "without effects. Memory and work are of one frame by a tracer that has made no other. 'unspecialised' is the\n"
        "picture without effects by a tracer that has everything compiled in and finds out at run time what is asked\n"
        "for; 'differing' are pixels that are not those of the picture without effects.\n\n"
        "Examples:\n"
        "  trimray bench effects model.tray\n"
        "  trimray bench effects model.tray --device vulkan --effects none,occlusion,unspecialised --json");
    effects->callback([a, &exit_code] { exit_code = run_bench_effects(*a); });
}

} // namespace

void register_bench(CLI::App& app, int& exit_code)
{
    CLI::App* bench = app.add_subcommand("bench", "Measure a part of the tracer on packs");
    bench->require_subcommand(1);
    bench->footer("Examples:\n  trimray bench accuracy model.tray -o report\n  trimray bench speed model.tray\n  "
                  "trimray bench trims model.tray\n  "
                  "trimray bench closest model.tray\n  "
                  "trimray bench effects model.tray\n  trimray bench moving model.tray\n\n'trimray bench "
                  "trims --help' describes the first.");
    register_externals(*bench, "bench");
    register_bench_closest(*bench, exit_code);
    register_bench_effects(*bench, exit_code);
    register_bench_moving(*bench, exit_code);
    CLI::App* trims = bench->add_subcommand("trims", "Time and errors of every trim mode, source, layout and memory");
    const auto a = std::make_shared<BenchArguments>();
    add_packs(*trims, *a);
    add_cpu_rounds(*trims, *a);
    trims
        ->add_option("--views", a->options.views,
                     "iso, front, back, left, right, top, bottom and close-up, with commas")
        ->delimiter(',')
        ->capture_default_str();
    trims->add_option("--zoom", a->options.magnification, "How many times nearer close-up is than iso")
        ->capture_default_str()
        ->check(CLI::Range(1.5, 1000.0));
    trims->add_option("--memory", a->memory_percent, "Textures in percent of the kd-trees' bytes, with commas")
        ->delimiter(',')
        ->capture_default_str()
        ->check(CLI::Range(1.0, 10000.0));
    trims->footer(
        "Frames of all settings are timed in turns. 'x kd' is the median over the rounds of kd's time over the "
        "setting's;\n"
        "PSNR (sRGB over white), wrong rays and the largest distance between a wrong ray and its border are counted\n"
        "against a picture whose trims are decided in double over all pieces; 'ns/query' is the mode alone, over the\n"
        "queries that this picture asks. close-up goes from iso to where most trim borders are, by a fixed rule.\n\n"
        "Examples:\n"
        "  trimray bench trims model.tray\n"
        "  trimray bench trims part.tray board.tray --size 1920x1080 --rounds 9 --json\n"
        "  trimray bench trims model.tray --views close-up --zoom 30 --memory 100");
    trims->callback([a, &exit_code] { exit_code = run_bench_trims(*a); });
}

} // namespace trimray
