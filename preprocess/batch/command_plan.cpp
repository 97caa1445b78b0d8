#include "preprocess/batch/commands.h"

#include "format/command_report.h"
#include "format/pack_writer.h"
#include "preprocess/batch/inputs.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>

namespace trimray {
namespace {

namespace fs = std::filesystem;

struct PlanArguments {
    InputOptions inputs;
    uint32_t shards = 1;
    std::string output;
    bool json = false;
};

// what a file costs beside its bytes, in bytes, as in the progress
constexpr uint64_t kBytesOfAFile = 200'000;

struct PlannedShard {
    std::vector<BatchFile> files;
    uint64_t bytes = 0, weight = 0;
};

/// Each file, the largest first, goes to the shard that has least so far. Source: Graham 1969, longest processing time
/// first, at most 4/3 of the best.
std::vector<PlannedShard> balance(const std::vector<BatchFile>& files, uint32_t count)
{
    std::vector<PlannedShard> shards(count);
    for (const BatchFile& file : files) {
        PlannedShard& least = *std::min_element(shards.begin(), shards.end(),
                                                [](const auto& a, const auto& b) { return a.weight < b.weight; });
        least.bytes += file.bytes;
        least.weight += file.bytes + kBytesOfAFile;
        least.files.push_back(file);
    }
    return shards;
}

Result<int> run(const PlanArguments& arguments)
{
    const Result<InputList> inputs = list_inputs(arguments.inputs);
    if (!inputs)
        return inputs.error();
    for (const Error& unreadable : inputs->unreadable)
        report_error(unreadable, kBatchProgram);
    std::error_code failed;
    fs::create_directories(arguments.output, failed);
    if (failed)
        return Error{ErrorCode::FileNotWritable, arguments.output, failed.message()};
    const std::vector<PlannedShard> shards = balance(inputs->files, arguments.shards);
    nlohmann::ordered_json report = nlohmann::ordered_json::array();
    for (uint32_t i = 0; i < arguments.shards; ++i) {
        std::string text;
        for (const BatchFile& file : shards[i].files) {
            if (file.path.find('\n') != std::string::npos)
                return Error{ErrorCode::Usage, file.path, "a name with a line break cannot stand in a list; rename it"};
            text += file.path + '\n';
        }
        const fs::path list = fs::path(arguments.output) / (shard_name({i, arguments.shards}) + ".list");
        const auto* bytes = reinterpret_cast<const std::byte*>(text.data());
        if (const Status written = write_file_atomically(list.string(), {bytes, bytes + text.size()}); !written)
            return written.error();
        report.push_back({{"list", list.string()}, {"files", shards[i].files.size()}, {"bytes", shards[i].bytes}});
        if (!arguments.json)
            fmt::print("{}  {} files, {:.3g} MB\n", list.string(), shards[i].files.size(),
                       1e-6 * static_cast<double>(shards[i].bytes));
    }
    if (arguments.json)
        fmt::print("{}\n", nlohmann::ordered_json{{"shards", report}}.dump());
    return inputs->unreadable.empty() ? kExitOk : kExitPartial;
}

} // namespace

void register_plan(CLI::App& app, int& exit_code)
{
    CLI::App* command = app.add_subcommand("plan", "Write lists of inputs, one a shard, with about the same work each");
    const auto arguments = std::make_shared<PlanArguments>();
    command->add_option("INPUTS", arguments->inputs.inputs, "As for trimray batch")->required();
    command->add_option("-n,--shards", arguments->shards, "How many")->required()->check(CLI::Range(1, 1000000));
    command->add_option("-o,--output", arguments->output, "The folder for the lists")->required();
    command->add_option("--include", arguments->inputs.include, "Only files that match, as '*.stp'; may be repeated");
    command->add_flag("--json", arguments->json, "Report as one JSON object");
    command->footer("Examples:\n"
                    "  trimray batch plan /data/abc -n 16 -o plan\n"
                    "  trimray batch --list plan/3-of-16.list -o /shared/packs");
    command->callback([arguments, &exit_code] {
        const Result<int> ended = run(*arguments);
        exit_code = ended ? *ended : report_error(ended.error(), kBatchProgram);
    });
}

} // namespace trimray
