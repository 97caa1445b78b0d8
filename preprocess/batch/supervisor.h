// Runs a batch: one worker a file, several at a time, each within its limits, every start and end in the ledger.
#pragma once

#include "format/result.h"
#include "preprocess/batch/convert_file.h"
#include "preprocess/batch/file_class.h"
#include "preprocess/batch/inputs.h"
#include "preprocess/batch/ledger.h"
#include "preprocess/batch/store.h"
#include "preprocess/worker/worker.h"

#include <csignal>
#include <map>
#include <string>
#include <vector>

namespace trimray {

struct BatchOptions {
    int jobs = 1; // workers at a time
    WorkerLimits limits;
    std::string basis; // of the keys: options and versions
    std::string run;   // names this run in the ledger
};

/// How a file ended, for those who watch.
struct FileEnd {
    const BatchFile& file;
    FileClass kind;
    bool found;         // its pack was there
    bool retried;       // at the second attempt
    std::string detail; // why it failed; empty: it did not
    double seconds;
};

/// A file at work.
struct FileAtWork {
    std::string name, phase;
    double seconds = 0;
};

/// Who watches a batch: a terminal, a log, a test.
class BatchWatcher {
public:
    virtual ~BatchWatcher() = default;
    virtual void ended(const FileEnd& end) = 0;
    /// Called several times a second.
    virtual void working(const std::vector<FileAtWork>& files, size_t left) = 0;
};

/// How the supervisor is asked to stop, from a signal handler. The first wish lets files at work end.
enum class StopWish : int { None, AfterRunning, AtOnce };

struct BatchResult {
    std::map<FileClass, size_t> counts; // of the files that ended
    size_t found = 0;                   // of those with a pack
    uint64_t bytes = 0;                 // of the files that ended
    size_t left = 0;                    // not begun, or not ended, when it was stopped
    bool stopped = false;
    // of this process in `run_batch`, without its workers
    double supervisor_cpu_seconds = 0;
    int64_t supervisor_memory_growth = 0; // bytes
};

/// Works through `files` in their order. Every file ends in exactly one class, in the ledger, unless the batch is
/// stopped before it. Call it in a process with one thread and no other children.
/// Fails: FileNotWritable (the ledger or the scratch folder: nothing is started any more, and packs stay).
Result<BatchResult> run_batch(const std::vector<BatchFile>& files, const Store& store, const LedgerWriter& ledger,
                              const PackMaker& make, const BatchOptions& options, BatchWatcher& watcher,
                              const volatile std::sig_atomic_t& wish);

} // namespace trimray
