#include "runtime/command_report.h"
#include "runtime/commands.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <unistd.h>

namespace trimray {
namespace fs = std::filesystem;

const std::vector<ExternalCommand>& external_commands()
{
    static const std::vector<ExternalCommand> commands = {
        {"pack", "trimray-pack", "Convert a STEP, IGES or BREP model into a scene pack"},
    };
    return commands;
}

void register_external(CLI::App& app, const ExternalCommand& command)
{
    // only for the list in `trimray --help`: main runs these before anything is parsed
    app.add_subcommand(command.name, command.summary);
}

int run_external(const ExternalCommand& command, const std::vector<std::string>& arguments)
{
    std::vector<std::string> argv_strings = {command.program};
    argv_strings.insert(argv_strings.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& argument : argv_strings)
        argv.push_back(argument.data());
    argv.push_back(nullptr);

    std::error_code failed;
    const fs::path own = fs::read_symlink("/proc/self/exe", failed);
    std::vector<fs::path> candidates;
    if (!failed)
        candidates = {own.parent_path() / command.program,
                      own.parent_path().parent_path() / "libexec" / "trimray" / command.program};
    for (const fs::path& candidate : candidates) {
        if (!fs::exists(candidate, failed))
            continue;
        execv(candidate.c_str(), argv.data());
        return report_error({ErrorCode::FileNotReadable, candidate.string(),
                             fmt::format("cannot be run: {}; reinstall trimray", std::strerror(errno))});
    }
    execvp(command.program, argv.data());
    const std::string beside = failed || own.empty() ? "trimray" : own.parent_path().string();
    return report_error(
        {ErrorCode::UnsupportedFormat, command.program,
         fmt::format("not found beside {} nor in PATH; build it with -DTRIMRAY_PREPROCESS=ON (it needs OpenCASCADE) "
                     "and install it there",
                     beside)});
}

} // namespace trimray
