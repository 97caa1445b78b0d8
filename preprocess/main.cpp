// trimray-pack: a CAD file in, a scene pack or a mesh out. The work runs in a child process with limits on time and
// memory, since damaged files make the CAD kernel crash or hang; this process parses, waits and reports.
#include "format/mesh_file.h"
#include "format/pack_file.h"
#include "format/pack_writer.h"
#include "format/result.h"
#include "preprocess/build_pack.h"
#include "preprocess/cad_import.h"
#include "preprocess/collect_mesh.h"
#include "preprocess/dump_trims.h"
#include "preprocess/preview.h"
#include "preprocess/source_file.h"
#include "preprocess/trim_report.h"
#include "preprocess/worker.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <sys/resource.h>
#include <unistd.h>

namespace {
using namespace trimray;
using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

struct Options {
    std::string model, output, dump_folder;
    ImportOptions import;
    BuildOptions build;
    WorkerLimits limits;
    bool previews = true, json = false;
    bool mesh = false; // else a pack
};

constexpr double kLargestDeflection = 0.1; // of the model's diagonal

constexpr const char* kFooter =
    "MODEL is a STEP (.step, .stp), IGES (.iges, .igs) or BREP (.brep) file; it may be compressed (.zst).\n"
    "\nExamples:\n"
    "  trimray-pack engine.step -o engine.tray\n"
    "  trimray-pack engine.step.zst -o engine.tray --trim-memory 100% --json\n"
    "  trimray-pack engine.step -o papers.tray --surfaces bezier --leaf-budget 1\n"
    "  trimray-pack board.stp -o board.tray --compact --timeout 600 --memory-limit 4GiB\n"
    "  trimray-pack engine.step --mesh 1e-4 -o engine.trimesh\n"
    "\nExit codes: 0 done, 1 usage, 2 file not read or written, 3 invalid input, 4 unsupported, 5 internal,\n"
    "6 done but some faces were dropped (and named).";

int report_error(const Error& error)
{
    std::string line = fmt::format("trimray-pack: {}{}{} [E{}]", error.where, error.where.empty() ? "" : ": ",
                                   error.detail, static_cast<int>(error.code));
    // one line each, whatever a file is called
    std::replace_if(
        line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
    fmt::print(stderr, "{}\n", line);
    return exit_code(error);
}

/// "8MiB", "4GB", "1048576" -> bytes.
std::optional<double> parse_bytes(const std::string& text)
{
    double value = 0;
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failure != std::errc() || !std::isfinite(value) || value < 0)
        return std::nullopt;
    const std::string unit(end, text.data() + text.size());
    constexpr std::pair<const char*, double> kUnits[] = {
        {"", 1},      {"B", 1},         {"kB", 1e3},      {"KB", 1e3},      {"MB", 1e6},     {"GB", 1e9},
        {"TB", 1e12}, {"KiB", 1 << 10}, {"MiB", 1 << 20}, {"GiB", 1 << 30}, {"TiB", 0x1p40},
    };
    for (const auto& [name, factor] : kUnits)
        if (unit == name)
            return value * factor;
    return std::nullopt;
}

Status parse_trim_memory(const std::string& text, BuildOptions& build)
{
    if (text.ends_with('%')) {
        if (const auto percent = parse_bytes(text.substr(0, text.size() - 1)); percent && *percent <= 10000) {
            build.trim_memory_fraction = *percent / 100;
            return Done{};
        }
    } else if (const auto bytes = parse_bytes(text)) {
        build.trim_memory_bytes = *bytes;
        return Done{};
    }
    return Error{ErrorCode::Usage, "--trim-memory",
                 fmt::format("'{}' is neither a share like 50% nor a size like 8MiB", text)};
}

Result<std::optional<Options>> parse_options(int argc, char** argv)
{
    Options options;
    std::string surfaces = "native", source = "curve", layout = "isotropic", trim_memory = "100%",
                memory_limit = "8GiB";
    bool no_previews = false;
    CLI::App app{"Converts a CAD model into a scene pack that trimray ray traces directly.", "trimray-pack"};
    app.footer(kFooter);
    app.set_version_flag("--version", "trimray-pack " TRIMRAY_VERSION);
    app.add_option("MODEL", options.model, "The CAD file")->required();
    app.add_option("-o,--output", options.output, "The pack to write (.tray), or the mesh (.trimesh)")->required();
    CLI::Option* mesh = app.add_option(
        "--mesh", options.import.mesh_deflection,
        "Write triangles instead of a pack, with its faces, placements and colours; the CAD kernel is to keep "
        "them as near the surfaces as this share of the model's diagonal");
    app.add_option("--surfaces", surfaces, "native: planes to tori keep their own form; bezier: all as splines")
        ->check(CLI::IsMember({"native", "bezier"}))
        ->capture_default_str();
    app.add_option("--trim-memory", trim_memory,
                   "Distance textures: a share of the kd-tree's size (50%), a size (8MiB), or 0 for none")
        ->capture_default_str();
    app.add_option("--trim-source", source,
                   "Distances to the trim curves themselves, or the paper's: to a mask's pixels")
        ->check(CLI::IsMember({"curve", "mask"}))
        ->capture_default_str();
    app.add_option("--trim-layout", layout, "Texels with equal sides on the surface, or the paper's square textures")
        ->check(CLI::IsMember({"isotropic", "square"}))
        ->capture_default_str();
    app.add_option(
           "--leaf-slope", options.build.leaves.leaf_slope_deg,
           "Cut patches into leaves until rays steeper than this against a leaf, in degrees, are proved to meet "
           "it once; fewer degrees: more leaves, fewer searches for more hits")
        ->check(CLI::Range(1.0, 90.0))
        ->capture_default_str();
    app.add_option("--leaf-budget", options.build.leaves.max_leaves_per_patch,
                   "Leaves of a Bezier patch at most; 1 is the paper's setting")
        ->check(CLI::Range(1u, kMaxLeavesPerPatch))
        ->capture_default_str();
    app.add_flag("--compact", options.build.compact,
                 "Leave out what can be built again at load, the larger preview and the coarse triangles");
    app.add_flag("--heal", options.import.heal, "Run the CAD kernel's full shape healing (slow)");
    app.add_option("--timeout", options.limits.wall_seconds, "Seconds the conversion may take; 0: no limit")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app.add_option("--memory-limit", memory_limit, "Memory the conversion may use, as 8GiB; 0: no limit")
        ->capture_default_str();
    app.add_option("--threads", options.build.threads, "Threads after the file is read; 0: one a core")
        ->check(CLI::Range(0, 4096))
        ->capture_default_str();
    app.add_option("--dump-trims", options.dump_folder, "Write each trimmed face's loops and distances as a picture");
    app.add_flag("--no-previews", no_previews, "Leave out the preview pictures");
    app.add_flag("--json", options.json, "Report as one JSON object");
    for (const char* of_packs : {"--trim-memory", "--trim-source", "--trim-layout", "--leaf-slope", "--leaf-budget",
                                 "--compact", "--dump-trims", "--no-previews"})
        mesh->excludes(app.get_option(of_packs));
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) { // --help, --version
            app.exit(error);
            return std::optional<Options>();
        }
        return Error{ErrorCode::Usage, "", fmt::format("{}; see 'trimray-pack --help'", error.what())};
    }
    if (const Status parsed = parse_trim_memory(trim_memory, options.build); !parsed)
        return parsed.error();
    const std::optional<double> memory = parse_bytes(memory_limit);
    if (!memory || *memory > 0x1p60)
        return Error{ErrorCode::Usage, "--memory-limit", fmt::format("'{}' is no size like 8GiB", memory_limit)};
    options.limits.memory_bytes = static_cast<uint64_t>(*memory);
    options.import.native_surfaces = surfaces == "native";
    options.build.trim_textures.source = source == "mask" ? TrimSource::Mask : TrimSource::Curve;
    options.build.trim_textures.layout = layout == "square" ? TrimLayout::Square : TrimLayout::Isotropic;
    options.previews = !no_previews;
    options.mesh = mesh->count() > 0;
    if (const double share = options.import.mesh_deflection;
        options.mesh && !(share > 0 && share <= kLargestDeflection))
        return Error{ErrorCode::Usage, "--mesh",
                     fmt::format("{} is not above 0 and at most {}", share, kLargestDeflection)};
    return std::optional(options);
}

/// The options that change a pack's content, for its provenance.
std::string provenance_options(const Options& options)
{
    Json json;
    json["surfaces"] = options.import.native_surfaces ? "native" : "bezier";
    json["heal"] = options.import.heal;
    if (options.build.trim_memory_bytes >= 0)
        json["trim_memory_bytes"] = options.build.trim_memory_bytes;
    else
        json["trim_memory_fraction"] = options.build.trim_memory_fraction;
    json["trim_source"] = options.build.trim_textures.source == TrimSource::Mask ? "mask" : "curve";
    json["trim_layout"] = options.build.trim_textures.layout == TrimLayout::Square ? "square" : "isotropic";
    json["leaf_slope_deg"] = options.build.leaves.leaf_slope_deg;
    json["leaf_budget"] = options.build.leaves.max_leaves_per_patch;
    json["compact"] = options.build.compact;
    return json.dump();
}

double seconds_since(Clock::time_point start)
{
    return std::chrono::duration<double>(Clock::now() - start).count();
}

Json dropped_json(const PackImage& image)
{
    Json list = Json::array();
    for (const DroppedFace& face : image.dropped)
        list.push_back(
            {{"face", face.face_in_part},
             {"part", face.part},
             {"part_name",
              face.part < image.parts.size() ? image.strings.strings[image.parts[face.part].name] : std::string()},
             {"name", image.strings.strings[face.name]},
             {"reason", image.strings.strings[face.reason]}});
    return list;
}

const char* state_text(PcurveState state)
{
    switch (state) {
    case PcurveState::WithinTolerance:
        break;
    case PcurveState::Rebuilt:
        return "rebuilt";
    case PcurveState::Small:
        return "kept: less than the pack resolves";
    case PcurveState::OffSurface:
        return "kept: the edge's curve lies off the surface";
    case PcurveState::NotBettered:
        return "kept: no projection is much nearer";
    case PcurveState::NotMeasured:
        return "kept: the kernel could not measure it";
    }
    return "within tolerance";
}

size_t pcurve_count(const CadModel& model)
{
    size_t count = 0;
    for (const CadPart& part : model.parts)
        for (const CadFace& face : part.faces)
            for (const CadLoop& loop : face.loops)
                count += loop.size();
    return count;
}

Json trims_json(const DeviationReport& deviations)
{
    Json worst = Json::array();
    for (const PcurveDeviation& d : deviations.worst) {
        worst.push_back({{"face", d.face_in_part},
                         {"part", d.part},
                         {"edge", d.edge},
                         {"deviation_mm", d.deviation_mm},
                         {"tolerance_mm", d.tolerance_mm},
                         {"pcurve", state_text(d.state)}});
        if (d.state == PcurveState::Rebuilt)
            worst.back()["file_deviation_mm"] = d.file_deviation_mm;
    }
    return {{"largest_pcurve_deviation_mm", deviations.largest_mm},
            {"pcurves_above_tolerance", deviations.above_tolerance},
            {"pcurves_rebuilt", deviations.rebuilt},
            {"edges_above_tolerance", worst}};
}

constexpr size_t kMostFindings = 1000; // in a report; beside them it says how many there are

Json findings_json(const std::vector<FaceFinding>& findings)
{
    Json list = Json::array();
    for (size_t i = 0; i < std::min(findings.size(), kMostFindings); ++i)
        list.push_back({{"face", findings[i].face_in_part},
                        {"part", findings[i].part},
                        {"finding", finding_name(findings[i].finding.kind)},
                        {"detail", finding_detail(findings[i].finding)}});
    return list;
}

/// How many findings there are of each kind.
Json finding_counts(const std::vector<FaceFinding>& findings)
{
    Json counts = Json::object();
    for (const TrimFindingKind kind :
         {TrimFindingKind::OpenLoop, TrimFindingKind::TurnedLoop, TrimFindingKind::TouchingLoops,
          TrimFindingKind::CrossingLoops, TrimFindingKind::NotGrown})
        counts[finding_name(kind)] = std::count_if(
            findings.begin(), findings.end(), [&](const FaceFinding& found) { return found.finding.kind == kind; });
    return counts;
}

/// Fails: as import_cad, at the model.
Result<CadModel> import_model(const Options& options, const SourceFile& source, const WorkerProgress& progress)
{
    ImportOptions import = options.import;
    import.name = source.name.substr(0, source.name.find_last_of('.'));
    Result<CadModel> model = import_cad(source.path, import, progress);
    if (model)
        return model;
    Error error = model.error();
    if (error.where == source.path)
        error.where = options.model;
    return error;
}

/// Fails: EmptyCad, where no face was converted.
Status check_faces(const Options& options, const PackImage& image)
{
    if (!image.faces.empty())
        return Done{};
    std::string detail = fmt::format("none of its {} faces could be converted", image.dropped.size());
    if (!image.dropped.empty())
        detail += ", the first because: " + image.strings.strings[image.dropped.front().reason];
    return Error{ErrorCode::EmptyCad, options.model, detail + "; try --heal"};
}

std::string report_text(const Json& json)
{
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// Instead of the pack the model's triangles. Returns the report as JSON text.
Result<std::string> write_mesh(const Options& options, const SourceFile& source, const WorkerProgress& progress)
{
    const Result<CadModel> model = import_model(options, source, progress);
    if (!model)
        return model.error();
    progress("convert", -1);
    BuildReport report;
    ConvertedFaces converted = convert_faces(*model, options.build, report);
    if (const Status some = check_faces(options, converted.image); !some)
        return some.error();
    const Result<TriangleMesh> mesh = collect_mesh(*model, converted);
    if (!mesh)
        return mesh.error();
    if (mesh->triangle_face.empty()) {
        std::string detail = "the kernel made no triangles";
        for (const std::string& warning : report.warnings)
            detail += "; " + warning;
        return Error{ErrorCode::EmptyCad, options.model, detail};
    }
    progress("write", -1);
    const auto write_start = Clock::now();
    const std::vector<std::byte> bytes = encode_mesh(*mesh);
    if (const Status written = write_file_atomically(options.output, bytes); !written)
        return written.error();
    const double write_seconds = seconds_since(write_start);

    Json json;
    json["source"] = source.name;
    json["output"] = options.output;
    json["faces"] = report.faces;
    json["dropped"] = dropped_json(converted.image);
    json["without_triangles"] = faces_without_triangles(*mesh);
    json["triangles"] = mesh->triangle_face.size();
    json["vertices"] = mesh->positions.size() / 3;
    json["deflection_mm"] = mesh->deflection_mm;
    json["seconds"] = {{"read", model->read_seconds},
                       {"transfer", model->transfer_seconds},
                       {"mesh", model->mesh_seconds},
                       {"write", write_seconds}};
    json["bytes"] = bytes.size();
    json["warnings"] = report.warnings;
    return report_text(json);
}

/// The whole conversion to a pack. Returns the report as JSON text.
Result<std::string> convert(const Options& options, const SourceFile& source, const WorkerProgress& progress)
{
    const auto start = Clock::now();
    const Result<CadModel> model = import_model(options, source, progress);
    if (!model)
        return model.error();
    progress("convert", -1);
    BuildReport report;
    PackImage image = build_pack(*model, options.build, report);
    image.provenance.source_name = source.name;
    image.provenance.source_sha_or_xxh = source.hash;
    image.provenance.tool_version = "trimray-pack " TRIMRAY_VERSION;
    image.provenance.options_json = provenance_options(options);
    if (const Status some = check_faces(options, image); !some)
        return some.error();
    if (!options.dump_folder.empty()) {
        progress("dump", -1);
        if (const Status dumped = dump_trims(image, options.dump_folder); !dumped)
            return dumped.error();
    }
    double preview_seconds = 0;
    if (options.previews) {
        progress("previews", -1);
        const auto preview_start = Clock::now();
        if (const Status added = add_previews(image, find_trimray_program()); !added)
            report.warnings.push_back(
                fmt::format("no preview pictures: {}: {}", added.error().where, added.error().detail));
        preview_seconds = seconds_since(preview_start);
    }
    progress("write", -1);
    const auto write_start = Clock::now();
    const std::vector<std::byte> bytes = encode_pack(image, {});
    if (const Status written = write_file_atomically(options.output, bytes); !written)
        return written.error();
    const double write_seconds = seconds_since(write_start);

    size_t instanced = 0;
    for (const InstanceRecord& instance : image.instances)
        instanced += image.parts[instance.part].face_count;
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    Json json;
    json["source"] = source.name;
    json["source_format"] = model->source_format;
    json["source_unit"] = model->source_unit;
    json["source_bytes"] = source.bytes;
    json["output"] = options.output;
    json["faces"] = report.faces;
    json["converted"] = report.converted;
    json["dropped"] = dropped_json(image);
    json["parts"] = image.parts.size();
    json["instances"] = image.instances.size();
    json["faces_instanced"] = instanced;
    json["pcurves"] = pcurve_count(*model);
    json["patches"] = image.patches.size();
    json["trim_pieces"] = image.trim_pieces.size();
    json["leaves"] = image.leaves.size();
    json["trims"] = trims_json(gather_deviations(*model));
    json["trims"]["findings"] = finding_counts(report.trim_findings);
    json["trim_findings"] = findings_json(report.trim_findings);
    json["seconds"] = {
        {"read", model->read_seconds}, {"transfer", model->transfer_seconds}, {"faces", model->faces_seconds},
        {"mesh", model->mesh_seconds}, {"convert", report.convert_seconds},   {"trims", report.trims_seconds},
        {"bvh", report.bvh_seconds},   {"proxy", report.proxy_seconds},       {"preview", preview_seconds},
        {"write", write_seconds},      {"total", seconds_since(start)}};
    json["bytes"] = bytes.size();
    json["peak_memory_bytes"] = static_cast<uint64_t>(usage.ru_maxrss) * 1024;
    json["warnings"] = report.warnings;
    return report_text(json);
}

/// What runs in the worker.
Result<std::string> work(const Options& options, const SourceFile& source, const WorkerProgress& progress)
{
    std::optional<tbb::global_control> threads;
    if (options.build.threads > 0)
        threads.emplace(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(options.build.threads));
    return options.mesh ? write_mesh(options, source, progress) : convert(options, source, progress);
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

/// Shows the phase on a terminal, nothing elsewhere.
WorkerProgress terminal_progress()
{
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
        return report_error(parsed.error());
    if (!*parsed)
        return kExitOk;
    const Options& options = **parsed;
    const Result<SourceFile> source = SourceFile::open(options.model);
    if (!source)
        return report_error(source.error());

    std::error_code none; // a pack that does not exist yet is no file to be overwritten
    if (std::filesystem::equivalent(options.model, options.output, none))
        return report_error({ErrorCode::Usage, options.output, "is the model itself; name another file for the pack"});

    const WorkerProgress progress = terminal_progress();
    const Result<std::string> answer = run_in_worker(
        options.model, [&](const WorkerProgress& report) { return work(options, *source, report); }, options.limits,
        progress);
    if (progress)
        fmt::print(stderr, "\r\033[K");
    if (!answer) {
        sweep_stale_temporaries(options.output); // of a worker that was ended while it wrote
        return report_error(answer.error());
    }
    const Json report = Json::parse(*answer);
    for (const Json& warning : report["warnings"])
        fmt::print(stderr, "trimray-pack: {}: warning: {}\n", options.model, warning.get<std::string>());
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
        code = report_error({ErrorCode::Internal, "", failure.what()});
    }
    if ((std::fflush(stdout) != 0 || std::ferror(stdout) != 0) && code == kExitOk)
        code = report_error({ErrorCode::FileNotWritable, "stdout", "cannot be written; is the disk full?"});
    return code;
}
