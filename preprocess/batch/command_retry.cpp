#include "preprocess/batch/commands.h"

#include "format/command_report.h"
#include "preprocess/batch/run_files.h"
#include "preprocess/batch/summary.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <memory>
#include <set>

namespace trimray {
namespace {

namespace fs = std::filesystem;

struct RetryArguments {
    std::string output;
    std::vector<std::string> classes = {"failed"};
    RunWords run;
    PackWords pack;
    std::vector<CLI::Option*> pack_options;
};

/// The file with a path that holds in any folder, and as it is now.
BatchFile found_again(const BatchSummary& summary, const FileSummary& file)
{
    const RunSummary* const run = run_of(summary, file);
    const fs::path path = run ? fs::path(run->folder) / file.path : fs::path(file.path);
    return as_it_is_now({path.string(), file.file, file.listed_bytes, 0});
}

/// What the ledger has of these classes, and what was begun and has not ended; those that were converted with the same
/// options together. Fails: Usage (options that the ledger has and this version does not know).
Result<std::vector<FileGroup>> groups_to_retry(const BatchSummary& summary, const std::set<FileClass>& classes,
                                               const std::vector<std::string>& said)
{
    std::vector<FileGroup> groups;
    const auto take = [&](const FileSummary& file) -> Status {
        const RunSummary* const run = run_of(summary, file);
        const std::vector<std::string> words = overridden_words(run ? run->pack_words : said, said);
        auto group = std::find_if(groups.begin(), groups.end(), [&](const auto& g) { return g.pack_words == words; });
        if (group == groups.end()) {
            const Result<PackOptions> options = understand_words(words);
            if (!options)
                return Error{ErrorCode::Usage, file.file,
                             fmt::format("the ledger's options are not this version's: {}", options.error().detail)};
            group = groups.insert(groups.end(), FileGroup{{}, words, *options});
        }
        group->files.push_back(found_again(summary, file));
        return Done{};
    };
    std::set<std::string> taken;
    for (const FileSummary& file : summary.begun) {
        if (const Status grouped = take(file); !grouped)
            return grouped.error();
        taken.insert(file.file);
    }
    for (const FileSummary& file : summary.files)
        if (classes.count(file.kind) > 0 && taken.insert(file.file).second)
            if (const Status grouped = take(file); !grouped)
                return grouped.error();
    for (FileGroup& group : groups)
        std::stable_sort(group.files.begin(), group.files.end(),
                         [](const BatchFile& a, const BatchFile& b) { return a.bytes > b.bytes; });
    return groups;
}

Result<int> run(const RetryArguments& arguments, const std::vector<std::string>& command)
{
    const Result<BatchOptions> options = understand(arguments.run);
    if (!options)
        return options.error();
    const Result<std::set<FileClass>> classes = parse_classes("--class", arguments.classes);
    if (!classes)
        return classes.error();
    const Result<BatchSummary> summary = summarize(arguments.output);
    if (!summary)
        return summary.error();
    Result<std::vector<FileGroup>> groups = groups_to_retry(*summary, *classes, said_words(arguments.pack_options));
    if (!groups)
        return groups.error();
    const Result<Store> store = Store::open(arguments.output);
    if (!store)
        return store.error();
    const Result<LedgerWriter> ledger = LedgerWriter::open(*store, "retry");
    if (!ledger)
        return ledger.error();
    return run_files(arguments.run, *options, *store, *ledger, {std::move(*groups), "retry", 0, 0, 0, command});
}

} // namespace

void register_retry(CLI::App& app, const std::vector<std::string>& words, int& exit_code)
{
    CLI::App* command =
        app.add_subcommand("retry", "Try again what failed or was begun, from the ledger alone, with its options");
    const auto arguments = std::make_shared<RetryArguments>();
    command->add_option("OUTDIR", arguments->output, "The folder of a batch")->required();
    command
        ->add_option("--class", arguments->classes,
                     "Of which classes: crash, timeout, memory, io, incomplete, ..., or failed, all without a pack")
        ->delimiter(',')
        ->capture_default_str();
    add_run_options(*command, arguments->run);
    arguments->pack_options = add_pack_options(*command, arguments->pack);
    command->footer(
        "The options of a file's last try hold, but for those that are said here. Files that a run was to convert\n"
        "and never began are not in the ledger: trimray batch INPUTS -o OUTDIR --resume takes them up.\n"
        "\nExamples:\n"
        "  trimray batch retry packs\n"
        "  trimray batch retry packs --class timeout,memory --timeout 3600 --memory-limit 32GiB --jobs 1\n"
        "  trimray batch retry packs --class crash,incomplete --heal");
    command->callback([arguments, words, &exit_code] {
        const Result<int> ended = run(*arguments, words);
        exit_code = ended ? *ended : report_error(ended.error(), kBatchProgram);
    });
}

} // namespace trimray
