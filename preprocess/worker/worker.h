// Runs functions in child processes with limits on time, memory and what they write: damaged CAD files make the CAD
// kernel crash, hang or eat all memory, and the caller has to live on and say so. Linux only.
#pragma once

#include "format/result.h"

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <sys/types.h>

namespace trimray {

struct WorkerLimits {
    double wall_seconds = 1800;         // 0: none
    uint64_t memory_bytes = 8ull << 30; // resident, of the worker and all it started; 0: none
    uint64_t written_bytes = 0;         // by the worker and all it started, and the size of any file; 0: no limit
    bool discard_output = true;         // the worker's stdout goes to /dev/null; its stderr always passes through
    bool discard_errors = false;        // its stderr as well
    bool first_out_of_memory = false;   // when the machine runs out of memory, the system is to end the worker first
};

/// Called with a phase's name and its share done in [0,1], negative where unknown.
using WorkerProgress = std::function<void(const char* phase, double share)>;

/// The worker's line to its supervisor; usable as a WorkerProgress.
class WorkerReport {
public:
    explicit WorkerReport(int descriptor) : descriptor_(descriptor) {}

    /// As WorkerProgress.
    void operator()(const char* phase, double share) const;

    /// Leaves word that outlives the worker, whatever ends it; the last one stands.
    void note(const std::string& text) const;

private:
    int descriptor_;
};

/// What runs in the worker. Its answer is a string of bytes, or an error; both come back to the caller.
using WorkerFunction = std::function<Result<std::string>(const WorkerReport& report)>;

/// How a worker ended.
struct WorkerEnd {
    Result<std::string> answer; // the function's, or KernelCrashed, KernelTimedOut, KernelOutOfMemory, WroteTooMuch,
                                // Interrupted, Internal
    std::string note;           // the last that the worker left
    std::string phase;          // the last that it named
    std::string signal;         // "SIGSEGV", where one ended it that was not ours
    std::string frame;          // the CAD kernel's function it was in then: "TKernel: TCollection_AsciiString::Clear"
    double wall_seconds = 0, cpu_seconds = 0;
    uint64_t peak_memory_bytes = 0; // resident, of the worker alone
};

/// A function at work in a child process. The child has its own process group, dies with its parent and leaves no core.
class Worker {
public:
    /// Forks. Call it while this process has one thread. `what` names the work in errors, a file say. Fails: Internal.
    static Result<Worker> start(const std::string& what, const WorkerFunction& function, const WorkerLimits& limits,
                                const WorkerProgress& progress);
    Worker(Worker&& other) noexcept;
    Worker& operator=(Worker&& other) noexcept;
    Worker(const Worker&) = delete;
    ~Worker(); // ends it

    pid_t pid() const { return child_; }
    /// Readable when there is something to `poll` for; both may be waited for. -1: none
    int message_descriptor() const { return messages_; }
    int end_descriptor() const { return ended_; }

    /// Takes what the worker has sent, holds it against its limits, and says how it ended once it has. Call it when a
    /// descriptor is readable, and at `next_look` at the latest. Once it has ended, nothing is left of what was in its
    /// process group; what left that falls to this process (end_orphans).
    std::optional<WorkerEnd> poll();

    /// Ends the worker; `poll` will say why.
    void stop(const Error& why);

    /// When its limits have to be looked at again: the further it is from them, the later.
    std::chrono::steady_clock::time_point next_look() const { return next_look_; }

    const std::string& phase() const { return phase_; }
    double seconds() const;

private:
    Worker() = default;
    bool read_messages();
    void take_message(char type, std::string payload);
    void watch_limits();
    void look_again_before(uint64_t used, uint64_t limit);
    void end_group() const;
    WorkerEnd end_of(int status, double cpu_seconds, uint64_t peak_memory_bytes);
    Result<std::string> answer_of(int status);
    std::string in_phase() const;
    std::string memory_detail() const;

    using Clock = std::chrono::steady_clock;
    std::string what_;
    WorkerLimits limits_;
    WorkerProgress progress_;
    pid_t child_ = -1;
    int messages_ = -1, ended_ = -1;
    Clock::time_point start_{}, next_look_{};
    std::string pending_, phase_, note_, signal_, frame_;
    std::optional<Result<std::string>> answer_;
    std::optional<Error> stopped_;
};

/// The timeout for poll(2) that ends at a moment, in milliseconds.
int poll_timeout(std::chrono::steady_clock::time_point moment);

/// Runs one function in a worker to its end; none of what it started is left when this returns. Call it in a process
/// without other children and threads. `progress` is called here with what the child reports.
/// Fails: as WorkerEnd::answer.
Result<std::string> run_in_worker(const std::string& what, const WorkerFunction& function, const WorkerLimits& limits,
                                  const WorkerProgress& progress);

} // namespace trimray
