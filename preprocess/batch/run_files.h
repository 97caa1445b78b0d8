// What the commands that convert share: options of how, and the run itself, from files to summary.
#pragma once

#include "format/result.h"
#include "preprocess/batch/inputs.h"
#include "preprocess/batch/ledger.h"
#include "preprocess/batch/store.h"
#include "preprocess/batch/supervisor.h"
#include "preprocess/pack_options.h"

#include <string>
#include <vector>

namespace trimray {

/// How to convert, as said on the command line.
struct RunWords {
    int jobs = 0, threads = 0;
    LimitWords limits;
    bool json = false, quiet = false, failures_ok = false;
};

/// `words` lives as long as `app`.
void add_run_options(CLI::App& app, RunWords& words);

/// Files that are converted with the same options.
struct FileGroup {
    std::vector<BatchFile> files;
    std::vector<std::string> pack_words; // the options, as said_words
    PackOptions options;                 // what they mean
};

/// What is to be done, and what was settled before.
struct RunPlan {
    std::vector<FileGroup> groups; // a run of the ledger each
    std::string shard;             // as said
    size_t skipped = 0;            // settled by runs before
    size_t skipped_not_done = 0;   // of those, the ones that are not as they should be
    size_t unreadable = 0;         // inputs that could not be listed
    std::vector<std::string> command;
};

/// What decides, beside a file's content, what its pack will be.
std::string key_basis(const PackOptions& options);

/// Without basis and run, which each group has its own of. Fails: Usage.
Result<BatchOptions> understand(const RunWords& words);

/// Converts the files, and prints the summary. Ends by itself, or as the user's signals wish. Returns the exit code.
/// Fails: FileNotWritable.
Result<int> run_files(const RunWords& words, BatchOptions options, const Store& store, const LedgerWriter& ledger,
                      const RunPlan& plan);

} // namespace trimray
