#include "runtime/command_draw.h"
#include "runtime/command_json.h"
#include "runtime/command_report.h"
#include "runtime/command_trace.h"
#include "runtime/commands.h"
#include "runtime/effect_plan.h"
#include "runtime/frame_effects.h"
#include "runtime/image_io.h"
#include "runtime/median.h"
#include "runtime/trim_mode.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>
#include <optional>
#include <unistd.h>

namespace trimray {
namespace {

struct RenderArguments {
    std::string pack, output, size = "1280x720", device = "auto", trim = "auto", closest = "certified", scene;
    std::string background = "transparent";
    ViewArguments view;
    DrawArguments draw;
    uint32_t frames = 1, threads = 0, samples = 1;
    double error_px = RenderOptions{}.error_px;
    bool json = false;
};

/// Faults of the arguments that need no file to be seen.
Status check(const RenderArguments& arguments)
{
    if (!arguments.scene.empty())
        return Error{ErrorCode::UnsupportedFormat, "--scene",
                     "scene files are not in this version; a picture is made from one pack"};
    for (const auto& [choice, value] :
         {std::pair{&device_choice(), &arguments.device}, std::pair{&trim_choice(), &arguments.trim},
          std::pair{&closest_choice(), &arguments.closest}})
        if (const Status known = check_choice(*choice, *value); !known.ok())
            return known;
    if (const Status named = check_image_name(arguments.output); !named.ok())
        return named;
    if (arguments.samples > 1 && !arguments.output.ends_with(".png"))
        return Error{ErrorCode::Usage, "--samples", "averages colours only: an EXR has one sample a pixel"};
    if (arguments.samples > 1 && arguments.draw.edge_width_px * arguments.samples > double(kLargestEdgeWidthPx))
        return Error{ErrorCode::Usage, "--edge-width",
                     fmt::format("{} pixels of {} x {} samples are more than {} samples across",
                                 arguments.draw.edge_width_px, arguments.samples, arguments.samples,
                                 kLargestEdgeWidthPx)};
    if (!(arguments.error_px > 0 && arguments.error_px <= 1))
        return Error{ErrorCode::Usage, "--error-px",
                     fmt::format("expected a part of a pixel in (0, 1], found {}", arguments.error_px)};
    return Done{};
}

Json report_json(const RenderArguments& arguments, PictureSize size, const PackImage& image,
                 const RenderOptions& options, const RenderStats& stats)
{
    const double median_ms = median(stats.frame_ms);
    const auto [min_ms, max_ms] = std::minmax_element(stats.frame_ms.begin(), stats.frame_ms.end());
    const WorkCounts& work = stats.work;
    const double rays = static_cast<double>(std::max<uint64_t>(work.rays, 1));
    Json report;
    report["device"] = stats.device;
    report["width"] = size.width;
    report["height"] = size.height;
    report["frames"] = arguments.frames;
    report["trim"] = trim_name(stats.trim);
    report["closest"] = arguments.closest;
    report["ms_per_frame"] = {{"median", median_ms}, {"min", *min_ms}, {"max", *max_ms}};
    report["rays_per_second"] = static_cast<double>(work.rays) / (median_ms * 1e-3);
    MemoryBytes bytes = memory_bytes(image);
    bytes.trim_kd = stats.kd_bytes;
    bytes.borders = stats.border_bytes;
    report["bytes"] = to_json(bytes);
    report["effects"] = Json::array();
    RenderOptions traced = options;
    traced.trim = stats.trim;
    for (const EffectItem& item : effect_plan(image, traced))
        report["effects"].push_back(item.name);
    report["uncertified_pixels"] = work.uncertified_pixels;
    report["work"] = {{"leaf_visits", static_cast<double>(work.leaf_visits) / rays},
                      {"newton_steps", static_cast<double>(work.newton_steps) / rays},
                      {"curve_tests", static_cast<double>(work.curve_tests) / rays}};
    if (edge_query(options).any())
        report["work"]["edge_tests"] = static_cast<double>(work.edge_tests) / rays;
    return report;
}

int run_render(const RenderArguments& arguments)
{
    if (const Status valid = check(arguments); !valid.ok())
        return report_error(valid.error());
    const Result<PictureSize> size = parse_size(arguments.size, arguments.samples);
    if (!size.ok())
        return report_error(size.error());
    const auto background = parse_color("--background", arguments.background, "transparent");
    if (!background.ok())
        return report_error(background.error());

    RenderOptions options;
    if (const Status drawn = set_drawing(arguments.draw, options); !drawn.ok())
        return report_error(drawn.error());

    const Result<std::shared_ptr<const Scene>> scene = load_scene(arguments.pack);
    if (!scene.ok())
        return report_error(scene.error());
    const PackImage& image = (*scene)->pack.image;
    if (const auto held = choose_trim(image, trim_mode(arguments.trim)); !held.ok() && arguments.device != "reference")
        return report_error(held.error());
    const Result<Camera> camera = camera_of(arguments.view, image, size->width, size->height);
    if (!camera.ok())
        return report_error(camera.error());
    std::string note;
    const Result<std::unique_ptr<Tracer>> tracer = make_tracer(*scene, arguments.device, note);
    if (!tracer.ok())
        return report_error(tracer.error());
    if (!note.empty())
        report_note(note);

    options.width = size->width;
    options.height = size->height;
    options.camera = *camera;
    options.trim = trim_mode(arguments.trim);
    options.closest = closest_policy(arguments.closest);
    options.threads = arguments.threads;
    options.frames = arguments.frames;
    options.error_px = static_cast<float>(arguments.error_px);
    const bool tells_progress = arguments.device == "reference" && isatty(STDERR_FILENO) != 0;
    if (tells_progress)
        options.progress = [](double share) { fmt::print(stderr, "\r\033[K{:.0f} %", 100 * share); };
    RenderStats stats;
    Result<Frame> frame = trace_picture(**tracer, options, arguments.samples, stats);
    if (tells_progress)
        fmt::print(stderr, "\r\033[K");
    if (!frame.ok())
        return report_error(frame.error());
    if (background->has_value())
        composite_over(*frame, **background);
    if (const Status written = write_image(arguments.output, *frame); !written.ok())
        return report_error(written.error());
    if (arguments.json)
        print_json(report_json(arguments, *size, image, options, stats));
    return kExitOk;
}

} // namespace

void register_render(CLI::App& app, int& exit_code)
{
    CLI::App* command = app.add_subcommand("render", "Trace a pack into a picture");
    const auto a = std::make_shared<RenderArguments>();
    command->add_option("PACK", a->pack, "The scene pack (.tray)")->required();
    command->add_option("-o,--output", a->output, "The picture: .png (sRGB, alpha) or .exr (floats, all AOVs)")
        ->required();
    command->add_option("--size", a->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
    auto* view = command->add_option("--view", a->view.view, "iso, front, back, left, right, top or bottom")
                     ->capture_default_str();
    command->add_option("--eye", a->view.eye, "x,y,z in mm; the picture is taken from there")->excludes(view);
    command->add_option("--target", a->view.target, "x,y,z in mm; default: the middle of the model")->excludes(view);
    command->add_option("--up", a->view.up, "x,y,z; default: 0,0,1")->excludes(view);
    command->add_option("--fov", a->view.fov_deg, "Vertical field of view in degrees")->capture_default_str();
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
    command->add_option("--error-px", a->error_px, "Where Newton's iteration may stop, in pixels")
        ->capture_default_str();
    command->add_option("--threads", a->threads, "CPU threads; 0: all cores")
        ->capture_default_str()
        ->check(CLI::Range(0u, 1024u));
    command->add_option("--samples", a->samples, "N x N samples a pixel, averaged (PNG only)")
        ->capture_default_str()
        ->check(CLI::Range(1u, 16u));
    command->add_option("--background", a->background, "transparent, white, black or #rrggbb")->capture_default_str();
    add_draw_options(*command, a->draw);
    command->add_option("--scene", a->scene, "A scene file (not in this version)");
    command->add_flag("--json", a->json, "Print one JSON object: device, times, bytes, effects, work per ray");
    command->footer("Camera: pinhole, pixel centres at +0.5, row 0 at the top. Without --eye the model is framed whole "
                    "from --view.\nEXR channels: R G B A Z N.X N.Y N.Z U V face certified.\n\nExamples:\n"
                    "  trimray render model.tray -o picture.png\n"
                    "  trimray render model.tray -o picture.png --view front --samples 3 --background white\n"
                    "  trimray render model.tray -o hits.exr --size 1920x1080 --eye 100,-200,80 --target 0,0,10\n"
                    "  trimray render model.tray -o picture.png --edges sharp --silhouettes --antialias trims\n"
                    "  trimray render model.tray -o drawing.png --style edges-only --edge-width 2 --background white\n"
                    "  trimray render model.tray -o picture.png --closest stochastic --frames 10\n"
                    "  trimray render model.tray -o picture.png --device cpu --frames 20 --json");
    command->callback([a, &exit_code] { exit_code = run_render(*a); });
}

} // namespace trimray
