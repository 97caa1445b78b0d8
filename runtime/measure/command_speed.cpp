// How fast given models are, beside baselines and a stored run.
#include "format/command_report.h"
#include "format/pack_writer.h"
#include "format/read_file.h"
#include "runtime/command_trace.h"
#include "runtime/measure/commands.h"
#include "runtime/measure/report.h"
#include "runtime/measure/speed.h"
#include "runtime/median.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trimray {
namespace {
namespace fs = std::filesystem;

struct SpeedArguments {
    std::vector<std::string> models;
    std::string size = "640x360", baseline, write_baseline;
    SpeedOptions options;
    bool check = false, json = false;
};

constexpr const char* kSpeedFooter =
    "The default picture of each view is timed in turns with baselines, which cancel how fast the machine is: the\n"
    "paper's shape of tracer (one ray at a time, one leaf a patch of the same pack, kd-trees), and, where the model\n"
    "is a CAD file, its triangles (deflection 1e-4 of the diagonal) traced by Embree. Speeds are the baseline's time\n"
    "over the picture's in the same round, medians over the rounds; spreads (third quartile - first) / median.\n"
    "\n"
    "A stored run is CSV, one line a model (the file's name) and view. Counts are the same for any instruction set\n"
    "and number of threads, so a change is one of the program, of a library or of the model; speeds change\n"
    "beyond the noise where they change by more than the spreads of both runs together. Columns:\n"
    "  model, view, width, height\n"
    "  faces, patches, leaves         of the pack, as geometry_bytes, bvh_bytes, trim_exact_bytes and trim_sdf_bytes\n"
    "                                 in memory, and file_bytes\n"
    "  pcurve_deviation_nm            how far a pcurve lies beside its edge at most; none of a pack\n"
    "  rays, node_visits, leaf_visits, newton_steps, curve_tests, uncertified_pixels   of one picture\n"
    "  missing, extra, wrong_depth    pixels beside the reference in double; none without --errors\n"
    "  device                         with its instruction set; times of another are not compared\n"
    "  picture_ms, speed_to_one_ray, speed_to_mesh, each with its spread; none: not measured\n"
    "\nExamples:\n"
    "  trimray bench speed part.step board.tray\n"
    "  trimray bench speed part.step --write-baseline before.csv\n"
    "  trimray bench speed part.step --baseline before.csv\n"
    "  trimray bench speed part.tray --rounds 0 --baseline counts.csv --check";

std::string name_of(const std::string& model)
{
    return fs::path(model).filename().string();
}

/// Stored runs know models by their names, and views by theirs.
Status check_names(const SpeedArguments& arguments)
{
    std::set<std::string> models, views;
    for (const std::string& model : arguments.models)
        if (!models.insert(name_of(model)).second)
            return Error{ErrorCode::Usage, "MODEL",
                         fmt::format("two models are named {}; measure them apart", name_of(model))};
    for (const std::string& view : arguments.options.views)
        if (!views.insert(view).second)
            return Error{ErrorCode::Usage, "--views", fmt::format("{} is there twice", view)};
    return Done{};
}

/// Fails: as read_file, parse_speed_csv; Usage (it is of pictures of another size).
Result<SpeedTable> read_baseline(const std::string& path, const SpeedOptions& options)
{
    const Result<std::vector<std::byte>> bytes = read_file(path);
    if (!bytes.ok())
        return bytes.error();
    Result<SpeedTable> table = parse_speed_csv({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
    if (!table.ok())
        return Error{table.error().code, path + ", " + table.error().where, table.error().detail};
    for (const SpeedLine& line : *table)
        if (line.counts.width != options.width || line.counts.height != options.height)
            return Error{ErrorCode::Usage, "--size",
                         fmt::format("{} is of pictures of {}x{}; ask for that size", path,
                                     line.counts.width.value_or(0), line.counts.height.value_or(0))};
    return table;
}

std::string speed_text(std::optional<double> speed, std::optional<double> spread)
{
    if (!speed)
        return fmt::format("{:>10}{:>8}", "-", "");
    return fmt::format("{:>10.3g}{:>8}", *speed, spread ? fmt::format("{:.1f} %", 100 * *spread) : "");
}

void print_model(const SpeedModel& model)
{
    const SpeedCounts& pack = model.lines.front().counts;
    fmt::print("{}, {}: {} faces, {} patches, {} leaves; bytes: geometry {}, tree {}, exact trims {}, distance "
               "textures {}, file {}\n",
               printable(model.lines.front().model), model.lines.front().device, *pack.faces, *pack.patches,
               *pack.leaves, *pack.geometry_bytes, *pack.bvh_bytes, *pack.trim_exact_bytes, *pack.trim_sdf_bytes,
               *pack.file_bytes);
    for (const std::string& note : model.notes)
        fmt::print("note: {}\n", printable(note));
    fmt::print("{:<9}{:>10}{:>8}{:>10}{:>8}{:>10}{:>8}{:>12}{:>12}{:>13}{:>12}{:>12}{:>7}\n", "view", "ms", "spread",
               "x one ray", "spread", "x mesh", "spread", "nodes", "leaves", "newton steps", "curve tests",
               "uncertified", "wrong");
    for (const SpeedLine& line : model.lines) {
        const auto& [c, t] = std::pair(line.counts, line.times);
        fmt::print("{:<9}{}{}{}{:>12}{:>12}{:>13}{:>12}{:>12}{:>7}\n", line.view,
                   speed_text(t.picture_ms, t.picture_ms_spread),
                   speed_text(t.speed_to_one_ray, t.speed_to_one_ray_spread),
                   speed_text(t.speed_to_mesh, t.speed_to_mesh_spread), *c.node_visits, *c.leaf_visits, *c.newton_steps,
                   *c.curve_tests, *c.uncertified_pixels,
                   c.missing ? fmt::format("{}", *c.missing + *c.extra + *c.wrong_depth) : "-");
    }
    fmt::print("\n");
}

std::string percent(const ChangedCount& count)
{
    return count.stored > 0 ? fmt::format(" ({:+.3g} %)", 100 * (double(count.now) / double(count.stored) - 1)) : "";
}

void print_speeds(const SpeedComparison& comparison)
{
    for (const std::string baseline : {"one_ray", "mesh"}) {
        const std::optional<double> change = comparison.mean_change(baseline);
        if (!change)
            continue;
        const auto number = [&](SpeedVerdict verdict) {
            return std::count_if(comparison.speeds.begin(), comparison.speeds.end(), [&](const ChangedSpeed& speed) {
                return speed.baseline == baseline && speed.verdict == verdict;
            });
        };
        fmt::print(
            "speed to {}: {:.3f} x the stored (geometric mean); beyond the noise {} faster, {} slower; {} within "
            "it, {} without enough rounds\n",
            baseline, *change, number(SpeedVerdict::Faster), number(SpeedVerdict::Slower), number(SpeedVerdict::Same),
            number(SpeedVerdict::Open));
    }
    for (const ChangedSpeed& speed : comparison.speeds)
        if (speed.verdict == SpeedVerdict::Faster || speed.verdict == SpeedVerdict::Slower)
            fmt::print("  {}, {}: {:.3f} x as fast (speed to {} {:.4g}, stored {:.4g}; noise {:.1f} %)\n",
                       printable(speed.model), speed.view, speed.now / speed.stored, speed.baseline, speed.now,
                       speed.stored, 100 * speed.noise);
    if (!comparison.other_device.empty())
        fmt::print("times are not compared: those stored are of {}\n", printable(comparison.other_device));
}

void print_comparison(const SpeedComparison& comparison, const std::string& baseline)
{
    fmt::print("Beside {}: {} counts changed\n", printable(baseline), comparison.changed.size());
    for (const ChangedCount& count : comparison.changed)
        fmt::print("  {}, {}: {} was {}, is {}{}\n", printable(count.model), count.view, count.count, count.stored,
                   count.now, percent(count));
    for (const auto& [model, view] : comparison.not_stored)
        fmt::print("  {}, {}: not in the stored run\n", printable(model), printable(view));
    for (const auto& [model, view] : comparison.not_run)
        fmt::print("  {}, {}: stored, but not run\n", printable(model), printable(view));
    if (!comparison.not_compared.empty())
        fmt::print("  not compared, for one of the two has none: {}\n", fmt::join(comparison.not_compared, ", "));
    print_speeds(comparison);
}

/// Whether times wobbled, as report.h's.
void warn_when_busy(const SpeedTable& table)
{
    std::vector<double> spreads;
    for (const SpeedLine& line : table)
        if (line.times.picture_ms_spread)
            spreads.push_back(*line.times.picture_ms_spread);
    if (!spreads.empty() && median(spreads) > kBusySpread)
        report_note(fmt::format("the machine was busy: times wobbled by {:.0f} %; measure again when it is idle",
                                100 * median(spreads)));
}

Json run_json(const SpeedArguments& arguments, const std::vector<SpeedModel>& models,
              const std::optional<SpeedComparison>& comparison)
{
    const SpeedOptions& options = arguments.options;
    Json object{{"device", models.front().lines.front().device},
                {"width", options.width},
                {"height", options.height},
                {"threads", options.threads},
                {"rounds", options.rounds},
                {"models", Json::array()}};
    for (const SpeedModel& model : models) {
        Json row{{"model", model.lines.front().model}, {"notes", model.notes}, {"views", Json::array()}};
        for (const SpeedLine& line : model.lines)
            row["views"].push_back(to_json(line));
        object["models"].push_back(std::move(row));
    }
    object["comparison"] = comparison ? to_json(*comparison) : Json();
    return object;
}

Status write_table(const std::string& path, const SpeedTable& table)
{
    const std::string text = speed_csv(table);
    const auto bytes = std::as_bytes(std::span(text));
    return write_file_atomically(path, {bytes.begin(), bytes.end()});
}

/// Measures all models, and prints each unless JSON is asked for. The exit code: that of the first that fails, which
/// are reported, or kExitOk.
int measure_models(const SpeedArguments& arguments, std::vector<SpeedModel>& models)
{
    int exit_code = kExitOk;
    for (const std::string& file : arguments.models) {
        Result<SpeedModel> model = measure_speed(
            file, arguments.options, [&](const std::string& text) { report_progress(name_of(file) + ": " + text); });
        report_progress("");
        if (!model.ok()) {
            const int failed_code = report_error(model.error());
            exit_code = exit_code == kExitOk ? failed_code : exit_code;
            continue;
        }
        if (!arguments.json)
            print_model(*model);
        models.push_back(std::move(*model));
    }
    return exit_code;
}

int run(SpeedArguments arguments)
{
    SpeedOptions& options = arguments.options;
    const Result<PictureSize> size = parse_size(arguments.size, 1);
    if (!size.ok())
        return report_error(size.error());
    options.width = size->width;
    options.height = size->height;
    if (const Status distinct = check_names(arguments); !distinct.ok())
        return report_error(distinct.error());
    const bool compares = !arguments.baseline.empty(), writes = !arguments.write_baseline.empty();
    const Result<SpeedTable> stored = compares ? read_baseline(arguments.baseline, options) : SpeedTable{};
    if (!stored.ok())
        return report_error(stored.error());

    std::vector<SpeedModel> models;
    const int exit_code = measure_models(arguments, models);
    if (models.empty())
        return exit_code;
    SpeedTable lines;
    for (const SpeedModel& model : models)
        lines.insert(lines.end(), model.lines.begin(), model.lines.end());
    warn_when_busy(lines);
    std::optional<SpeedComparison> comparison;
    if (compares)
        comparison = compare_speeds(*stored, lines);
    if (arguments.json)
        print_json(run_json(arguments, models, comparison));
    else if (comparison)
        print_comparison(*comparison, arguments.baseline);
    if (exit_code != kExitOk) {
        if (writes)
            report_note(arguments.write_baseline + " is not written, for not all models were measured");
        return exit_code;
    }
    if (writes)
        if (const Status written = write_table(arguments.write_baseline, lines); !written.ok())
            return report_error(written.error());
    return arguments.check && !comparison->agrees() ? int{kExitPartial} : exit_code;
}

} // namespace

void register_speed(CLI::App& app, int& exit_code)
{
    CLI::App* command = app.add_subcommand("speed", "Speed beside baselines, and exact counts, against a stored run");
    const auto a = std::make_shared<SpeedArguments>();
    command->add_option("MODEL", a->models, "Scene packs (.tray), or CAD files, which are converted")->required();
    command
        ->add_option("--views", a->options.views,
                     "iso, front, back, left, right, top, bottom and close-up, with commas")
        ->delimiter(',')
        ->capture_default_str();
    command->add_option("--size", a->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
    command
        ->add_option("--rounds", a->options.rounds,
                     "How often each picture is timed; 0: counts alone, without baselines")
        ->check(CLI::Range(0u, 10000u))
        ->capture_default_str();
    command->add_option("--threads", a->options.threads, "CPU threads; 0: all cores")
        ->check(CLI::Range(0u, 1024u))
        ->capture_default_str();
    command->add_option("--instruction-set", a->options.instruction_set, "avx512, avx2 or sse4; default: the best");
    command->add_flag("--errors", a->options.errors, "Count the pixels that differ from the reference's, in double");
    CLI::Option* baseline = command->add_option("--baseline", a->baseline, "The stored run to compare with, CSV");
    command->add_option("--write-baseline", a->write_baseline,
                        "Store this run, when all models were measured; may be the --baseline");
    command
        ->add_flag("--check", a->check, "Exit code 6 where the stored run has other counts, or other models or views")
        ->needs(baseline);
    command->add_flag("--json", a->json, "Print one JSON object");
    command->footer(kSpeedFooter);
    command->callback([a, &exit_code] { exit_code = run(*a); });
}

} // namespace trimray
