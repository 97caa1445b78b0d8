#include "preprocess/convert.h"

#include "format/mesh_file.h"
#include "format/pack_writer.h"
#include "preprocess/build_pack.h"
#include "preprocess/collect_mesh.h"
#include "preprocess/dump_trims.h"
#include "preprocess/import/cad_import.h"
#include "preprocess/preview.h"
#include "preprocess/trims/trim_report.h"

#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <optional>
#include <sys/resource.h>

namespace trimray {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

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
Result<CadModel> import_model(const ConvertJob& job, const SourceFile& source, const WorkerProgress& progress)
{
    ImportOptions import = job.options.import;
    import.file_name = source.name;
    Result<CadModel> model = import_cad(source.path, import, progress);
    if (model)
        return model;
    Error error = model.error();
    if (error.where == source.path)
        error.where = job.model;
    return error;
}

/// Fails: EmptyCad, where no face was converted.
Status check_faces(const ConvertJob& job, const PackImage& image)
{
    if (!image.faces.empty())
        return Done{};
    std::string detail = fmt::format("none of its {} faces could be converted", image.dropped.size());
    if (!image.dropped.empty())
        detail += ", the first because: " + image.strings.strings[image.dropped.front().reason];
    return Error{ErrorCode::EmptyCad, job.model, detail + "; try --heal"};
}

} // namespace

Result<nlohmann::ordered_json> convert_to_mesh(const ConvertJob& job, const SourceFile& source,
                                               const WorkerProgress& progress)
{
    const Result<CadModel> model = import_model(job, source, progress);
    if (!model)
        return model.error();
    progress("convert", -1);
    BuildReport report;
    ConvertedFaces converted = convert_faces(*model, job.options.build, report);
    if (const Status some = check_faces(job, converted.image); !some)
        return some.error();
    const Result<TriangleMesh> mesh = collect_mesh(*model, converted);
    if (!mesh)
        return mesh.error();
    if (mesh->triangle_face.empty()) {
        std::string detail = "the kernel made no triangles";
        for (const std::string& warning : report.warnings)
            detail += "; " + warning;
        return Error{ErrorCode::EmptyCad, job.model, detail};
    }
    progress("write", -1);
    const auto write_start = Clock::now();
    const std::vector<std::byte> bytes = encode_mesh(*mesh);
    if (const Status written = write_file_atomically(job.output, bytes); !written)
        return written.error();
    const double write_seconds = seconds_since(write_start);

    Json json;
    json["source"] = source.name;
    json["output"] = job.output;
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
    return json;
}

Result<nlohmann::ordered_json> convert_to_pack(const ConvertJob& job, const SourceFile& source,
                                               const WorkerProgress& progress)
{
    const auto start = Clock::now();
    const Result<CadModel> model = import_model(job, source, progress);
    if (!model)
        return model.error();
    progress("convert", -1);
    BuildReport report;
    PackImage image = build_pack(*model, job.options.build, report);
    image.provenance.source_name = source.name;
    image.provenance.source_hash = source.content_hash;
    image.provenance.tool_version = "trimray-pack " TRIMRAY_VERSION;
    image.provenance.options_json = provenance_options(job.options);
    if (const Status some = check_faces(job, image); !some)
        return some.error();
    if (!job.dump_folder.empty()) {
        progress("dump", -1);
        if (const Status dumped = dump_trims(image, job.dump_folder); !dumped)
            return dumped.error();
    }
    double preview_seconds = 0;
    if (job.options.previews) {
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
    if (const Status written = write_file_atomically(job.output, bytes); !written)
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
    json["output"] = job.output;
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
    return json;
}

} // namespace trimray
