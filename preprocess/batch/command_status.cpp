#include "preprocess/batch/commands.h"

#include "format/command_report.h"
#include "preprocess/batch/ledger.h"
#include "preprocess/batch/store.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <map>
#include <memory>

namespace trimray {
namespace {

namespace fs = std::filesystem;

struct StatusArguments {
    std::string output;
    bool json = false;
};

Result<int> run(const StatusArguments& arguments)
{
    const fs::path ledger = fs::path(arguments.output) / "ledger";
    const auto states = read_states(ledger);
    if (!states)
        return states.error();
    std::map<FileClass, size_t> counts;
    std::vector<std::string> open;
    for (const auto& [name, state] : *states)
        if (state.ended)
            ++counts[state.kind];
        else
            open.push_back(name);
    std::sort(open.begin(), open.end());
    Json at_work = Json::array();
    for (const fs::directory_entry& entry : fs::directory_iterator(ledger))
        if (entry.path().extension() == ".jsonl" && is_locked(ledger_lock(entry.path())))
            at_work.push_back(entry.path().stem().string());
    std::sort(at_work.begin(), at_work.end());

    Json classes = Json::object();
    for (const FileClass kind : kFileClasses)
        classes[class_name(kind)] = counts[kind];
    if (arguments.json) {
        const Json report = {{"files", states->size()}, {"classes", classes}, {"begun", open}, {"at_work", at_work}};
        fmt::print("{}\n", report.dump(-1, ' ', false, Json::error_handler_t::replace));
        return kExitOk;
    }
    for (const auto& [name, count] : classes.items())
        if (count.get<size_t>() > 0)
            fmt::print("{:<12} {}\n", name, count.get<size_t>());
    if (at_work.empty())
        fmt::print("{:<12} nobody{}\n", "at work", open.empty() ? "" : "; --resume takes up what was begun");
    for (const Json& shard : at_work)
        fmt::print("{:<12} shard {}\n", "at work", shard.get<std::string>());
    for (const std::string& name : open)
        fmt::print("{:<12} {}\n", "begun", printable(name));
    return kExitOk;
}

} // namespace

void register_status(CLI::App& app, int& exit_code)
{
    CLI::App* command = app.add_subcommand("status", "Say what became of the files, and which shards are at work");
    const auto arguments = std::make_shared<StatusArguments>();
    command->add_option("OUTDIR", arguments->output, "The folder of a batch")->required();
    command->add_flag("--json", arguments->json, "One JSON object: files, classes, begun, at_work");
    command->callback([arguments, &exit_code] {
        const Result<int> ended = run(*arguments);
        exit_code = ended ? *ended : report_error(ended.error(), kBatchProgram);
    });
}

} // namespace trimray
