// One CAD file to one pack, or to one mesh, from reading to writing, with the report of what was done.
#pragma once

#include "format/result.h"
#include "preprocess/pack_options.h"
#include "preprocess/source/source_file.h"

#include <nlohmann/json.hpp>
#include <string>

namespace trimray {

struct ConvertJob {
    std::string model;  // as the user named it, for errors
    std::string output; // the file to write
    PackOptions options;
    std::string dump_folder; // for pictures of each trimmed face's loops and distances; empty: none
};

/// Converts and writes a pack. Returns the report that `trimray pack --json` prints. Call it in a worker (worker.h).
/// Fails: as import_cad; EmptyCad, where no face was converted; FileNotWritable.
Result<nlohmann::ordered_json> convert_to_pack(const ConvertJob& job, const SourceFile& source,
                                               const WorkerProgress& progress);

/// The same for triangles instead of a pack (ImportOptions::mesh_deflection). Fails: as convert_to_pack.
Result<nlohmann::ordered_json> convert_to_mesh(const ConvertJob& job, const SourceFile& source,
                                               const WorkerProgress& progress);

} // namespace trimray
