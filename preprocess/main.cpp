// trimray-pack: a CAD file in, a scene pack or a mesh out. The work runs in a child process with limits on time and
// memory, since damaged files make the CAD kernel crash or hang; this process parses, waits and reports.
#include "format/command_report.h"
#include "format/pack_writer.h"
#include "format/result.h"
#include "preprocess/convert.h"
#include "preprocess/pack_options.h"
#include "preprocess/source/source_file.h"
#include "preprocess/worker/worker.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <unistd.h>

namespace {
using namespace trimray;
using Json = nlohmann::ordered_json;

struct Options {
    ConvertJob job;
    WorkerLimits limits;
    bool json = false, progress = false;
    bool mesh = false; // else a pack
};

constexpr double kLargestDeflection = 0.1; // of the model's diagonal

constexpr const char* kFooter =
    "MODEL is a STEP (.step, .stp), IGES (.iges, .igs) or BREP (.brep) file; it may be compressed (.zst, .gz), and in\n"
    "a zip archive: ARCHIVE!/MEMBER, or ARCHIVE alone where that holds one model.\n"
    "\nExamples:\n"
    "  trimray-pack engine.step -o engine.tray\n"
    "  trimray-pack engine.step.zst -o engine.tray --trim-memory 100% --json\n"
    "  trimray-pack 'parts.zip!/gears/a.step' -o gear.tray\n"
    "  trimray-pack engine.step -o papers.tray --surfaces bezier --leaf-budget 1\n"
    "  trimray-pack board.stp -o board.tray --compact --timeout 600 --memory-limit 4GiB\n"
    "  trimray-pack engine.step --mesh 1e-4 -o engine.trimesh\n"
    "\nExit codes: 0 done, 1 usage, 2 file not read or written, 3 invalid input, 4 unsupported, 5 internal,\n"
    "6 done but some faces were dropped (and named).";

constexpr const char* kProgram = "trimray-pack";

Result<std::optional<Options>> parse_options(int argc, char** argv)
{
    Options options;
    PackWords words;
    LimitWords limits;
    CLI::App app{"Converts a CAD model into a scene pack that trimray ray traces directly.", "trimray-pack"};
    app.footer(kFooter);
    app.set_version_flag("--version", "trimray-pack " TRIMRAY_VERSION);
    app.add_option("MODEL", options.job.model, "The CAD file")->required();
    app.add_option("-o,--output", options.job.output, "The pack to write (.tray), or the mesh (.trimesh)")->required();
    CLI::Option* mesh = app.add_option(
        "--mesh", words.options.import.mesh_deflection,
        "Write triangles instead of a pack, with its faces, placements and colours; the CAD kernel is to keep "
        "them as near the surfaces as this share of the model's diagonal");
    for (CLI::Option* of_packs : add_pack_options(app, words))
        if (of_packs->get_name() != "--surfaces" && of_packs->get_name() != "--heal")
            mesh->excludes(of_packs);
    add_limit_options(app, limits);
    app.add_option("--threads", words.options.build.threads, "Threads after the file is read; 0: one a core")
        ->check(CLI::Range(0, 4096))
        ->capture_default_str();
    mesh->excludes(app.add_option("--dump-trims", options.job.dump_folder,
                                  "Write each trimmed face's loops and distances as a picture"));
    app.add_flag("--json", options.json, "Report as one JSON object");
    app.add_flag(
        "--progress", options.progress,
        "Say each phase and its share done on stderr, lines 'progress PHASE SHARE' (-1: unknown), for programs "
        "that wait; a terminal is told anyway");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) { // --help, --version
            app.exit(error);
            return std::optional<Options>();
        }
        return Error{ErrorCode::Usage, "", fmt::format("{}; see 'trimray-pack --help'", error.what())};
    }
    const Result<PackOptions> understood = understand(words);
    if (!understood)
        return understood.error();
    const Result<WorkerLimits> limited = understand(limits, 1);
    if (!limited)
        return limited.error();
    options.job.options = *understood;
    options.limits = *limited;
    options.mesh = mesh->count() > 0;
    if (const double share = options.job.options.import.mesh_deflection;
        options.mesh && !(share > 0 && share <= kLargestDeflection))
        return Error{ErrorCode::Usage, "--mesh",
                     fmt::format("{} is not above 0 and at most {}", share, kLargestDeflection)};
    return std::optional(options);
}

/// What runs in the worker. Returns the report as JSON text.
Result<std::string> work(const Options& options, const SourceFile& source, const WorkerReport& report)
{
    std::optional<tbb::global_control> threads;
    if (const int count = options.job.options.build.threads; count > 0)
        threads.emplace(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(count));
    const Result<Json> done =
        options.mesh ? convert_to_mesh(options.job, source, report) : convert_to_pack(options.job, source, report);
    if (!done)
        return done.error();
    return done->dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string size_text(double bytes)
{
    constexpr const char* kUnits[] = {"B", "KiB", "MiB", "GiB"};
    size_t unit = 0;
    for (; bytes >= 1024 && unit + 1 < std::size(kUnits); ++unit)
        bytes /= 1024;
    return unit == 0 ? fmt::format("{:.0f} B", bytes) : fmt::format("{:.1f} {}", bytes, kUnits[unit]);
}

void row(const char* label, const std::string& text)
{
    fmt::print("{:<10} {}\n", label, text);
}

void print_seconds_and_dropped(const Json& report)
{
    std::string times;
    for (const auto& [phase, seconds] : report["seconds"].items())
        times += fmt::format("{}{} {:.2f}", times.empty() ? "" : ", ", phase, seconds.get<double>());
    row("seconds", times);
    for (const Json& face : report["dropped"])
        row("dropped",
            fmt::format("face {} of part {} \"{}\": {}", face["face"].get<size_t>(), face["part"].get<size_t>(),
                        face["part_name"].get<std::string>(), face["reason"].get<std::string>()));
}

void print_table(const Json& report)
{
    row("source",
        fmt::format("{} ({}, {}, {})", report["source"].get<std::string>(), report["source_format"].get<std::string>(),
                    report["source_unit"].get<std::string>(), size_text(report["source_bytes"])));
    row("pack", fmt::format("{} ({})", report["output"].get<std::string>(), size_text(report["bytes"])));
    row("faces", fmt::format("{} of {} converted, {} dropped", report["converted"].get<size_t>(),
                             report["faces"].get<size_t>(), report["dropped"].size()));
    row("scene",
        fmt::format("{} parts, {} instances, {} faces placed, {} patches, {} leaves", report["parts"].get<size_t>(),
                    report["instances"].get<size_t>(), report["faces_instanced"].get<size_t>(),
                    report["patches"].get<size_t>(), report["leaves"].get<size_t>()));
    const Json& trims = report["trims"];
    row("trims", fmt::format("pcurves within {:.3g} mm of their edges, {} beyond an edge's tolerance, {} rebuilt",
                             trims["largest_pcurve_deviation_mm"].get<double>(),
                             trims["pcurves_above_tolerance"].get<size_t>(), trims["pcurves_rebuilt"].get<size_t>()));
    std::string findings;
    for (const auto& [name, count] : trims["findings"].items())
        if (count.get<size_t>() > 0)
            findings += fmt::format("{}{} ({})", findings.empty() ? "" : ", ", name, count.get<size_t>());
    if (!findings.empty())
        row("", findings + "; --json names the faces");
    print_seconds_and_dropped(report);
}

void print_mesh_table(const Json& report)
{
    row("mesh", fmt::format("{} ({})", report["output"].get<std::string>(), size_text(report["bytes"])));
    row("triangles", fmt::format("{} with {} vertices, meant to lie within {:.3g} mm of the surfaces",
                                 report["triangles"].get<size_t>(), report["vertices"].get<size_t>(),
                                 report["deflection_mm"].get<double>()));
    print_seconds_and_dropped(report);
    for (const Json& face : report["without_triangles"])
        row("missing", fmt::format("face {} of the pack: the kernel made no triangles", face.get<size_t>()));
}

/// Shows the phase on a terminal, in lines to a program that asks for them, else nothing.
WorkerProgress shown_progress(bool in_lines)
{
    if (in_lines)
        return [](const char* phase, double share) { fmt::print(stderr, "progress {} {:.2f}\n", phase, share); };
    if (!isatty(STDERR_FILENO))
        return {};
    return [](const char* phase, double share) {
        const std::string text =
            share < 0 ? fmt::format("{} ...", phase) : fmt::format("{} {:3.0f} %", phase, 100 * share);
        fmt::print(stderr, "\r\033[K{}", text);
        std::fflush(stderr);
    };
}

int run(int argc, char** argv)
{
    const Result<std::optional<Options>> parsed = parse_options(argc, argv);
    if (!parsed)
        return report_error(parsed.error(), kProgram);
    if (!*parsed)
        return kExitOk;
    const Options& options = **parsed;
    const Result<SourceFile> source = SourceFile::open(options.job.model);
    if (!source)
        return report_error(source.error(), kProgram);

    std::error_code none; // a pack that does not exist yet is no file to be overwritten
    if (std::filesystem::equivalent(source->file, options.job.output, none))
        return report_error(
            {ErrorCode::Usage, options.job.output, "is the model itself; name another file for the pack"}, kProgram);

    const WorkerProgress progress = shown_progress(options.progress);
    const Result<std::string> answer = run_in_worker(
        options.job.model, [&](const WorkerReport& report) { return work(options, *source, report); }, options.limits,
        progress);
    if (progress && !options.progress)
        fmt::print(stderr, "\r\033[K");
    if (!answer) {
        sweep_stale_temporaries(options.job.output); // of a worker that was ended while it wrote
        return report_error(answer.error(), kProgram);
    }
    const Json report = Json::parse(*answer);
    for (const Json& warning : report["warnings"])
        report_note(fmt::format("{}: warning: {}", options.job.model, warning.get<std::string>()), kProgram);
    if (options.json)
        fmt::print("{}\n", *answer);
    else if (options.mesh)
        print_mesh_table(report);
    else
        print_table(report);
    const bool whole = report["dropped"].empty() && (!options.mesh || report["without_triangles"].empty());
    return whole ? kExitOk : kExitPartial;
}

} // namespace

int main(int argc, char** argv)
{
    int code = kExitInternal;
    try {
        code = run(argc, argv);
    } catch (const std::exception& failure) {
        code = report_error({ErrorCode::Internal, "", failure.what()}, kProgram);
    }
    if ((std::fflush(stdout) != 0 || std::ferror(stdout) != 0) && code == kExitOk)
        code = report_error({ErrorCode::FileNotWritable, "stdout", "cannot be written; is the disk full?"}, kProgram);
    return code;
}
