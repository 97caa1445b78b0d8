#include "runtime/measure/converter.h"

#include "runtime/commands.h"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <spawn.h>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace trimray {
namespace {
namespace fs = std::filesystem;

/// A pipe whose ends close with it.
struct Pipe {
    std::array<int, 2> ends{-1, -1};
    ~Pipe()
    {
        close_end(0);
        close_end(1);
    }
    void close_end(size_t i)
    {
        if (ends[i] >= 0)
            ::close(ends[i]);
        ends[i] = -1;
    }
};

Error cannot_run(const std::string& program, int code)
{
    return Error{ErrorCode::Internal, program, fmt::format("cannot be run: {}", std::strerror(code))};
}

/// What a program prints on stdout, and its exit code. Its stderr goes to the file `log`.
Result<std::pair<std::string, int>> output_of(const std::string& program, std::vector<std::string> arguments,
                                              const std::string& log)
{
    arguments.insert(arguments.begin(), program);
    std::vector<char*> argv;
    for (std::string& argument : arguments)
        argv.push_back(argument.data());
    argv.push_back(nullptr);
    Pipe pipe;
    if (::pipe2(pipe.ends.data(), O_CLOEXEC) != 0)
        return cannot_run(program, errno);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, pipe.ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    pid_t child = -1;
    const int failed = posix_spawn(&child, program.c_str(), &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (failed != 0)
        return cannot_run(program, failed);
    pipe.close_end(1);
    std::string text;
    std::array<char, 65536> buffer;
    for (;;) {
        const ssize_t count = ::read(pipe.ends[0], buffer.data(), buffer.size());
        if (count > 0)
            text.append(buffer.data(), static_cast<size_t>(count));
        else if (count == 0 || errno != EINTR)
            break;
    }
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return std::pair{std::move(text), WIFEXITED(status) ? WEXITSTATUS(status) : int{kExitInternal}};
}

/// "no reason given": there is none.
std::string last_line(const std::string& path)
{
    std::ifstream file(path);
    std::string last = "no reason given";
    for (std::string line; std::getline(file, line);)
        if (!line.empty())
            last = line;
    return last;
}

ErrorCode code_of(int exit_code)
{
    switch (exit_code) {
    case kExitUsage:
        return ErrorCode::Usage;
    case kExitIo:
        return ErrorCode::FileNotReadable;
    case kExitInvalid:
        return ErrorCode::InvalidCad;
    case kExitUnsupported:
        return ErrorCode::UnsupportedFormat;
    default:
        return ErrorCode::Internal;
    }
}

} // namespace

bool is_cad_file(const std::string& path)
{
    return fs::path(path).extension() != ".tray";
}

Result<ScratchFolder> ScratchFolder::make()
{
    std::error_code failed;
    const fs::path parent = fs::temp_directory_path(failed);
    if (failed)
        return Error{ErrorCode::FileNotWritable, "temporary folder",
                     fmt::format("{}; set TMPDIR to a folder that exists", failed.message())};
    std::string name = parent / "trimray-measure-XXXXXX";
    if (::mkdtemp(name.data()) == nullptr)
        return Error{ErrorCode::FileNotWritable, name,
                     fmt::format("cannot be made: {}; set TMPDIR to a folder with room", std::strerror(errno))};
    return ScratchFolder(std::move(name));
}

ScratchFolder::ScratchFolder(ScratchFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}

ScratchFolder::~ScratchFolder()
{
    std::error_code ignored;
    if (!path_.empty())
        fs::remove_all(path_, ignored);
}

Result<Json> run_converter(const std::string& model, const std::string& output, const std::vector<std::string>& options)
{
    const Result<std::string> program = find_program("trimray-pack");
    if (!program.ok())
        return program.error();
    std::vector<std::string> arguments{model, "-o", output, "--json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const std::string log = output + ".log";
    const auto ran = output_of(*program, arguments, log);
    if (!ran.ok())
        return ran.error();
    const auto& [text, exit_code] = *ran;
    if (exit_code != kExitOk && exit_code != kExitPartial)
        return Error{code_of(exit_code), model, "was not converted: " + last_line(log)};
    Json report = Json::parse(text, nullptr, false);
    if (report.is_discarded())
        return Error{ErrorCode::Internal, *program, "its report is no JSON"};
    return report;
}

std::vector<std::string> losses(const Json& report)
{
    std::vector<std::string> lost;
    if (const Json& dropped = report["dropped"]; !dropped.empty())
        lost.push_back(fmt::format("{} faces are missing, the first (face {} of part {}) because: {}", dropped.size(),
                                   dropped[0]["face"].get<size_t>(), dropped[0]["part"].get<size_t>(),
                                   dropped[0]["reason"].get<std::string>()));
    if (report.contains("without_triangles") && !report["without_triangles"].empty())
        lost.push_back(fmt::format("{} faces have no triangles", report["without_triangles"].size()));
    for (const Json& warning : report["warnings"])
        lost.push_back(warning.get<std::string>());
    return lost;
}

} // namespace trimray
