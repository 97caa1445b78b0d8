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
        {"bench accuracy", "trimray-accuracy", "What each digit costs in time and memory, as a report"},
    };
    return commands;
}

size_t words_of(const ExternalCommand& command, const std::vector<std::string>& arguments)
{
    const std::string name = command.name;
    const size_t space = name.find(' ');
    if (space == std::string::npos)
        return !arguments.empty() && arguments[0] == name ? 1 : 0;
    return arguments.size() > 1 && arguments[0] == name.substr(0, space) && arguments[1] == name.substr(space + 1) ? 2
                                                                                                                   : 0;
}

void register_externals(CLI::App& app, const std::string& parent)
{
    // only for the list in `--help`: main runs these before anything is parsed
    for (const ExternalCommand& command : external_commands()) {
        const std::string name = command.name;
        const size_t space = name.find(' ');
        if (parent == (space == std::string::npos ? "" : name.substr(0, space)))
            app.add_subcommand(name.substr(space == std::string::npos ? 0 : space + 1), command.summary);
    }
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
         fmt::format("not found beside {} nor in PATH; build all of trimray and install it there", beside)});
}

} // namespace trimray
