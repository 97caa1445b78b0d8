#include "preprocess/batch/commands.h"

#include "format/command_report.h"
#include "preprocess/batch/inputs.h"
#include "preprocess/batch/resume.h"
#include "preprocess/batch/run_files.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <set>

namespace trimray {
namespace {

struct RunArguments {
    InputOptions inputs;
    std::string output, shard;
    RunWords run;
    PackWords pack;
    std::vector<CLI::Option*> pack_options; // of the parser, for what was said
    std::vector<std::string> retry;
    bool resume = false;
};

/// Leaves to `files` what runs before have not settled. Returns how many they have settled and not as they should be.
/// Fails: FileNotReadable (the ledger).
Result<size_t> leave_unsettled(std::vector<BatchFile>& files, const Store& store, const std::string& basis,
                               const std::set<FileClass>& retry)
{
    const auto states = read_states(store.ledger_folder());
    if (!states)
        return states.error();
    const std::vector<BatchFile> all = files;
    files = unsettled(std::move(files), store, basis, retry, *states);
    std::set<std::string> left;
    for (const BatchFile& file : files)
        left.insert(file.name);
    return static_cast<size_t>(std::count_if(all.begin(), all.end(), [&](const BatchFile& file) {
        return left.count(file.name) == 0 && states->at(file.name).kind != FileClass::Done;
    }));
}

Result<int> run(RunArguments arguments, const std::vector<std::string>& words)
{
    const Result<PackOptions> pack = understand(arguments.pack);
    if (!pack)
        return pack.error();
    const Result<BatchOptions> options = understand(arguments.run);
    if (!options)
        return options.error();
    const Result<std::set<FileClass>> retry = parse_classes("--retry", arguments.retry);
    if (!retry)
        return retry.error();
    const Result<Shard> shard = parse_shard(arguments.shard);
    if (!shard)
        return shard.error();
    arguments.inputs.shard = *shard;
    if (arguments.inputs.inputs.empty() && arguments.inputs.list.empty())
        return Error{ErrorCode::Usage, "INPUTS", "give folders, files, patterns, - for a list on stdin, or --list"};

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
    std::vector<BatchFile>& files = inputs->files;
    const size_t listed = files.size();
    size_t not_done = 0;
    if (arguments.resume || !retry->empty()) {
        const Result<size_t> settled = leave_unsettled(files, *store, key_basis(*pack), *retry);
        if (!settled)
            return settled.error();
        not_done = *settled;
    }
    const size_t skipped = listed - files.size();
    const RunPlan plan{{{std::move(files), said_words(arguments.pack_options), *pack}},
                       arguments.shard,
                       skipped,
                       not_done,
                       inputs->unreadable.size(),
                       words};
    return run_files(arguments.run, *options, *store, *ledger, plan);
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
    add_run_options(app, arguments->run);
    app.add_flag("--resume", arguments->resume, "Skip files that the ledger says have ended, if they have not changed");
    app.add_option(
           "--retry", arguments->retry,
           "With the files that are left, those of this class again: crash, timeout, memory, io, ..., or failed")
        ->delimiter(',');
    arguments->pack_options = add_pack_options(app, arguments->pack);
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
