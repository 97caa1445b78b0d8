#include "preprocess/worker/worker.h"

#include "preprocess/worker/crash_report.h"
#include "preprocess/worker/process_tree.h"
#include "preprocess/worker/worker_message.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <fmt/format.h>
#include <malloc.h>
#include <new>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <utility>

namespace trimray {
namespace {

using Clock = std::chrono::steady_clock;

// Between looks at a worker's limits. However far it is from them, others may have to wait for what it left.
constexpr auto kShortestLook = std::chrono::milliseconds(25), kLongestLook = std::chrono::milliseconds(500);
constexpr auto kTreePeriod = std::chrono::milliseconds(250); // between looks at who started whom
constexpr double kFastestGrowth = 16e9; // bytes that all threads of a worker may take, or write, in a second
constexpr uint64_t kHardMemorySlack = 512ull << 20; // the kernel swallows failed allocations and goes on with a
                                                    // part of the model, so the hard limit lies above the watched one
constexpr int kArenas = 4;                          // of malloc; each reserves 64 MiB, and the default is 8 a core

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
    true; // its shadow memory alone is above any limit, and it reports crashes itself
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
    if (limits.written_bytes > 0)
        set_limit(RLIMIT_FSIZE, limits.written_bytes);
    mallopt(M_ARENA_MAX, kArenas);
    if (limits.first_out_of_memory)
        if (const int fd = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC); fd >= 0) {
            constexpr std::string_view kFirst = "1000";
            [[maybe_unused]] const ssize_t a_courtesy = write(fd, kFirst.data(), kFirst.size());
            close(fd);
        }
}

void discard(int descriptor)
{
    const int null_fd = open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (null_fd >= 0)
        dup2(null_fd, descriptor);
}

[[noreturn]] void child_main(int pipe_fd, pid_t parent, const WorkerFunction& function, const WorkerLimits& limits)
{
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) // it died before the line above
        _exit(kExitInternal);
    for (const int handled : {SIGINT, SIGTERM, SIGHUP}) // the supervisor's handlers mean the supervisor
        std::signal(handled, SIG_DFL);
    if (limits.discard_output)
        discard(STDOUT_FILENO);
    if (limits.discard_errors)
        discard(STDERR_FILENO);
    limit_child(limits);
    if (!kSanitized)
        report_crashes(pipe_fd);
    std::optional<Result<std::string>> result;
    try {
        result = function(WorkerReport(pipe_fd));
    } catch (const std::bad_alloc&) {
        result = Error{ErrorCode::KernelOutOfMemory, "", ""};
    } catch (const std::exception& failure) {
        result = Error{ErrorCode::Internal, "", fmt::format("an exception got out: {}", failure.what())};
    }
    const bool heard = *result ? send_message(pipe_fd, MessageType::Value, **result)
                               : send_message(pipe_fd, MessageType::Error, pack_error(result->error()));
    fflush(nullptr);
    _exit(heard ? kExitOk : kExitInternal); // destructors of the kernel's globals have been seen to crash
}

std::string bytes_text(uint64_t bytes)
{
    return fmt::format("{:.3g} GiB", static_cast<double>(bytes) / (1ull << 30));
}

/// What lives now, for all workers; at most kTreePeriod old.
const ProcessTable& recent_processes()
{
    static ProcessTable table;
    static Clock::time_point next{};
    if (Clock::now() >= next) {
        table = ProcessTable::read();
        next = Clock::now() + kTreePeriod;
    }
    return table;
}

} // namespace

void WorkerReport::operator()(const char* phase, double share) const
{
    if (!send_message(descriptor_, MessageType::Phase, fmt::format("{} {}", share, phase)))
        _exit(kExitInternal); // the parent is gone
}

void WorkerReport::note(const std::string& text) const
{
    if (!send_message(descriptor_, MessageType::Note, text))
        _exit(kExitInternal);
}

Result<Worker> Worker::start(const std::string& what, const WorkerFunction& function, const WorkerLimits& limits,
                             const WorkerProgress& progress)
{
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
        return Error{ErrorCode::Internal, what, fmt::format("no pipe to a worker: {}", std::strerror(errno))};
    fflush(nullptr); // or the child would write what is buffered a second time
    Worker worker;
    worker.what_ = what;
    worker.limits_ = limits;
    worker.progress_ = progress;
    worker.start_ = Clock::now();
    worker.next_look_ = worker.start_ + kShortestLook;
    worker.messages_ = ends[0];
    const pid_t parent = getpid();
    worker.child_ = fork();
    if (worker.child_ == 0) {
        close(ends[0]);
        child_main(ends[1], parent, function, limits);
    }
    close(ends[1]);
    if (worker.child_ < 0)
        return Error{ErrorCode::Internal, what, fmt::format("no worker process: {}", std::strerror(errno))};
    setpgid(worker.child_, worker.child_); // whoever of the two comes first: it can be ended as a group from now on
    // glibc 2.36 has it by name, but for C alone
    worker.ended_ = static_cast<int>(syscall(SYS_pidfd_open, worker.child_, 0));
    return worker;
}

Worker::Worker(Worker&& other) noexcept
{
    *this = std::move(other);
}

Worker& Worker::operator=(Worker&& other) noexcept
{
    std::swap(what_, other.what_);
    std::swap(limits_, other.limits_);
    std::swap(progress_, other.progress_);
    std::swap(child_, other.child_);
    std::swap(messages_, other.messages_);
    std::swap(ended_, other.ended_);
    std::swap(start_, other.start_);
    std::swap(next_look_, other.next_look_);
    std::swap(pending_, other.pending_);
    std::swap(phase_, other.phase_);
    std::swap(note_, other.note_);
    std::swap(signal_, other.signal_);
    std::swap(frame_, other.frame_);
    std::swap(answer_, other.answer_);
    std::swap(stopped_, other.stopped_);
    return *this;
}

Worker::~Worker()
{
    if (child_ > 0) {
        end_group();
        while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
        }
    }
    for (const int fd : {messages_, ended_})
        if (fd >= 0)
            close(fd);
}

double Worker::seconds() const
{
    return std::chrono::duration<double>(Clock::now() - start_).count();
}

void Worker::end_group() const
{
    kill(-child_, SIGKILL);
    kill(child_, SIGKILL); // a group's leader that has left its group
}

void Worker::stop(const Error& why)
{
    if (stopped_)
        return;
    stopped_ = why;
    end_group();
}

std::optional<WorkerEnd> Worker::poll()
{
    read_messages();
    int status = 0;
    rusage usage{};
    if (wait4(child_, &status, WNOHANG, &usage) != child_) {
        watch_limits();
        return std::nullopt;
    }
    read_messages();        // what it sent last
    kill(-child_, SIGKILL); // programs it started
    child_ = -1;
    const auto seconds_of = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return end_of(status, seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime),
                  static_cast<uint64_t>(usage.ru_maxrss) * 1024);
}

/// Takes what there is.
bool Worker::read_messages()
{
    std::array<char, 65536> buffer;
    while (messages_ >= 0) {
        pollfd waiting{messages_, POLLIN, 0};
        if (::poll(&waiting, 1, 0) <= 0)
            break;
        const ssize_t size = read(messages_, buffer.data(), buffer.size());
        if (size < 0 && errno == EINTR)
            continue;
        if (size <= 0) { // nobody writes any more: not worth waiting for
            close(messages_);
            messages_ = -1;
            break;
        }
        pending_.append(buffer.data(), static_cast<size_t>(size));
    }
    MessageHeader header;
    size_t taken = 0;
    for (; pending_.size() - taken >= sizeof header; taken += sizeof header + header.size) {
        std::memcpy(&header, pending_.data() + taken, sizeof header);
        if (pending_.size() - taken - sizeof header < header.size)
            break;
        take_message(static_cast<char>(header.type), pending_.substr(taken + sizeof header, header.size));
    }
    pending_.erase(0, taken);
    return taken > 0;
}

void Worker::take_message(char type, std::string payload)
{
    switch (static_cast<MessageType>(type)) {
    case MessageType::Phase: {
        const size_t space = payload.find(' ');
        phase_ = payload.substr(space + 1);
        if (progress_)
            progress_(phase_.c_str(), std::stod(payload.substr(0, space)));
        break;
    }
    case MessageType::Note:
        note_ = std::move(payload);
        break;
    case MessageType::Signal: {
        const int number = std::stoi(payload);
        const char* name = sigabbrev_np(number);
        signal_ = name ? fmt::format("SIG{}", name) : payload;
        break;
    }
    case MessageType::Frames:
        frame_ = kernel_frame(payload);
        break;
    case MessageType::Value:
        answer_ = Result<std::string>(std::move(payload));
        break;
    case MessageType::Error:
        answer_ = unpack_error(payload);
        break;
    }
}

/// Holds the worker and all it has started against the limits together.
void Worker::watch_limits()
{
    const auto now = Clock::now();
    if (now < next_look_)
        return;
    next_look_ = now + (ended_ >= 0 ? kLongestLook : kShortestLook); // without a descriptor its end shows at looks only
    if (stopped_)
        return;
    if (limits_.wall_seconds > 0) {
        const auto end = start_ + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(std::min(limits_.wall_seconds, 1e9)));
        if (now >= end)
            return stop({ErrorCode::KernelTimedOut, what_,
                         fmt::format("took longer than {} s{}; raise --timeout or simplify the model",
                                     limits_.wall_seconds, in_phase())});
        next_look_ = std::min(next_look_, end);
    }
    uint64_t resident = 0, written = 0;
    for (const pid_t pid : recent_processes().tree_of(child_)) {
        resident += resident_bytes(pid);
        written += written_bytes(pid);
    }
    if (limits_.memory_bytes > 0 && !kSanitized) {
        if (resident > limits_.memory_bytes)
            return stop({ErrorCode::KernelOutOfMemory, what_, memory_detail()});
        look_again_before(resident, limits_.memory_bytes);
    }
    if (limits_.written_bytes > 0) {
        if (written > limits_.written_bytes)
            return stop({ErrorCode::KernelWroteTooMuch, what_,
                         fmt::format("wrote more than {}{}; raise --disk-limit", bytes_text(limits_.written_bytes),
                                     in_phase())});
        look_again_before(written, limits_.written_bytes);
    }
}

/// However fast it grows.
void Worker::look_again_before(uint64_t used, uint64_t limit)
{
    const auto left = std::chrono::duration<double>(static_cast<double>(limit - used) / kFastestGrowth);
    const auto wait = std::max<Clock::duration>(kShortestLook, std::chrono::duration_cast<Clock::duration>(left));
    next_look_ = std::min(next_look_, Clock::now() + wait);
}

std::string Worker::in_phase() const
{
    return phase_.empty() ? "" : fmt::format(" (in phase {})", phase_);
}

std::string Worker::memory_detail() const
{
    return fmt::format("needs more than {} of memory{}; raise --memory-limit or simplify the model",
                       bytes_text(limits_.memory_bytes), in_phase());
}

WorkerEnd Worker::end_of(int status, double cpu_seconds, uint64_t peak_memory_bytes)
{
    if (WIFSIGNALED(status) && !stopped_ && signal_.empty()) {
        const char* name = sigabbrev_np(WTERMSIG(status));
        signal_ = name ? fmt::format("SIG{}", name) : std::to_string(WTERMSIG(status));
    }
    Result<std::string> answer = stopped_ ? Result<std::string>(*stopped_) : answer_of(status);
    return {std::move(answer), note_, phase_, signal_, frame_, seconds(), cpu_seconds, peak_memory_bytes};
}

Result<std::string> Worker::answer_of(int status)
{
    if (answer_ && WIFEXITED(status)) {
        if (!*answer_ && answer_->error().code == ErrorCode::KernelOutOfMemory)
            return Error{ErrorCode::KernelOutOfMemory, what_, memory_detail()};
        return *answer_;
    }
    if (!WIFSIGNALED(status))
        return Error{
            ErrorCode::Internal, what_,
            fmt::format("the worker ended with status {} without an answer{}", WEXITSTATUS(status), in_phase())};
    const int signal = WTERMSIG(status);
    if (signal == SIGXCPU)
        return Error{ErrorCode::KernelTimedOut, what_,
                     fmt::format("used up its processor time{}; raise --timeout", in_phase())};
    if (signal == SIGXFSZ)
        return Error{ErrorCode::KernelWroteTooMuch, what_,
                     fmt::format("wrote a file of more than {}{}; raise --disk-limit",
                                 bytes_text(limits_.written_bytes), in_phase())};
    if (signal == SIGKILL) // not by us: the system does so when memory runs out
        return Error{
            ErrorCode::KernelOutOfMemory, what_,
            fmt::format("was killed from outside{}, most likely because the machine ran out of memory", in_phase())};
    return Error{ErrorCode::KernelCrashed, what_,
                 fmt::format("the CAD kernel crashed on it with {}{}{}; the file is damaged or meets a fault of the "
                             "kernel: export it again, or try --heal",
                             signal_, in_phase(), frame_.empty() ? "" : fmt::format(" in {}", frame_))};
}

int poll_timeout(Clock::time_point moment)
{
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(moment - Clock::now()).count();
    return static_cast<int>(std::clamp<std::int64_t>(left, 0, 60'000));
}

Result<std::string> run_in_worker(const std::string& what, const WorkerFunction& function, const WorkerLimits& limits,
                                  const WorkerProgress& progress)
{
    adopt_orphans();
    Result<Worker> worker = Worker::start(what, function, limits, progress);
    if (!worker)
        return worker.error();
    for (;;) {
        if (std::optional<WorkerEnd> end = worker->poll()) {
            end_orphans({});
            return std::move(end->answer);
        }
        std::array<pollfd, 2> waiting{pollfd{worker->message_descriptor(), POLLIN, 0},
                                      pollfd{worker->end_descriptor(), POLLIN, 0}};
        ::poll(waiting.data(), waiting.size(), poll_timeout(worker->next_look()));
    }
}

} // namespace trimray
