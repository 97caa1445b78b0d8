#include "preprocess/batch/supervisor.h"

#include "preprocess/worker/process_tree.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <fmt/format.h>
#include <optional>
#include <poll.h>
#include <sys/resource.h>
#include <unistd.h>
#include <utility>

namespace trimray {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr auto kBusyPeriod = std::chrono::milliseconds(100);    // between looks at keys that others work on
constexpr auto kOrphanPeriod = std::chrono::seconds(2);         // between looks for what workers left behind
constexpr auto kWatcherPeriod = std::chrono::milliseconds(200); // between words to the watcher

struct Attempt {
    size_t file = 0;
    int number = 1;
    std::string busy_key; // of another process's work that it waits for
};

struct Running {
    Attempt attempt;
    size_t slot = 0;
    Worker worker;
};

double own_cpu_seconds()
{
    rusage own{};
    getrusage(RUSAGE_SELF, &own);
    return static_cast<double>(own.ru_utime.tv_sec + own.ru_stime.tv_sec) +
           1e-6 * static_cast<double>(own.ru_utime.tv_usec + own.ru_stime.tv_usec);
}

int64_t own_memory()
{
    return static_cast<int64_t>(resident_bytes(getpid()));
}

class Supervisor {
public:
    Supervisor(const std::vector<BatchFile>& files, const Store& store, const LedgerWriter& ledger,
               const PackMaker& make, const BatchOptions& options, BatchWatcher& watcher, ScratchFolder scratch)
        : files_(files), store_(store), ledger_(ledger), make_(make), options_(options), watcher_(watcher),
          scratch_(std::move(scratch)), slot_taken_(static_cast<size_t>(options.jobs), false)
    {
        for (size_t i = 0; i < files.size(); ++i)
            queue_.push_back({i, 1, {}});
    }

    Result<BatchResult> run(const volatile std::sig_atomic_t& wish)
    {
        while (!failed_) {
            const auto wished = static_cast<StopWish>(wish);
            if (wished != StopWish::None)
                result_.stopped = true;
            if (wished == StopWish::AtOnce) {
                running_.clear(); // ends them
                break;
            }
            if (wished == StopWish::None)
                start_some();
            if (running_.empty() && (wished != StopWish::None || (queue_.empty() && waiting_.empty())))
                break;
            wait();
            end_some();
            look_around();
        }
        running_.clear();
        end_orphans({});
        if (failed_)
            return *failed_;
        size_t ended = 0;
        for (const auto& [kind, count] : result_.counts)
            ended += count;
        result_.left = files_.size() - ended;
        result_.supervisor_cpu_seconds = own_cpu_seconds() - start_cpu_seconds_;
        result_.supervisor_memory_growth = own_memory() - start_memory_;
        return result_;
    }

private:
    void start_some()
    {
        take_back_waiting();
        while (!failed_ && !queue_.empty() && running_.size() < slot_taken_.size()) {
            const Attempt attempt = queue_.front();
            queue_.pop_front();
            start(attempt);
        }
    }

    /// Files whose key another process has worked on can go on once it has let go.
    void take_back_waiting()
    {
        if (waiting_.empty() || Clock::now() < next_busy_look_)
            return;
        next_busy_look_ = Clock::now() + kBusyPeriod;
        const auto free = std::partition(waiting_.begin(), waiting_.end(), [&](const Attempt& attempt) {
            return is_locked(store_.claim_path(attempt.busy_key));
        });
        queue_.insert(queue_.begin(), free, waiting_.end()); // their packs are there now, most likely
        waiting_.erase(free, waiting_.end());
    }

    void start(const Attempt& attempt)
    {
        const auto slot =
            static_cast<size_t>(std::find(slot_taken_.begin(), slot_taken_.end(), false) - slot_taken_.begin());
        const Result<fs::path> folder = scratch_.empty_folder(std::to_string(slot));
        if (!folder) {
            failed_ = folder.error();
            return;
        }
        const BatchFile& file = files_[attempt.file];
        if (attempt.busy_key.empty()) // a file that has waited has its start already
            append("start", {{"run", options_.run},
                             {"file", file.name},
                             {"path", file.path},
                             {"bytes", file.bytes},
                             {"modified_ns", file.modified_ns},
                             {"attempt", attempt.number}});
        if (failed_)
            return;
        const FileJob job{file, attempt.number > 1, *folder};
        Result<Worker> worker = Worker::start(
            file.path,
            [&](const WorkerReport& report) { return convert_file(job, store_, options_.basis, make_, report); },
            options_.limits, {});
        if (!worker) {
            failed_ = worker.error();
            return;
        }
        slot_taken_[slot] = true;
        running_.push_back({attempt, slot, std::move(*worker)});
    }

    void wait() const
    {
        std::vector<pollfd> waiting;
        for (const Running& running : running_)
            for (const int descriptor : {running.worker.message_descriptor(), running.worker.end_descriptor()})
                waiting.push_back({descriptor, POLLIN, 0});
        Clock::time_point until = next_watcher_call_;
        if (!waiting_.empty())
            until = std::min(until, next_busy_look_);
        for (const Running& running : running_)
            until = std::min(until, running.worker.next_look());
        poll(waiting.data(), waiting.size(), poll_timeout(until));
    }

    void end_some()
    {
        for (size_t i = 0; i < running_.size() && !failed_;) {
            std::optional<WorkerEnd> end = running_[i].worker.poll();
            if (!end) {
                ++i;
                continue;
            }
            const Attempt attempt = running_[i].attempt;
            slot_taken_[running_[i].slot] = false;
            running_.erase(running_.begin() + static_cast<std::ptrdiff_t>(i));
            if (!end->answer)
                next_orphan_look_ = {}; // what it started may have left its group
            take_end(attempt, *end);
        }
    }

    void take_end(Attempt attempt, const WorkerEnd& end)
    {
        Json outcome = end.answer ? Json::parse(*end.answer) : Json::object();
        if (outcome.contains("busy")) {
            attempt.busy_key = end.note;
            waiting_.push_back(attempt);
            return;
        }
        const BatchFile& file = files_[attempt.file];
        const FileClass kind = !end.answer                                     ? class_of(end.answer.error())
                               : outcome.value("dropped_faces", size_t{0}) > 0 ? FileClass::Incomplete
                                                                               : FileClass::Done;
        const bool retry = attempt.number == 1 && worth_a_retry(kind);
        const bool found = outcome.value("found", false);
        append("end", end_event(file, attempt, end, kind, !retry, outcome));
        if (failed_)
            return;
        if (retry) {
            queue_.push_front({attempt.file, attempt.number + 1, {}});
            return;
        }
        ++result_.counts[kind];
        result_.bytes += file.bytes;
        result_.found += found ? 1 : 0;
        watcher_.ended(
            {file, kind, found, attempt.number > 1, end.answer ? "" : end.answer.error().detail, end.wall_seconds});
    }

    Json end_event(const BatchFile& file, const Attempt& attempt, const WorkerEnd& end, FileClass kind, bool final,
                   const Json& outcome) const
    {
        Json event = {{"run", options_.run},
                      {"file", file.name},
                      {"path", file.path},
                      {"bytes", file.bytes},
                      {"modified_ns", file.modified_ns},
                      {"attempt", attempt.number},
                      {"final", final},
                      {"class", class_name(kind)},
                      {"exit", static_cast<int>(exit_code(kind))}};
        if (!end.note.empty())
            event["key"] = end.note;
        Json seconds = {{"wall", end.wall_seconds}, {"cpu", end.cpu_seconds}};
        if (outcome.contains("seconds"))
            seconds.update(outcome["seconds"]);
        event.update(outcome);
        event["seconds"] = seconds;
        event["peak_memory_bytes"] = end.peak_memory_bytes;
        if (!end.answer) {
            const Error& error = end.answer.error();
            event["error"] = {{"code", static_cast<int>(error.code)}, {"detail", error.detail}, {"phase", end.phase}};
            if (!end.signal.empty())
                event["error"]["signal"] = end.signal;
            if (!end.frame.empty())
                event["error"]["frame"] = end.frame;
        }
        return event;
    }

    void append(const char* event, const Json& keys)
    {
        if (const Status appended = ledger_.append(event, keys); !appended)
            failed_ = appended.error();
    }

    void look_around()
    {
        if (Clock::now() >= next_orphan_look_) {
            next_orphan_look_ = Clock::now() + kOrphanPeriod;
            std::vector<pid_t> known;
            for (const Running& running : running_)
                known.push_back(running.worker.pid());
            end_orphans(known);
        }
        if (Clock::now() >= next_watcher_call_) {
            next_watcher_call_ = Clock::now() + kWatcherPeriod;
            std::vector<FileAtWork> at_work;
            for (const Running& running : running_)
                at_work.push_back(
                    {files_[running.attempt.file].name, running.worker.phase(), running.worker.seconds()});
            watcher_.working(at_work, queue_.size() + waiting_.size());
        }
    }

    const std::vector<BatchFile>& files_;
    const Store& store_;
    const LedgerWriter& ledger_;
    const PackMaker& make_;
    const BatchOptions& options_;
    BatchWatcher& watcher_;
    ScratchFolder scratch_;
    std::vector<bool> slot_taken_; // a folder each
    std::deque<Attempt> queue_, waiting_;
    std::vector<Running> running_;
    BatchResult result_;
    double start_cpu_seconds_ = own_cpu_seconds();
    int64_t start_memory_ = own_memory();
    std::optional<Error> failed_;
    Clock::time_point next_busy_look_{}, next_orphan_look_{}, next_watcher_call_{};
};

} // namespace

Result<BatchResult> run_batch(const std::vector<BatchFile>& files, const Store& store, const LedgerWriter& ledger,
                              const PackMaker& make, const BatchOptions& options, BatchWatcher& watcher,
                              const volatile std::sig_atomic_t& wish)
{
    adopt_orphans();
    store.sweep();
    Result<ScratchFolder> scratch = ScratchFolder::make(store);
    if (!scratch)
        return scratch.error();
    Result<BatchResult> result =
        Supervisor(files, store, ledger, make, options, watcher, std::move(*scratch)).run(wish);
    store.sweep(); // claims of workers that were ended
    return result;
}

} // namespace trimray
