#include "preprocess/batch/commands.h"

#include "format/command_report.h"
#include "format/pack_writer.h"
#include "preprocess/batch/report.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fmt/format.h>
#include <memory>

namespace trimray {
namespace {

struct ReportArguments {
    std::string output, page;
    size_t thumbnails = 48;
    bool json = false;
};

constexpr size_t kMostGroups = 20; // on a terminal

void print_report(const Json& report)
{
    for (const auto& [name, count] : report["classes"].items())
        if (count.get<size_t>() > 0)
            fmt::print("{:<12} {}\n", name, count.get<size_t>());
    if (!report["begun"].empty())
        fmt::print("{:<12} {}; go on with --resume\n", "begun", report["begun"].size());
    const Json& seconds = report["conversion_seconds"];
    fmt::print("{:<12} median {:.3g} s, 90 % {:.3g} s, most {:.3g} s\n", "conversions", seconds["median"].get<double>(),
               seconds["90 %"].get<double>(), seconds["most"].get<double>());
    const Json& groups = report["groups"];
    for (size_t i = 0; i < std::min(groups.size(), kMostGroups); ++i)
        fmt::print("\n{:>6} {}: {}\n       {}\n", groups[i]["files"].get<size_t>(),
                   groups[i]["class"].get<std::string>(), printable(groups[i]["reason"].get<std::string>()),
                   printable(groups[i]["repeat"].get<std::string>()));
    if (groups.size() > kMostGroups)
        fmt::print("\n{} more kinds of failures; --json and -o FILE.html have all\n", groups.size() - kMostGroups);
}

Result<int> run(const ReportArguments& arguments)
{
    const Result<BatchSummary> summary = summarize(arguments.output);
    if (!summary)
        return summary.error();
    if (!arguments.page.empty()) {
        const std::string page = report_html(*summary, arguments.output, arguments.thumbnails);
        const auto* bytes = reinterpret_cast<const std::byte*>(page.data());
        if (const Status written = write_file_atomically(arguments.page, {bytes, bytes + page.size()}); !written)
            return written.error();
    }
    const Json report = report_json(*summary);
    if (arguments.json)
        fmt::print("{}\n", report.dump(-1, ' ', false, Json::error_handler_t::replace));
    else if (arguments.page.empty())
        print_report(report);
    else
        fmt::print("{}\n", arguments.page);
    return kExitOk;
}

} // namespace

void register_report(CLI::App& app, int& exit_code)
{
    CLI::App* command =
        app.add_subcommand("report", "Say why files failed and how to repeat it, how long conversions took and where");
    const auto arguments = std::make_shared<ReportArguments>();
    command->add_option("OUTDIR", arguments->output, "The folder of a batch")->required();
    command->add_option("-o,--output", arguments->page, "Write a page (.html) of one file, with previews");
    command->add_option("--thumbnails", arguments->thumbnails, "Previews on the page")
        ->check(CLI::Range(0, 10000))
        ->capture_default_str();
    command->add_flag("--json", arguments->json, "Print one JSON object");
    command->footer("Examples:\n"
                    "  trimray batch report packs\n"
                    "  trimray batch report packs -o report.html\n"
                    "  trimray batch report packs --json | jq '.groups[:5]'");
    command->callback([arguments, &exit_code] {
        const Result<int> ended = run(*arguments);
        exit_code = ended ? *ended : report_error(ended.error(), kBatchProgram);
    });
}

} // namespace trimray
