// Runs a function in a child process with limits on time and memory: damaged CAD files make the CAD kernel crash, hang
// or eat all memory, and the caller has to live on and say so. POSIX only.
#pragma once

#include "format/result.h"

#include <cstdint>
#include <functional>
#include <string>

namespace trimray {

struct WorkerLimits {
    double wall_seconds = 1800;         // 0: none
    uint64_t memory_bytes = 8ull << 30; // resident, of the worker itself; 0: none
    bool discard_output = true;         // the worker's stdout goes to /dev/null; its stderr always passes through
};

/// Called with a phase's name and its share done in [0,1], negative where unknown.
using WorkerProgress = std::function<void(const char* phase, double share)>;

/// What runs in the worker. Its answer is a string of bytes, or an error; both come back to the caller.
using WorkerFunction = std::function<Result<std::string>(const WorkerProgress& progress)>;

/// Forks, runs `function` in the child and returns what it returned. Call it before the process has other threads.
/// The child has its own process group, dies with its parent and leaves no core; none of it is left when this returns.
/// `progress` is called in the parent with what the child reports. `what` names the work in errors, a file say.
/// Fails: as `function`; KernelCrashed (names the signal and the phase), KernelTimedOut, KernelOutOfMemory, Internal.
Result<std::string> run_in_worker(const std::string& what, const WorkerFunction& function, const WorkerLimits& limits,
                                  const WorkerProgress& progress);

} // namespace trimray
