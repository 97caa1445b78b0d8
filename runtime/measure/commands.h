// The subcommands of `trimray-measure`, one file each, as those of `trimray` (runtime/commands.h).
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace trimray {

/// `command_line`: as the user gave it, to measure again.
void register_accuracy(CLI::App& app, const std::string& command_line, int& exit_code);
void register_speed(CLI::App& app, int& exit_code);

} // namespace trimray
