#include "format/command_report.h"
#include "runtime/commands.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <unistd.h>

namespace trimray {
namespace fs = std::filesystem;

const std::vector<ExternalCommand>& external_commands()
{
    static const std::vector<ExternalCommand> commands = {
        {"pack", "trimray-pack", "Convert a STEP, IGES or BREP model into a scene pack"},
        {"batch", "trimray-batch", "Convert many models, each in a process of its own, with a ledger"},
        {"view", "trimray-view", "Look at packs and models in a window"},
        {"bench accuracy", "trimray-measure", "What each digit costs in time and memory, as a report"},
        {"bench speed", "trimray-measure", "Speed beside baselines, and exact counts, against a stored run"},
    };
    return commands;
}

bool is_asked_for(const ExternalCommand& command, const std::vector<std::string>& arguments)
{
    std::istringstream words(command.name);
    size_t i = 0;
    for (std::string word; words >> word; ++i)
        if (i >= arguments.size() || arguments[i] != word)
            return false;
    return true;
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

Result<std::string> find_program(const std::string& program)
{
    std::error_code failed;
    const fs::path own = fs::read_symlink("/proc/self/exe", failed);
    if (!failed)
        for (const fs::path& candidate :
             {own.parent_path() / program, own.parent_path().parent_path() / "libexec" / "trimray" / program})
            if (fs::exists(candidate, failed))
                return candidate.string();
    const char* path = std::getenv("PATH");
    std::istringstream folders(path ? path : "");
    for (std::string folder; std::getline(folders, folder, ':');)
        if (const fs::path candidate = fs::path(folder) / program;
            !folder.empty() && access(candidate.c_str(), X_OK) == 0)
            return candidate.string();
    return Error{ErrorCode::UnsupportedFormat, program,
                 fmt::format("not found beside {} nor in PATH; build all of trimray (the converter: "
                             "-DTRIMRAY_PREPROCESS=ON, with OpenCASCADE) and install it there",
                             own.empty() ? "trimray" : own.parent_path().string())};
}

int run_external(const ExternalCommand& command, const std::vector<std::string>& arguments)
{
    const Result<std::string> program = find_program(command.program);
    if (!program.ok())
        return report_error(program.error());
    std::vector<std::string> argv_strings = {command.program};
    argv_strings.insert(argv_strings.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& argument : argv_strings)
        argv.push_back(argument.data());
    argv.push_back(nullptr);
    execv(program->c_str(), argv.data());
    return report_error({ErrorCode::FileNotReadable, *program,
                         fmt::format("cannot be run: {}; reinstall trimray", std::strerror(errno))});
}

} // namespace trimray
