#include "format/command_report.h"
#include "format/pack_reader.h"
#include "format/read_file.h"
#include "runtime/command_json.h"
#include "runtime/commands.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>
#include <vector>

namespace trimray {
namespace {

struct ValidateArguments {
    std::string pack;
    bool json = false;
};

int run_validate(const ValidateArguments& arguments)
{
    const Result<std::vector<std::byte>> bytes = read_file(arguments.pack);
    if (!bytes.ok())
        return report_error(bytes.error());
    const std::vector<Finding> findings = validate_pack(*bytes);
    if (arguments.json) {
        Json list = Json::array();
        for (const Finding& finding : findings)
            list.push_back({{"number", finding.number}, {"section", finding.section}, {"detail", finding.detail}});
        print_json({{"file", arguments.pack}, {"valid", findings.empty()}, {"findings", list}});
    } else if (findings.empty()) {
        fmt::print("{}: valid, {} bytes\n", arguments.pack, bytes->size());
    } else {
        for (const Finding& finding : findings)
            fmt::print("{}: {}: {} [F{}]\n", arguments.pack, printable(finding.section), printable(finding.detail),
                       finding.number);
    }
    if (findings.empty())
        return kExitOk;
    return report_error({ErrorCode::InvalidPack, arguments.pack,
                         fmt::format("{} finding{}; the numbers are explained in format/SPEC.md; convert the model "
                                     "again",
                                     findings.size(), findings.size() == 1 ? "" : "s")});
}

} // namespace

void register_validate(CLI::App& app, int& exit_code)
{
    CLI::App* command = app.add_subcommand("validate", "Check a pack, every byte, and number what is wrong");
    const auto arguments = std::make_shared<ValidateArguments>();
    command->add_option("PACK", arguments->pack, "The scene pack (.tray)")->required();
    command->add_flag("--json", arguments->json, "Print one JSON object: file, valid, findings");
    command->footer("Exit code 3 when there is a finding.\n\nExamples:\n  trimray validate model.tray\n"
                    "  trimray validate model.tray --json | jq .findings");
    command->callback([arguments, &exit_code] { exit_code = run_validate(*arguments); });
}

} // namespace trimray
