#include "preprocess/batch/commands.h"

#include "format/command_report.h"
#include "format/pack_file.h"
#include "preprocess/batch/inputs.h"
#include "preprocess/batch/ledger.h"
#include "preprocess/batch/progress_view.h"
#include "preprocess/batch/resume.h"
#include "preprocess/batch/store.h"
#include "preprocess/batch/supervisor.h"
#include "preprocess/cad_import.h"
#include "preprocess/convert.h"
#include "preprocess/pack_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <csignal>
#include <fmt/format.h>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <tbb/global_control.h>
#include <thread>
#include <unistd.h>

namespace trimray {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct RunArguments {
    InputOptions inputs;
    std::string output, shard;
    int jobs = 0, threads = 0;
    PackWords pack;
    std::vector<CLI::Option*> pack_options; // of the parser, for what was said
    LimitWords limits;
    std::vector<std::string> retry;
    bool resume = false, json = false, quiet = false;
};

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

/// What decides, beside a file's content, what its pack will be.
std::string key_basis(const PackOptions& options)
{
    Json basis = {{"tool", "trimray-pack " TRIMRAY_VERSION},
                  {"kernel", kernel_version()},
                  {"format", fmt::format("{}.{}", kPackVersionMajor, kPackVersionMinor)},
                  {"options", Json::parse(provenance_options(options))}};
    return basis.dump();
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

Result<std::set<FileClass>> parse_classes(const std::vector<std::string>& names)
{
    std::set<FileClass> classes;
    for (const std::string& name : names) {
        const std::optional<FileClass> kind = class_named(name);
        if (kind)
            classes.insert(*kind);
        else if (name == "failed") {
            for (const FileClass each : kFileClasses)
                if (!has_pack(each))
                    classes.insert(each);
        } else
            return Error{ErrorCode::Usage, "--retry",
                         fmt::format("'{}' is no class; there are failed (all that have no pack), incomplete, invalid, "
                                     "unsupported, timeout, memory, crash, io",
                                     name)};
    }
    return classes;
}

/// The words of the command line that decide what a pack holds, to repeat a conversion with.
std::vector<std::string> pack_words(const std::vector<CLI::Option*>& options)
{
    std::vector<std::string> words;
    for (const CLI::Option* option : options) {
        if (option->count() == 0)
            continue;
        words.push_back(option->get_name());
        if (option->get_expected_min() > 0)
            words.push_back(option->results().back());
    }
    return words;
}

Json summary(const RunArguments& arguments, const BatchOptions& options, const LedgerWriter& ledger,
             const BatchResult& result, size_t skipped, size_t unreadable, double seconds)
{
    Json classes = Json::object();
    size_t ended = 0;
    for (const FileClass kind : kFileClasses) {
        const auto it = result.counts.find(kind);
        const size_t count = it == result.counts.end() ? 0 : it->second;
        classes[class_name(kind)] = count;
        ended += count;
    }
    const double per_file = ended > 0 ? result.supervisor_cpu_seconds / static_cast<double>(ended) : 0;
    return {{"run", options.run},
            {"output", arguments.output},
            {"ledger", ledger.path().string()},
            {"files", ended + result.left + skipped},
            {"classes", classes},
            {"found", result.found},
            {"skipped", skipped},
            {"left", result.left},
            {"unreadable_inputs", unreadable},
            {"stopped", result.stopped},
            {"seconds", seconds},
            {"files_per_second", static_cast<double>(ended) / seconds},
            {"bytes_per_second", static_cast<double>(result.bytes) / seconds},
            {"supervisor_seconds_per_file", per_file}};
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

Result<int> run(RunArguments arguments, const std::vector<std::string>& words)
{
    const Result<PackOptions> pack = understand(arguments.pack);
    if (!pack)
        return pack.error();
    BatchOptions options;
    const Result<WorkerLimits> limits = understand(arguments.limits);
    if (!limits)
        return limits.error();
    const Result<std::set<FileClass>> retry = parse_classes(arguments.retry);
    if (!retry)
        return retry.error();
    const Result<Shard> shard = parse_shard(arguments.shard);
    if (!shard)
        return shard.error();
    arguments.inputs.shard = *shard;
    if (arguments.inputs.inputs.empty() && arguments.inputs.list.empty())
        return Error{ErrorCode::Usage, "INPUTS", "give folders, files, patterns, - for a list on stdin, or --list"};

    const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    options.jobs = arguments.jobs > 0 ? arguments.jobs : cores;
    options.limits = *limits;
    options.limits.discard_errors = true; // the kernel's chatter; what matters is in the ledger
    options.limits.first_out_of_memory = true;
    options.basis = key_basis(*pack);
    std::random_device random;
    options.run = fmt::format("{:08x}{:08x}", random(), random());

    Result<InputList> inputs = list_inputs(arguments.inputs);
    if (!inputs)
        return inputs.error();
    for (const Error& unreadable : inputs->unreadable)
        report_error(unreadable, kBatchProgram);
    const Result<Store> store = Store::open(arguments.output);
    if (!store)
        return store.error();
    const Result<LedgerWriter> ledger = LedgerWriter::open(*store, shard_name(*shard));
    if (!ledger)
        return ledger.error();
    std::vector<BatchFile> files = inputs->files;
    size_t skipped_not_done = 0; // settled by runs before, and not as it should be
    if (arguments.resume || !retry->empty()) {
        const auto states = read_states(store->ledger_folder());
        if (!states)
            return states.error();
        files = unsettled(std::move(files), *store, options.basis, *retry, *states);
        std::set<std::string> left;
        for (const BatchFile& file : files)
            left.insert(file.name);
        skipped_not_done =
            static_cast<size_t>(std::count_if(inputs->files.begin(), inputs->files.end(), [&](const BatchFile& file) {
                return left.count(file.name) == 0 && states->at(file.name).kind != FileClass::Done;
            }));
    }
    const size_t skipped = inputs->files.size() - files.size();
    uint64_t bytes = 0;
    for (const BatchFile& file : files)
        bytes += file.bytes;
    char host[256] = {};
    gethostname(host, sizeof host - 1);
    std::error_code no_folder;
    Status logged = ledger->append("run", {{"run", options.run},
                                           {"host", host},
                                           {"pid", getpid()},
                                           {"command", words},
                                           {"folder", fs::current_path(no_folder).string()},
                                           {"basis", options.basis},
                                           {"pack_words", pack_words(arguments.pack_options)},
                                           {"shard", arguments.shard},
                                           {"jobs", options.jobs},
                                           {"timeout_seconds", options.limits.wall_seconds},
                                           {"memory_limit_bytes", options.limits.memory_bytes},
                                           {"disk_limit_bytes", options.limits.written_bytes},
                                           {"files", files.size()},
                                           {"bytes", bytes},
                                           {"skipped", skipped}});
    if (!logged)
        return logged.error();

    listen_to_signals();
    const auto start = Clock::now();
    const int threads = arguments.threads > 0 ? arguments.threads : std::max(1, cores / options.jobs);
    Result<BatchResult> result = Error{};
    {
        const std::unique_ptr<BatchWatcher> view = make_progress_view(files, skipped, arguments.quiet);
        result = run_batch(files, *store, *ledger, pack_maker(*pack, threads), options, *view, stop_wish);
    }
    if (!result)
        return result.error();
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    const Json report = summary(arguments, options, *ledger, *result, skipped, inputs->unreadable.size(), seconds);
    if (logged = ledger->append("stop", report); !logged)
        return logged.error();
    if (arguments.json)
        fmt::print("{}\n", report.dump(-1, ' ', false, Json::error_handler_t::replace));
    else
        print_summary(report);
    if (result->stopped)
        return 128 + static_cast<int>(stop_signal);
    const auto done = result->counts.find(FileClass::Done);
    const bool all = inputs->unreadable.empty() && skipped_not_done == 0 &&
                     (done == result->counts.end() ? files.empty() : done->second == files.size());
    return all ? kExitOk : kExitPartial;
}

} // namespace

void register_run(CLI::App& app, const std::vector<std::string>& words, int& exit_code)
{
    const auto arguments = std::make_shared<RunArguments>();
    arguments->shard = "0/1";
    app.add_option("INPUTS", arguments->inputs.inputs,
                   "Folders (searched for CAD files and .zip archives), files (.zst and .gz too), members "
                   "(parts.zip!/a.step), quoted patterns ('abc/*.step'), or - for a list on stdin");
    app.add_option("-o,--output", arguments->output, "The folder for packs and ledger; many runs may share it");
    app.add_option("--list", arguments->inputs.list, "A file with an input a line");
    app.add_option("--include", arguments->inputs.include, "Only files that match, as '*.stp'; may be repeated");
    app.add_option("--shard", arguments->shard, "Convert part I of N: I/N, I from 0")->capture_default_str();
    app.add_option("-j,--jobs", arguments->jobs, "Files at a time; 0: one a core")
        ->check(CLI::Range(0, 4096))
        ->capture_default_str();
    app.add_option("--threads", arguments->threads, "Threads of each after the file is read; 0: cores / jobs")
        ->check(CLI::Range(0, 4096))
        ->capture_default_str();
    add_limit_options(app, arguments->limits);
    app.add_flag("--resume", arguments->resume, "Skip files that the ledger says have ended, if they have not changed");
    app.add_option(
           "--retry", arguments->retry,
           "With the files that are left, those of this class again: crash, timeout, memory, io, ..., or failed")
        ->delimiter(',');
    arguments->pack_options = add_pack_options(app, arguments->pack);
    app.add_flag("--json", arguments->json, "Report as one JSON object");
    app.add_flag("-q,--quiet", arguments->quiet, "No progress and no line for each failure");
    app.callback([&app, arguments, words, &exit_code] {
        if (!app.get_subcommands().empty())
            return;
        if (arguments->output.empty()) {
            exit_code = report_error({ErrorCode::Usage, "", "--output is required; see --help"}, kBatchProgram);
            return;
        }
        const Result<int> ended = run(*arguments, words);
        exit_code = ended ? *ended : report_error(ended.error(), kBatchProgram);
    });
}

} // namespace trimray
