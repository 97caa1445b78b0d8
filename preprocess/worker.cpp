#include "preprocess/worker.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <fmt/format.h>
#include <malloc.h>
#include <new>
#include <optional>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace trimray {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kPollMs = 25;                         // how soon the limits are noticed
constexpr uint64_t kHardMemorySlack = 512ull << 20; // the kernel swallows failed allocations and goes on with a
                                                    // part of the model, so the hard limit lies above the watched one
constexpr int kArenas = 4;                          // of malloc; each reserves 64 MiB, and the default is 8 a core

/// Messages through the pipe: type, length, bytes. Written by the child whole, read by the parent in pieces.
enum class MessageType : char { Phase = 'P', Value = 'V', Error = 'E' };

struct MessageHeader {
    MessageType type = MessageType::Phase;
    uint64_t size = 0;
};

bool write_all(int fd, const void* data, size_t size)
{
    const char* bytes = static_cast<const char*>(data);
    while (size > 0) {
        const ssize_t written = write(fd, bytes, size);
        if (written < 0 && errno == EINTR)
            continue;
        if (written <= 0)
            return false;
        bytes += written;
        size -= static_cast<size_t>(written);
    }
    return true;
}

void send(int fd, MessageType type, const std::string& payload)
{
    MessageHeader header;
    header.type = type;
    header.size = payload.size();
    if (!write_all(fd, &header, sizeof header) || !write_all(fd, payload.data(), payload.size()))
        _exit(kExitInternal); // the parent is gone
}

std::string pack_error(const Error& error)
{
    return fmt::format("{}\n{}\n", static_cast<int>(error.code), error.where.size()) + error.where + error.detail;
}

Error unpack_error(const std::string& bytes)
{
    const size_t first = bytes.find('\n'), second = bytes.find('\n', first + 1);
    const size_t where_size = std::stoul(bytes.substr(first + 1, second - first - 1));
    return {static_cast<ErrorCode>(std::stoi(bytes.substr(0, first))), bytes.substr(second + 1, where_size),
            bytes.substr(second + 1 + where_size)};
}

void set_limit(int resource, uint64_t value)
{
    rlimit limit{};
    getrlimit(static_cast<__rlimit_resource>(resource), &limit);
    limit.rlim_cur = std::min<rlim_t>(value, limit.rlim_max);
    setrlimit(static_cast<__rlimit_resource>(resource), &limit);
}

constexpr bool kSanitized =
#if defined(__SANITIZE_ADDRESS__)
    true; // its shadow memory alone is above any limit
#else
    false;
#endif

void limit_child(const WorkerLimits& limits)
{
    set_limit(RLIMIT_CORE, 0);
    if (limits.wall_seconds > 0) {
        // a backstop for a parent that is stopped: every core busy for the whole time, twice
        const double cores = std::max(1u, std::thread::hardware_concurrency());
        set_limit(RLIMIT_CPU, static_cast<uint64_t>(std::ceil(2 * limits.wall_seconds * cores)) + 5);
    }
    // what is written to, not what is mapped: thread stacks and arenas reserve much more address space than they use
    if (limits.memory_bytes > 0 && !kSanitized)
        set_limit(RLIMIT_DATA, limits.memory_bytes + limits.memory_bytes / 4 + kHardMemorySlack);
    mallopt(M_ARENA_MAX, kArenas);
}

[[noreturn]] void child_main(int pipe_fd, pid_t parent, const WorkerFunction& function, const WorkerLimits& limits)
{
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) // it died before the line above
        _exit(kExitInternal);
    if (limits.discard_output) {
        const int null_fd = open("/dev/null", O_WRONLY | O_CLOEXEC);
        if (null_fd >= 0)
            dup2(null_fd, STDOUT_FILENO);
    }
    limit_child(limits);
    const WorkerProgress report = [pipe_fd](const char* phase, double share) {
        send(pipe_fd, MessageType::Phase, fmt::format("{} {}", share, phase));
    };
    std::optional<Result<std::string>> result;
    try {
        result = function(report);
    } catch (const std::bad_alloc&) {
        result = Error{ErrorCode::KernelOutOfMemory, "", ""};
    } catch (const std::exception& failure) {
        result = Error{ErrorCode::Internal, "", fmt::format("an exception got out: {}", failure.what())};
    }
    if (*result)
        send(pipe_fd, MessageType::Value, **result);
    else
        send(pipe_fd, MessageType::Error, pack_error(result->error()));
    fflush(nullptr);
    _exit(kExitOk); // destructors of the kernel's globals have been seen to crash
}

uint64_t resident_bytes(pid_t pid)
{
    std::array<char, 64> path{}, text{};
    fmt::format_to_n(path.data(), path.size() - 1, "/proc/{}/statm", pid);
    const int fd = open(path.data(), O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return 0;
    const ssize_t size = read(fd, text.data(), text.size() - 1);
    close(fd);
    unsigned long long total = 0, resident = 0;
    if (size <= 0 || sscanf(text.data(), "%llu %llu", &total, &resident) != 2)
        return 0;
    return resident * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

std::string bytes_text(uint64_t bytes)
{
    return fmt::format("{:.3g} GiB", static_cast<double>(bytes) / (1ull << 30));
}

/// The parent's side: collects messages, watches the limits.
class Supervisor {
public:
    Supervisor(pid_t child, int pipe_fd, const WorkerLimits& limits, const WorkerProgress& progress)
        : child_(child), pipe_fd_(pipe_fd), limits_(limits), progress_(progress)
    {
    }

    Result<std::string> run(const std::string& what)
    {
        bool reading = true;
        for (;;) {
            if (reading)
                reading = read_some(kPollMs);
            else
                std::this_thread::sleep_for(std::chrono::milliseconds(kPollMs));
            int status = 0;
            const pid_t ended = waitpid(child_, &status, WNOHANG);
            if (ended == child_) {
                while (reading && read_some(0)) {
                }
                kill(-child_, SIGKILL); // programs it started
                return outcome(what, status);
            }
            watch_limits();
        }
    }

private:
    /// Waits for messages; false at the end of the pipe, or when there is nothing and it should not wait.
    bool read_some(int wait_ms)
    {
        pollfd waiting{pipe_fd_, POLLIN, 0};
        if (poll(&waiting, 1, wait_ms) <= 0)
            return wait_ms > 0;
        std::array<char, 65536> buffer;
        const ssize_t size = read(pipe_fd_, buffer.data(), buffer.size());
        if (size < 0 && errno == EINTR)
            return true;
        if (size <= 0)
            return false;
        pending_.append(buffer.data(), static_cast<size_t>(size));
        take_messages();
        return true;
    }

    void take_messages()
    {
        MessageHeader header;
        while (pending_.size() >= sizeof header) {
            std::memcpy(&header, pending_.data(), sizeof header);
            if (pending_.size() - sizeof header < header.size)
                return;
            std::string payload = pending_.substr(sizeof header, header.size);
            pending_.erase(0, sizeof header + header.size);
            switch (header.type) {
            case MessageType::Phase: {
                const size_t space = payload.find(' ');
                phase_ = payload.substr(space + 1);
                if (progress_)
                    progress_(phase_.c_str(), std::stod(payload.substr(0, space)));
                break;
            }
            case MessageType::Value:
                result_ = Result<std::string>(std::move(payload));
                break;
            case MessageType::Error:
                result_ = unpack_error(payload);
                break;
            }
        }
    }

    void watch_limits()
    {
        if (stopped_)
            return;
        const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
        if (limits_.wall_seconds > 0 && seconds > limits_.wall_seconds)
            stop(ErrorCode::KernelTimedOut,
                 fmt::format("took longer than {} s{}; raise --timeout or simplify the model", limits_.wall_seconds,
                             in_phase()));
        else if (limits_.memory_bytes > 0 && !kSanitized && resident_bytes(child_) > limits_.memory_bytes)
            stop(ErrorCode::KernelOutOfMemory, memory_detail());
    }

    void stop(ErrorCode code, std::string detail)
    {
        stopped_ = Error{code, "", std::move(detail)};
        kill(-child_, SIGKILL);
        kill(child_, SIGKILL); // before it has its own group
    }

    std::string in_phase() const { return phase_.empty() ? "" : fmt::format(" (in phase {})", phase_); }

    std::string memory_detail() const
    {
        return fmt::format("needs more than {} of memory{}; raise --memory-limit or simplify the model",
                           bytes_text(limits_.memory_bytes), in_phase());
    }

    Result<std::string> outcome(const std::string& what, int status)
    {
        if (stopped_) {
            stopped_->where = what;
            return *stopped_;
        }
        if (result_ && WIFEXITED(status)) {
            if (!*result_ && result_->error().code == ErrorCode::KernelOutOfMemory)
                return Error{ErrorCode::KernelOutOfMemory, what, memory_detail()};
            return *result_;
        }
        if (!WIFSIGNALED(status))
            return Error{
                ErrorCode::Internal, what,
                fmt::format("the worker ended with status {} without an answer{}", WEXITSTATUS(status), in_phase())};
        const int signal = WTERMSIG(status);
        if (signal == SIGXCPU)
            return Error{ErrorCode::KernelTimedOut, what,
                         fmt::format("used up its processor time{}; raise --timeout", in_phase())};
        if (signal == SIGKILL) // not by us: the system does so when memory runs out
            return Error{ErrorCode::KernelOutOfMemory, what,
                         fmt::format("was killed from outside{}, most likely because the machine ran out of memory",
                                     in_phase())};
        const char* name = sigabbrev_np(signal);
        return Error{ErrorCode::KernelCrashed, what,
                     fmt::format("the CAD kernel crashed on it with SIG{}{}; the file is damaged or meets a fault of "
                                 "the kernel: export it again, or try --heal",
                                 name ? name : std::to_string(signal).c_str(), in_phase())};
    }

    pid_t child_;
    int pipe_fd_;
    const WorkerLimits& limits_;
    const WorkerProgress& progress_;
    Clock::time_point start_ = Clock::now();
    std::string pending_, phase_;
    std::optional<Result<std::string>> result_;
    std::optional<Error> stopped_;
};

} // namespace

Result<std::string> run_in_worker(const std::string& what, const WorkerFunction& function, const WorkerLimits& limits,
                                  const WorkerProgress& progress)
{
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
        return Error{ErrorCode::Internal, what, fmt::format("no pipe to a worker: {}", std::strerror(errno))};
    fflush(nullptr); // or the child would write what is buffered a second time
    const pid_t parent = getpid();
    const pid_t child = fork();
    if (child < 0) {
        close(ends[0]);
        close(ends[1]);
        return Error{ErrorCode::Internal, what, fmt::format("no worker process: {}", std::strerror(errno))};
    }
    if (child == 0) {
        close(ends[0]);
        child_main(ends[1], parent, function, limits);
    }
    close(ends[1]);
    Result<std::string> result = Supervisor(child, ends[0], limits, progress).run(what);
    close(ends[0]);
    return result;
}

} // namespace trimray
