// The subcommands of `trimray`, one file each (command_<name>.cpp). A subcommand registers itself with the parser and
// leaves its exit code in `exit_code` when it ran; what it prints follows the conventions of command_report.h.
#pragma once

#include "format/result.h"

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace trimray {

void register_render(CLI::App& app, int& exit_code);
void register_bench(CLI::App& app, int& exit_code);
void register_export(CLI::App& app, int& exit_code);
void register_info(CLI::App& app, int& exit_code);
void register_validate(CLI::App& app, int& exit_code);
void register_thumbnail(CLI::App& app, int& exit_code);
void register_preview(CLI::App& app, int& exit_code);
void register_version(CLI::App& app, int& exit_code);

/// Programs of their own that run as subcommands, as git's do: `trimray pack` runs `trimray-pack` with all arguments
/// after the first word.
struct ExternalCommand {
    const char* name; // one word, or two: a subcommand's subcommand, whose program has several
    const char* program;
    const char* summary;
};
const std::vector<ExternalCommand>& external_commands();
/// Whether the first arguments are the command's name.
bool is_asked_for(const ExternalCommand& command, const std::vector<std::string>& arguments);
/// Lists those of one word, or those whose first word is `parent`, in the help of `app`.
void register_externals(CLI::App& app, const std::string& parent = "");

/// The file of one of our programs: beside our own binary, in ../libexec/trimray, or in PATH. Fails: UnsupportedFormat.
Result<std::string> find_program(const std::string& program);

/// Replaces this process by the command's program. Returns only when it cannot, with the exit code.
int run_external(const ExternalCommand& command, const std::vector<std::string>& arguments);

} // namespace trimray
