// What a batch's worker does with one file: hash it, look for its pack in the store, make the pack if it is not there.
#pragma once

#include "format/result.h"
#include "preprocess/batch/inputs.h"
#include "preprocess/batch/store.h"
#include "preprocess/source/source_file.h"
#include "preprocess/worker/worker.h"

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

namespace trimray {

/// Makes a pack of `source` at `output`; returns the report of `trimray pack --json`. `model` names the file in errors.
/// `other_healing`: with the kernel's healing switched the other way than the options say.
using PackMaker = std::function<Result<nlohmann::ordered_json>(const SourceFile& source, const std::string& model,
                                                               const std::string& output, bool other_healing,
                                                               const WorkerProgress& progress)>;

/// The key of a pack: 32 hex digits, XXH3 (128 bits) of `content_hash` and `basis`, the options and versions that
/// decide, with the content, what the pack will be.
std::string pack_key(const std::string& content_hash, const std::string& basis);

struct FileJob {
    BatchFile file;
    bool other_healing = false;
    std::filesystem::path scratch; // an empty folder in the store
};

/// Converts one file; call it in a worker. The key is left as the worker's note as soon as it is known.
/// Returns JSON: {"busy": true} where another process is at work on the same key, otherwise what goes into the ledger's
/// end event: {"key", "found", "pack", "pack_bytes", "faces", "converted", "dropped", ...}.
/// Fails: as SourceFile::open and `make`; FileNotWritable.
Result<std::string> convert_file(const FileJob& job, const Store& store, const std::string& basis,
                                 const PackMaker& make, const WorkerReport& report);

} // namespace trimray
