#include "runtime/commands.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <memory>

namespace trimray {

void register_version(CLI::App& app, int& exit_code)
{
    CLI::App* command = app.add_subcommand("version", "Print the version of this program");
    const auto json = std::make_shared<bool>(false);
    command->add_flag("--json", *json, "Print one JSON object");
    command->footer("Example:\n  trimray version --json");
    command->callback([json, &exit_code] {
        if (*json)
            fmt::print("{}\n", nlohmann::ordered_json{{"program", "trimray"}, {"version", TRIMRAY_VERSION}}.dump());
        else
            fmt::print("trimray {}\n", TRIMRAY_VERSION);
        exit_code = 0;
    });
}

} // namespace trimray
