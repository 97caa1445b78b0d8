// A ledger as a whole: what a report of a batch shows.
#pragma once

#include "preprocess/batch/ledger.h"

#include <filesystem>
#include <string>
#include <vector>

namespace trimray {

/// The end of one file, the latest that made or failed to make its pack; or its start, where it has not ended.
struct FileSummary {
    std::string file, path, run, time;
    FileClass kind = FileClass::Done;
    int attempt = 1;
    double wall_seconds = 0, cpu_seconds = 0;
    uint64_t peak_memory_bytes = 0, source_bytes = 0, pack_bytes = 0;
    uint64_t listed_bytes = 0; // as the inputs were listed: compressed files and members as they lie there
    uint64_t faces = 0, dropped_faces = 0;
    bool found = false; // its pack was there, so times tell nothing of the conversion
    std::string key, detail, phase, signal, frame;
    std::string dropped_reason;                         // of the first dropped face
    std::vector<std::pair<std::string, double>> phases; // seconds of the conversion
};

struct RunSummary {
    std::string run, time, host, shard, folder, basis;
    std::vector<std::string> command, pack_words;
    double timeout_seconds = 0;
    uint64_t memory_limit_bytes = 0;
    Json stop; // what it reported; null: it has not
};

/// Failures that look alike: of one class, in one function of the kernel, or with one message but for its numbers and
/// names.
struct FailureGroup {
    FileClass kind = FileClass::Crash;
    std::string reason;
    std::vector<size_t> files; // in BatchSummary::files
};

struct BatchSummary {
    std::vector<FileSummary> files;   // that have ended, by name
    std::vector<FileSummary> begun;   // and have not ended since, by name; with what is known at the start
    std::vector<RunSummary> runs;     // by time
    std::vector<FailureGroup> groups; // the largest first
    size_t torn_lines = 0;
};

/// Reads OUTDIR/ledger. Fails: FileNotReadable.
Result<BatchSummary> summarize(const std::filesystem::path& output);

/// The run that a file's end or start is of; nullptr: the ledger has lost it.
const RunSummary* run_of(const BatchSummary& summary, const FileSummary& file);

/// The command that repeats what became of a file, for a shell.
std::string repeat_command(const BatchSummary& summary, const FileSummary& file);

/// The value below which a share of `sorted` lies, 0 for none.
double quantile(const std::vector<double>& sorted, double share);

} // namespace trimray
