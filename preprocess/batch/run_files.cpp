#include "preprocess/batch/run_files.h"

#include "format/command_report.h"
#include "format/pack_file.h"
#include "preprocess/batch/progress_view.h"
#include "preprocess/batch/supervisor.h"
#include "preprocess/convert.h"
#include "preprocess/import/cad_import.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fmt/format.h>
#include <memory>
#include <random>
#include <tbb/global_control.h>
#include <thread>
#include <unistd.h>

namespace trimray {
namespace {

using Clock = std::chrono::steady_clock;

volatile std::sig_atomic_t stop_wish = 0;
volatile std::sig_atomic_t stop_signal = 0;

/// Ctrl-C once: files at work may end. Twice, or any other signal that ends programs: at once.
void on_stop_signal(int signal)
{
    const bool polite = signal == SIGINT && stop_wish == static_cast<int>(StopWish::None);
    stop_wish = static_cast<int>(polite ? StopWish::AfterRunning : StopWish::AtOnce);
    stop_signal = signal;
    constexpr char kPolite[] = "\nstopping when the files at work are done; Ctrl-C again ends them at once\n";
    if (polite) [[maybe_unused]]
        const ssize_t a_courtesy = write(STDERR_FILENO, kPolite, sizeof kPolite - 1);
}

void listen_to_signals()
{
    struct sigaction action {};
    action.sa_handler = on_stop_signal;
    for (const int signal : {SIGINT, SIGTERM, SIGHUP})
        sigaction(signal, &action, nullptr);
}

PackMaker pack_maker(const PackOptions& options, int threads)
{
    return [options, threads](const SourceFile& source, const std::string& model, const std::string& output,
                              bool other_healing, const WorkerProgress& progress) {
        ConvertJob job{model, output, options, {}};
        job.options.import.heal = options.import.heal != other_healing;
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
        return convert_to_pack(job, source, progress);
    };
}

int core_count()
{
    return static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

std::string random_name()
{
    std::random_device random;
    return fmt::format("{:08x}{:08x}", random(), random());
}

Status log_run(const LedgerWriter& ledger, const RunPlan& plan, const FileGroup& group, const BatchOptions& options)
{
    uint64_t bytes = 0;
    for (const BatchFile& file : group.files)
        bytes += file.bytes;
    char host[256] = {};
    gethostname(host, sizeof host - 1);
    std::error_code no_folder;
    return ledger.append("run", {{"run", options.run},
                                 {"host", host},
                                 {"pid", getpid()},
                                 {"command", plan.command},
                                 {"folder", std::filesystem::current_path(no_folder).string()},
                                 {"basis", options.basis},
                                 {"pack_words", group.pack_words},
                                 {"shard", plan.shard},
                                 {"jobs", options.jobs},
                                 {"timeout_seconds", options.limits.wall_seconds},
                                 {"memory_limit_bytes", options.limits.memory_bytes},
                                 {"disk_limit_bytes", options.limits.written_bytes},
                                 {"files", group.files.size()},
                                 {"bytes", bytes},
                                 {"skipped", plan.skipped}});
}

size_t ended_files(const BatchResult& result)
{
    size_t ended = 0;
    for (const auto& [kind, count] : result.counts)
        ended += count;
    return ended;
}

void add(BatchResult& total, const BatchResult& part)
{
    for (const auto& [kind, count] : part.counts)
        total.counts[kind] += count;
    total.found += part.found;
    total.bytes += part.bytes;
    total.left += part.left;
    total.stopped = total.stopped || part.stopped;
    total.supervisor_cpu_seconds += part.supervisor_cpu_seconds;
    total.supervisor_memory_growth += part.supervisor_memory_growth;
}

Json summary(const std::string& run, const LedgerWriter& ledger, const Store& store, const RunPlan& plan,
             const BatchResult& result, double seconds)
{
    Json classes = Json::object();
    for (const FileClass kind : kFileClasses) {
        const auto it = result.counts.find(kind);
        classes[class_name(kind)] = it == result.counts.end() ? 0 : it->second;
    }
    const size_t ended = ended_files(result);
    const double per_file = ended > 0 ? result.supervisor_cpu_seconds / static_cast<double>(ended) : 0;
    return {{"run", run},
            {"output", store.folder().string()},
            {"ledger", ledger.path().string()},
            {"files", ended + result.left + plan.skipped},
            {"classes", classes},
            {"found", result.found},
            {"skipped", plan.skipped},
            {"left", result.left},
            {"unreadable_inputs", plan.unreadable},
            {"stopped", result.stopped},
            {"seconds", seconds},
            {"files_per_second", static_cast<double>(ended) / seconds},
            {"bytes_per_second", static_cast<double>(result.bytes) / seconds},
            {"supervisor_seconds_per_file", per_file},
            {"supervisor_memory_growth_bytes", result.supervisor_memory_growth}};
}

void print_summary(const Json& summary)
{
    std::string classes;
    for (const auto& [name, count] : summary["classes"].items())
        if (count.get<size_t>() > 0)
            classes += fmt::format("{}{} {}", classes.empty() ? "" : ", ", count.get<size_t>(), name);
    fmt::print("{:<8} {}\n", "files", classes.empty() ? "none" : classes);
    if (const size_t found = summary["found"])
        fmt::print("{:<8} {} packs were there\n", "found", found);
    if (const size_t skipped = summary["skipped"])
        fmt::print("{:<8} {} settled by earlier runs\n", "skipped", skipped);
    if (const size_t left = summary["left"])
        fmt::print("{:<8} {}; go on with --resume\n", "left", left);
    fmt::print("{:<8} {}, {:.3g} files/s, {:.3g} MB/s\n", "time", duration_text(summary["seconds"]),
               summary["files_per_second"].get<double>(), 1e-6 * summary["bytes_per_second"].get<double>());
    fmt::print("{:<8} {}\n", "ledger", summary["ledger"].get<std::string>());
}

double seconds_since(Clock::time_point start)
{
    return std::chrono::duration<double>(Clock::now() - start).count();
}

Result<BatchResult> run_group(const BatchOptions& options, const Store& store, const LedgerWriter& ledger,
                              const RunPlan& plan, const FileGroup& group, int threads, bool quiet)
{
    if (const Status logged = log_run(ledger, plan, group, options); !logged)
        return logged.error();
    const auto start = Clock::now();
    Result<BatchResult> result = Error{};
    {
        const std::unique_ptr<BatchWatcher> view = make_progress_view(group.files, plan.skipped, quiet);
        result = run_batch(group.files, store, ledger, pack_maker(group.options, threads), options, *view, stop_wish);
    }
    if (!result)
        return result.error();
    const Json report = summary(options.run, ledger, store, plan, *result, seconds_since(start));
    if (const Status logged = ledger.append("stop", report); !logged)
        return logged.error();
    return result;
}

} // namespace

std::string key_basis(const PackOptions& options)
{
    Json basis = {{"tool", "trimray-pack " TRIMRAY_VERSION},
                  {"kernel", kernel_version()},
                  {"format", fmt::format("{}.{}", kPackVersionMajor, kPackVersionMinor)},
                  {"options", Json::parse(provenance_options(options))}};
    return basis.dump();
}

void add_run_options(CLI::App& app, RunWords& words)
{
    app.add_option("-j,--jobs", words.jobs, "Files at a time; 0: one a core")
        ->check(CLI::Range(0, 4096))
        ->capture_default_str();
    app.add_option("--threads", words.threads, "Threads of each after the file is read; 0: cores / jobs")
        ->check(CLI::Range(0, 4096))
        ->capture_default_str();
    add_limit_options(app, words.limits);
    app.add_flag("--failures-ok", words.failures_ok,
                 "End with 0, not 6, where files failed or lost faces: for engines that would try again");
    app.add_flag("--json", words.json, "Report as one JSON object");
    app.add_flag("-q,--quiet", words.quiet, "No progress and no line for each failure");
}

Result<BatchOptions> understand(const RunWords& words)
{
    BatchOptions options;
    options.jobs = words.jobs > 0 ? words.jobs : core_count();
    const Result<WorkerLimits> limits = understand(words.limits, options.jobs);
    if (!limits)
        return limits.error();
    options.limits = *limits;
    options.limits.discard_errors = true; // the kernel's chatter; what matters is in the ledger
    options.limits.first_out_of_memory = true;
    return options;
}

Result<int> run_files(const RunWords& words, BatchOptions options, const Store& store, const LedgerWriter& ledger,
                      const RunPlan& plan)
{
    const int threads = words.threads > 0 ? words.threads : std::max(1, core_count() / options.jobs);
    listen_to_signals();
    const auto start = Clock::now();
    BatchResult total;
    for (const FileGroup& group : plan.groups) {
        if (total.stopped) {
            total.left += group.files.size();
            continue;
        }
        options.basis = key_basis(group.options);
        options.run = random_name();
        const Result<BatchResult> result = run_group(options, store, ledger, plan, group, threads, words.quiet);
        if (!result)
            return result.error();
        add(total, *result);
    }
    const Json report = summary(options.run, ledger, store, plan, total, seconds_since(start));
    if (words.json)
        fmt::print("{}\n", report.dump(-1, ' ', false, Json::error_handler_t::replace));
    else
        print_summary(report);
    if (total.stopped)
        return 128 + static_cast<int>(stop_signal);
    const bool all = plan.unreadable == 0 && plan.skipped_not_done == 0 &&
                     total.counts[FileClass::Done] == ended_files(total) + total.left;
    return all || words.failures_ok ? kExitOk : kExitPartial;
}

} // namespace trimray
