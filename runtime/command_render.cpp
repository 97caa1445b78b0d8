#include "format/command_report.h"
#include "runtime/arrangement.h"
#include "runtime/command_budget.h"
#include "runtime/command_draw.h"
#include "runtime/command_json.h"
#include "runtime/command_trace.h"
#include "runtime/command_views.h"
#include "runtime/commands.h"
#include "runtime/effect_plan.h"
#include "runtime/frame_effects.h"
#include "runtime/image_io.h"
#include "runtime/materials.h"
#include "runtime/median.h"
#include "runtime/trim_mode.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <unistd.h>
#include <utility>
#include <vector>

namespace trimray {
namespace {

struct RenderArguments {
    std::string pack, output, size = "1280x720", device = "auto", trim = "auto", closest = "certified", scene;
    ViewArguments view;
    DrawArguments draw;
    uint32_t frames = 1, threads = 0;
    double error_px = RenderOptions{}.error_px;
    double time_budget_ms = std::numeric_limits<double>::infinity(); // of a frame
    bool json = false, explain = false;
};

/// One picture to make.
struct PictureJob {
    std::string file, camera; // camera: its name in the file that gives it
    Camera from;
};

/// What a picture took, and what it is made with: what is asked for less what its time budget gave up.
struct PictureReport {
    std::string file, camera;
    RenderOptions made_with;
    RenderStats stats;
    std::optional<BudgetReport> budget;
};

/// Faults of the arguments that need no file to be seen.
Status check(const RenderArguments& arguments)
{
    for (const auto& [choice, value] :
         {std::pair{&device_choice(), &arguments.device}, std::pair{&trim_choice(), &arguments.trim},
          std::pair{&closest_choice(), &arguments.closest}})
        if (const Status known = check_choice(*choice, *value); !known.ok())
            return known;
    if (arguments.output.empty() && !arguments.explain)
        return Error{ErrorCode::Usage, "-o", "is required: a picture's name; only --explain alone makes none"};
    if (!arguments.output.empty())
        if (const Status named = check_image_name(arguments.output); !named.ok())
            return named;
    if (!(arguments.error_px > 0 && arguments.error_px <= 1))
        return Error{ErrorCode::Usage, "--error-px",
                     fmt::format("expected a part of a pixel in (0, 1], found {}", arguments.error_px)};
    if (!(arguments.time_budget_ms > 0))
        return Error{ErrorCode::Usage, "--time-budget",
                     fmt::format("expected milliseconds a frame, above 0, found {}", arguments.time_budget_ms)};
    return Done{};
}

/// The scene file, if there is one, and what options say over it. Fails: as read_scene_file, read_drawing; Usage.
Result<SceneRequest> read_request(const RenderArguments& arguments)
{
    SceneRequest request;
    if (!arguments.scene.empty()) {
        Result<SceneRequest> read = read_scene_file(arguments.scene);
        if (!read.ok())
            return read.error();
        request = std::move(*read);
    }
    if (const Status drawn = read_drawing(arguments.draw, request); !drawn.ok())
        return drawn.error();
    const uint32_t samples = request.samples.value_or(1);
    if (samples > 1 && !arguments.output.empty() && !arguments.output.ends_with(".png"))
        return Error{ErrorCode::Usage, "--samples", "averages colours only: an EXR has one sample a pixel"};
    if (samples > 1 && request.edge_width_px * float(samples) > kLargestEdgeWidthPx)
        return Error{ErrorCode::Usage, "--edge-width",
                     fmt::format("{} pixels of {} x {} samples are more than {} samples across", request.edge_width_px,
                                 samples, samples, kLargestEdgeWidthPx)};
    return request;
}

/// What all pictures have in common. Fails: as apply_request, read_environment.
Result<RenderOptions> common_options(const RenderArguments& arguments, const SceneRequest& request, PictureSize size,
                                     const PackImage& image)
{
    RenderOptions options;
    if (const Status applied = apply_request(request, diagonal_mm(image), options); !applied.ok())
        return applied.error();
    if (request.environment) {
        Result<Environment> environment = read_environment(*request.environment);
        if (!environment.ok())
            return environment.error();
        options.look.environment = std::make_shared<Environment>(std::move(*environment));
    }
    options.width = size.width;
    options.height = size.height;
    options.trim = trim_mode(arguments.trim);
    options.closest = closest_policy(arguments.closest);
    options.threads = arguments.threads;
    options.frames = arguments.frames;
    options.error_px = static_cast<float>(arguments.error_px);
    return options;
}

/// The pictures, in order. Fails: as cameras_for and picture_names.
Result<std::vector<PictureJob>> plan_pictures(const RenderArguments& arguments, const std::vector<SceneCamera>& asked,
                                              const PackImage& image, const PlacementView& placed, PictureSize size)
{
    const Result<std::vector<Camera>> cameras =
        cameras_for(arguments.view, asked, image, placed, size.width, size.height);
    if (!cameras.ok())
        return cameras.error();
    std::vector<std::string> files{arguments.output};
    if (arguments.view.several() && !arguments.output.empty()) {
        Result<std::vector<std::string>> names = picture_names(arguments.output, cameras->size());
        if (!names.ok())
            return names.error();
        files = std::move(*names);
    }
    files.resize(cameras->size());
    std::vector<PictureJob> jobs;
    for (size_t i = 0; i < cameras->size(); ++i)
        jobs.push_back({files[i], asked.size() == cameras->size() ? asked[i].name : "", (*cameras)[i]});
    return jobs;
}

/// Tells of rules that give nothing to anything.
void note_unmatched_rules(const PackImage& image, const SceneRequest& request)
{
    if (request.look.materials.empty())
        return;
    const Result<MaterialTable> table = resolve_materials(image, request.look);
    if (!table.ok()) // the tracers say so
        return;
    for (const size_t rule : table->unmatched)
        report_note(fmt::format("{}: matches no face of the pack", request.rules[rule]));
}

/// Tells of names that are nothing's, and of a model of which nothing is left.
void note_arrangement(const ArrangedPlacements& arranged)
{
    for (const std::string& name : arranged.unmatched)
        report_note(fmt::format("placements: no part or placement is called '{}'", printable(name)));
    if (arranged.view().visible_count() == 0)
        report_note("placements: all are hidden");
}

Json times_json(const RenderStats& stats)
{
    const auto [min_ms, max_ms] = std::minmax_element(stats.frame_ms.begin(), stats.frame_ms.end());
    return {{"median", median(stats.frame_ms)}, {"min", *min_ms}, {"max", *max_ms}};
}

double rays_per_second(const RenderStats& stats)
{
    return static_cast<double>(stats.work.rays) / (median(stats.frame_ms) * 1e-3);
}

Json work_json(const PictureReport& picture)
{
    const WorkCounts& work = picture.stats.work;
    const double rays = static_cast<double>(std::max<uint64_t>(work.rays, 1));
    Json json = {{"leaf_visits", static_cast<double>(work.leaf_visits) / rays},
                 {"newton_steps", static_cast<double>(work.newton_steps) / rays},
                 {"curve_tests", static_cast<double>(work.curve_tests) / rays}};
    if (edge_query(picture.made_with).any())
        json["edge_tests"] = static_cast<double>(work.edge_tests) / rays;
    if (work.free_rays > 0) { // of lights, occlusion and mirrors
        json["free_rays"] = static_cast<double>(work.free_rays) / rays;
        json["free_leaf_visits"] = static_cast<double>(work.free_leaf_visits) / rays;
    }
    return json;
}

/// The names of what the tracer did for a picture.
Json effects_json(const PackFacts& facts, const PictureReport& picture, DeviceKind device)
{
    Json names = Json::array();
    for (const EffectItem& item : effect_plan(facts, picture.made_with, device).items)
        names.push_back(item.name);
    return names;
}

/// One picture's keys are those of the whole; those of several are in a list. Effects are the first's, and in the list
/// where a time budget may make them differ.
Json report_json(const RenderArguments& arguments, PictureSize size, const PackImage& image, const PackFacts& facts,
                 DeviceKind device, const EffectPlan& plan, const std::vector<PictureReport>& pictures)
{
    const bool several = arguments.view.several();
    const RenderStats& stats = pictures.front().stats;
    Json report;
    report["device"] = stats.device;
    report["width"] = size.width;
    report["height"] = size.height;
    report["frames"] = arguments.frames;
    report["trim"] = trim_name(stats.trim);
    report["closest"] = arguments.closest;
    if (!several) {
        report["ms_per_frame"] = times_json(stats);
        report["rays_per_second"] = rays_per_second(stats);
    }
    MemoryBytes bytes = memory_bytes(image);
    bytes.trim_kd = stats.kd_bytes;
    bytes.borders = stats.border_bytes;
    report["bytes"] = to_json(bytes);
    report["effects"] = effects_json(facts, pictures.front(), device);
    if (!several) {
        report["uncertified_pixels"] = stats.work.uncertified_pixels;
        report["work"] = work_json(pictures.front());
        if (pictures.front().budget)
            report["time_budget"] = to_json(*pictures.front().budget);
    }
    if (arguments.explain)
        report["plan"] = plan_json(plan);
    if (!several)
        return report;
    report["pictures"] = Json::array();
    for (const PictureReport& picture : pictures) {
        Json& one = report["pictures"].emplace_back(Json{{"file", picture.file},
                                                         {"camera", picture.camera},
                                                         {"ms_per_frame", times_json(picture.stats)},
                                                         {"rays_per_second", rays_per_second(picture.stats)},
                                                         {"uncertified_pixels", picture.stats.work.uncertified_pixels},
                                                         {"work", work_json(picture)}});
        if (picture.budget) {
            one["effects"] = effects_json(facts, picture, device);
            one["time_budget"] = to_json(*picture.budget);
        }
    }
    return report;
}

/// Shows on a terminal what part of the pictures is done.
class Progress {
public:
    Progress(size_t pictures, bool within_each) : pictures_(pictures), within_each_(within_each) {}
    ~Progress() { clear(); }

    void begin(size_t picture, RenderOptions& options)
    {
        if (!terminal_)
            return;
        if (pictures_ > 1)
            fmt::print(stderr, "\r\033[Kpicture {} of {}", picture + 1, pictures_);
        if (within_each_)
            options.progress = [](double share) { fmt::print(stderr, "\r\033[K{:.0f} %", 100 * share); };
    }
    void clear() const
    {
        if (terminal_ && (pictures_ > 1 || within_each_))
            fmt::print(stderr, "\r\033[K");
    }

private:
    size_t pictures_;
    bool within_each_;
    bool terminal_ = isatty(STDERR_FILENO) != 0;
};

/// Traces and writes one picture, within a budget if there is one. Fails: as Tracer::render, write_image.
Status make_picture(Tracer& tracer, const RenderOptions& options, uint32_t samples,
                    std::optional<BudgetedPictures>& budgeted, PictureReport& picture)
{
    Result<Frame> frame = budgeted ? budgeted->trace(options, picture.stats, picture.budget.emplace())
                                   : trace_picture(tracer, options, samples, picture.stats);
    if (!frame.ok())
        return frame.error();
    picture.made_with = picture.budget ? with_effort(options, picture.budget->made) : options;
    if (options.look.background)
        composite_over(*frame, *options.look.background);
    return write_image(picture.file, *frame);
}

int run_render(const RenderArguments& arguments)
{
    if (const Status valid = check(arguments); !valid.ok())
        return report_error(valid.error());
    const Result<SceneRequest> request = read_request(arguments);
    if (!request.ok())
        return report_error(request.error());
    const uint32_t samples = request->samples.value_or(1);
    const Result<PictureSize> size = parse_size(arguments.size, samples);
    if (!size.ok())
        return report_error(size.error());
    const Result<std::vector<SceneCamera>> asked = cameras_asked(arguments.view, request->cameras);
    if (!asked.ok())
        return report_error(asked.error());

    const Result<std::shared_ptr<const Scene>> scene = load_scene(arguments.pack);
    if (!scene.ok())
        return report_error(scene.error());
    const PackImage& image = (*scene)->pack.image;
    if (const auto held = choose_trim(image, trim_mode(arguments.trim)); !held.ok() && arguments.device != "reference")
        return report_error(held.error());
    Result<RenderOptions> options = common_options(arguments, *request, *size, image);
    if (!options.ok())
        return report_error(options.error());
    KeptArrangement arrangement;
    if (const auto arranged = arrangement.change_to(image, options->look.arrangement); !arranged.ok())
        return report_error(arranged.error());
    const PlacementView placed = arrangement.view(image);
    const Result<std::vector<PictureJob>> jobs = plan_pictures(arguments, *asked, image, placed, *size);
    if (!jobs.ok())
        return report_error(jobs.error());
    note_unmatched_rules(image, *request);
    if (arrangement.arranged() != nullptr)
        note_arrangement(*arrangement.arranged());
    std::string note;
    const Result<std::unique_ptr<Tracer>> tracer = make_tracer(*scene, arguments.device, note);
    if (!tracer.ok())
        return report_error(tracer.error());
    if (!note.empty())
        report_note(note);

    options->camera = jobs->front().from;
    PackFacts facts = pack_facts(image);
    facts.shown_instances = placed.visible_count();
    const EffectPlan plan = effect_plan(facts, *options, (*tracer)->device_kind());
    if ((plan.look & kLookCaps) != 0 && facts.open_parts > 0)
        report_note(fmt::format("--caps: {} of {} parts are not closed; caps there are only where faces happen to "
                                "enclose something",
                                facts.open_parts, facts.parts));
    if (arguments.explain && !arguments.json)
        print_plan(plan);
    if (arguments.output.empty()) {
        if (arguments.json)
            print_json({{"device", (*tracer)->device_name()}, {"plan", plan_json(plan)}});
        return kExitOk;
    }
    Progress progress(jobs->size(), arguments.device == "reference");
    std::optional<BudgetedPictures> budgeted;
    if (std::isfinite(arguments.time_budget_ms))
        budgeted.emplace(**tracer, *options, samples, !arguments.output.ends_with(".exr"), arguments.time_budget_ms);
    std::vector<PictureReport> pictures;
    for (const PictureJob& job : *jobs) {
        progress.begin(pictures.size(), *options);
        options->camera = job.from;
        PictureReport& picture = pictures.emplace_back(PictureReport{job.file, job.camera, {}, {}, {}});
        const Status made = make_picture(**tracer, *options, samples, budgeted, picture);
        if (!made.ok() || picture.budget)
            progress.clear();
        if (!made.ok())
            return report_error(made.error());
        if (picture.budget)
            report_note((jobs->size() > 1 ? picture.file + ": " : "") + to_text(*picture.budget));
    }
    progress.clear();
    if (arguments.json)
        print_json(report_json(arguments, *size, image, facts, (*tracer)->device_kind(), plan, pictures));
    return kExitOk;
}

} // namespace

void register_render(CLI::App& app, int& exit_code)
{
    CLI::App* command = app.add_subcommand("render", "Trace a pack into a picture");
    const auto a = std::make_shared<RenderArguments>();
    command->add_option("PACK", a->pack, "The scene pack (.tray)")->required();
    command->add_option(
        "-o,--output", a->output,
        "The picture: .png (sRGB, alpha) or .exr (floats, all AOVs). Of several, a name with %d or %03d, or each "
        "gets its number");
    command->add_option("--size", a->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
    add_view_options(*command, a->view);
    command
        ->add_option("--device", a->device,
                     "auto (a hardware GPU, else the CPU), cpu, vulkan, or reference (in double: "
                     "slow, to compare the others with)")
        ->capture_default_str();
    command->add_option("--trim", a->trim, "auto (exact), exact, hybrid, sdf or kd")->capture_default_str();
    command
        ->add_option("--closest", a->closest,
                     "certified (many starts where they are called for, one frame) or stochastic (the paper's: one "
                     "start a leaf and frame, the nearest hit of all frames)")
        ->capture_default_str();
    command
        ->add_option("--frames", a->frames,
                     "Frames to trace and time; the picture is the last, with stochastic it needs about ten")
        ->capture_default_str()
        ->check(CLI::Range(1u, 1000000u));
    command
        ->add_option(
            "--error-px", a->error_px,
            "Each pixel shows what the exact model shows somewhere within so many pixels of its middle, in (0, "
            "1]; from 0.001 down single precision decides. Says where Newton's iteration may stop; larger is "
            "hardly faster. Not promised with --trim sdf and --closest stochastic")
        ->capture_default_str();
    command->add_option(
        "--time-budget", a->time_budget_ms,
        "Milliseconds that a frame may take, about (a tenth over fits). What does not fit is given up, the least "
        "missed first, and named: samples a pixel, rays of occlusion and to lights, soft shadows, reflections, "
        "smoothed "
        "trims, occlusion, at last size (traced at 1/2 to 1/8 and enlarged) [no limit]");
    command->add_option("--threads", a->threads, "CPU threads; 0: all cores")
        ->capture_default_str()
        ->check(CLI::Range(0u, 1024u));
    add_draw_options(*command, a->draw);
    command->add_option("--scene", a->scene,
                        "A scene file (JSON): cameras, lights, materials, effects; options win over it");
    command->add_flag("--explain", a->explain,
                      "Print what the tracer is made for, and why; without -o no picture is made");
    command->add_flag("--json", a->json, "Print one JSON object: device, times, bytes, effects, work per ray");
    command->footer(
        "Camera: pinhole or parallel rays, pixel centres at +0.5, row 0 at the top. Without --eye the model is framed "
        "whole from --view.\nEXR channels: R G B A Z N.X N.Y N.Z U V face certified, and map (curvatures in 1/mm^2 or "
        "1/mm, draft in degrees).\n\nExamples:\n"
        "  trimray render model.tray -o picture.png\n"
        "  trimray render model.tray -o picture.png --view front --samples 3 --background white\n"
        "  trimray render model.tray -o hits.exr --size 1920x1080 --eye 100,-200,80 --target 0,0,10\n"
        "  trimray render model.tray -o plan.png --view top --ortho fit --edges sharp\n"
        "  trimray render model.tray -o picture.png --edges sharp --silhouettes --antialias trims\n"
        "  trimray render model.tray -o drawing.png --style edges-only --edge-width 2 --background white\n"
        "  trimray render model.tray -o picture.png --light direction=1,2,-3,strength=0.9 --shadows soft "
        "--occlusion 16\n"
        "  trimray render model.tray -o cut.png --section 0,0,10:0,0,1 --caps hatched\n"
        "  trimray render model.tray -o parts.png --material part=Cover,opacity=0.3 --material "
        "pack_color=#ff0000,mirror=0.4\n"
        "  trimray render model.tray -o inside.png --hide Cover --explode 0.5\n"
        "  trimray render model.tray -o zebra.png --map zebra --stripes 20\n"
        "  trimray render model.tray -o picture.png --scene scene.json\n"
        "  trimray render model.tray -o turn_%03d.png --turntable 36\n"
        "  trimray render model.tray --explain --edges sharp --trim sdf\n"
        "  trimray render model.tray -o picture.png --closest stochastic --frames 10\n"
        "  trimray render model.tray -o picture.png --samples 4 --shadows soft --occlusion 64 --time-budget 250\n"
        "  trimray render model.tray -o picture.png --device cpu --frames 20 --json");
    command->callback([a, &exit_code] { exit_code = run_render(*a); });
}

} // namespace trimray
