#include "format/command_report.h"
#include "format/pack_reader.h"
#include "format/pack_writer.h"
#include "runtime/command_json.h"
#include "runtime/commands.h"
#include "runtime/export_gltf.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>

namespace trimray {
namespace {

struct ExportArguments {
    std::string pack, output;
    bool draco = false, json = false;
};

int run_export(const ExportArguments& arguments)
{
    if (!arguments.output.ends_with(".glb"))
        return report_error({ErrorCode::Usage, "export", "the output's name must end in .glb"});
    const Result<LoadedPack> pack = read_pack(arguments.pack, ReadOptions{});
    if (!pack.ok())
        return report_error(pack.error());
    const Result<GltfExport> gltf = export_gltf(pack->image, GltfOptions{arguments.draco});
    if (!gltf.ok())
        return report_error({gltf.error().code, arguments.pack + ": " + gltf.error().where, gltf.error().detail});
    const Status written = write_file_atomically(arguments.output, gltf->glb);
    if (!written.ok())
        return report_error(written.error());
    if (arguments.json)
        print_json({{"file", arguments.output},
                    {"bytes", gltf->glb.size()},
                    {"nodes", gltf->nodes},
                    {"meshes", gltf->meshes},
                    {"materials", gltf->materials},
                    {"triangles", gltf->triangles},
                    {"draco", arguments.draco}});
    else
        fmt::print("{}: {} triangles in {} meshes and {} nodes, {} bytes\n", arguments.output, gltf->triangles,
                   gltf->meshes, gltf->nodes, gltf->glb.size());
    return kExitOk;
}

} // namespace

void register_export(CLI::App& app, int& exit_code)
{
    CLI::App* command = app.add_subcommand("export", "Write a pack's coarse triangles as glTF 2.0 (.glb)");
    const auto arguments = std::make_shared<ExportArguments>();
    command->add_option("PACK", arguments->pack, "The scene pack (.tray)")->required();
    command->add_option("-o,--output", arguments->output, "The file to write (.glb)")->required();
    command->add_flag("--draco", arguments->draco, "Compress the meshes (KHR_draco_mesh_compression)");
    command->add_flag("--json", arguments->json, "Print one JSON object: file, bytes, nodes, meshes, triangles, ...");
    command->footer(
        "The triangles are the pack's preview mesh, coarse on purpose; names, colours, the assembly tree and "
        "shared parts are kept.\nLengths become metres and y points up, as glTF has it.\n\nExamples:\n"
        "  trimray export model.tray -o model.glb\n  trimray export model.tray -o model.glb --draco");
    command->callback([arguments, &exit_code] { exit_code = run_export(*arguments); });
}

} // namespace trimray
