#include "format/command_report.h"
#include "format/pack_reader.h"
#include "runtime/command_json.h"
#include "runtime/commands.h"
#include "runtime/effect_plan.h"
#include "runtime/leaf_slopes.h"
#include "runtime/pack_names.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>

namespace trimray {
namespace {

struct InfoArguments {
    std::string pack;
    bool json = false;
};

std::string pack_version(const LoadedPack& pack)
{
    return fmt::format("{}.{}", pack.version_major, pack.version_minor);
}

Json info_json(const LoadedPack& pack)
{
    const PackImage& image = pack.image;
    Json info;
    info["version"] = pack_version(pack);
    info["source"] = image.provenance.source_name;
    info["units"] = image.provenance.source_unit;
    info["faces"] = image.faces.size();
    info["faces_by_kind"] = Json::object();
    const auto by_kind = faces_by_kind(image);
    for (uint kind = 0; kind < kSurfaceKindCount; ++kind)
        info["faces_by_kind"][surface_kind_name(kind)] = by_kind[kind];
    info["instances"] = image.instances.size();
    info["patches"] = image.patches.size();
    info["leaves"] = image.leaves.size();
    info["parts"] = image.parts.size();
    info["bounds_mm"] = {image.bounds_lo_mm, image.bounds_hi_mm};
    info["bytes_by_section"] = Json::object();
    for (const SectionInfo& section : pack.sections)
        info["bytes_by_section"][section.id] = section.stored_bytes;
    info["effects"] = plan_json(effect_plan(pack_facts(image), {}, DeviceKind::Cpu));
    info["dropped"] = Json::array();
    for (const DroppedFace& face : image.dropped)
        info["dropped"].push_back({{"face", face.face_in_part},
                                   {"reason", string_at(image, face.reason)},
                                   {"part", face.part},
                                   {"name", string_at(image, face.name)}});
    // beyond the contract: how steep a ray must be for its one hit to be proved, where the pack comes from, its size
    const LeafSlopes slopes = leaf_slopes(image);
    info["bezier_leaves"] = {{"count", slopes.leaves}, {"flagged", slopes.flagged}};
    for (size_t i = 0; i < slopes.proved.size(); ++i)
        info["bezier_leaves"]["proved_above_deg"][fmt::format("{}", LeafSlopes::kDegrees[i])] = slopes.proved[i];
    info["file_bytes"] = pack.file_bytes;
    info["content_id"] = fmt::format("{:016x}", pack.content_id);
    info["compact"] = image.compact;
    info["provenance"] = {{"format", image.provenance.source_format},
                          {"hash", image.provenance.source_hash},
                          {"tool", image.provenance.tool_version},
                          {"options", image.provenance.options_json}};
    return info;
}

void print_row(std::string_view label, std::string_view value)
{
    fmt::print("{:<12}{}\n", label, printable(value));
}

void print_sections(const LoadedPack& pack)
{
    fmt::print("\n{:<10}{:>12}{:>14}{:>14}\n", "section", "elements", "stored", "decoded");
    uint64_t stored = 0, decoded = 0;
    for (const SectionInfo& section : pack.sections) {
        fmt::print("{:<10}{:>12}{:>14}{:>14}\n", printable(section.id), section.count, section.stored_bytes,
                   section.decoded_bytes);
        stored += section.stored_bytes;
        decoded += section.decoded_bytes;
    }
    fmt::print("{:<10}{:>12}{:>14}{:>14}  of {} bytes in the file\n", "sum", "", stored, decoded, pack.file_bytes);
}

/// How steep a ray must be against a leaf's plane to be proved to meet it at most once.
void print_leaf_slopes(const LeafSlopes& slopes)
{
    if (slopes.leaves == 0)
        return;
    const auto percent = [&](size_t count) { return 100.0 * double(count) / double(slopes.leaves); };
    std::string shares;
    for (size_t i = 0; i < slopes.proved.size(); ++i)
        shares += fmt::format("{:.1f} % above {} degrees, ", percent(slopes.proved[i]), LeafSlopes::kDegrees[i]);
    print_row("  bezier", fmt::format("{}: one hit a ray is proved for {}flagged {:.2f} %", slopes.leaves, shares,
                                      percent(slopes.flagged)));
}

void print_text(const LoadedPack& pack)
{
    const PackImage& image = pack.image;
    const Provenance& from = image.provenance;
    const double* lo = image.bounds_lo_mm;
    const double* hi = image.bounds_hi_mm;
    print_row("pack", fmt::format("version {}{}, {} bytes, content {:016x}", pack_version(pack),
                                  image.compact ? ", compact" : "", pack.file_bytes, pack.content_id));
    print_row("source", fmt::format("{} ({}, in {}, {})", from.source_name, from.source_format, from.source_unit,
                                    from.source_hash));
    print_row("made by", fmt::format("{} {}", from.tool_version, from.options_json));
    print_row("bounds", fmt::format("({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g}) mm", lo[0], lo[1], lo[2],
                                    hi[0], hi[1], hi[2]));
    print_row("size", fmt::format("{:.6g} x {:.6g} x {:.6g} mm", hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]));
    print_row("parts", fmt::format("{}", image.parts.size()));
    print_row("instances", fmt::format("{}", image.instances.size()));
    print_row("faces", fmt::format("{}, {} dropped", image.faces.size(), image.dropped.size()));
    const auto by_kind = faces_by_kind(image);
    for (uint kind = 0; kind < kSurfaceKindCount; ++kind)
        if (by_kind[kind] > 0)
            print_row("", fmt::format("{:<10}{:>10}", surface_kind_name(kind), by_kind[kind]));
    print_row("patches", fmt::format("{}", image.patches.size()));
    print_row("leaves", fmt::format("{}", image.leaves.size()));
    print_leaf_slopes(leaf_slopes(image));
    const MemoryBytes bytes = memory_bytes(image);
    print_row("in memory", fmt::format("{} bytes: geometry {}, tree {}, exact trims {}, distance textures {}",
                                       bytes.total(), bytes.geometry, bytes.bvh, bytes.trim_exact, bytes.trim_sdf));
    print_sections(pack);
    fmt::print("\n");
    print_plan(effect_plan(pack_facts(image), {}, DeviceKind::Cpu));
    if (!image.dropped.empty())
        fmt::print("\n{:<8}{:<8}{}\n", "part", "face", "dropped because");
    for (const DroppedFace& face : image.dropped)
        fmt::print("{:<8}{:<8}{}\n", face.part, face.face_in_part, printable(string_at(image, face.reason)));
}

int run_info(const InfoArguments& arguments)
{
    const Result<LoadedPack> pack = read_pack(arguments.pack, {});
    if (!pack.ok())
        return report_error(pack.error());
    if (arguments.json)
        print_json(info_json(*pack));
    else
        print_text(*pack);
    return kExitOk;
}

} // namespace

void register_info(CLI::App& app, int& exit_code)
{
    CLI::App* command = app.add_subcommand("info", "Say what a pack holds, and what tracing it calls for");
    const auto arguments = std::make_shared<InfoArguments>();
    command->add_option("PACK", arguments->pack, "The scene pack (.tray)")->required();
    command->add_flag("--json", arguments->json, "Print one JSON object");
    command->footer("Examples:\n  trimray info model.tray\n  trimray info model.tray --json | jq .faces_by_kind");
    command->callback([arguments, &exit_code] { exit_code = run_info(*arguments); });
}

} // namespace trimray
