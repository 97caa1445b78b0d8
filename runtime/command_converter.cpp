#include "runtime/command_converter.h"

#include "format/pack_writer.h"
#include "runtime/commands.h"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <poll.h>
#include <spawn.h>
#include <sstream>
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

/// What a program said, and its exit code.
struct Ran {
    std::string output, last_words; // stdout; the last line on stderr
    int exit_code = kExitInternal;
};

/// Takes "progress PHASE SHARE"; false: the line is something else.
bool take_progress(const std::string& line, const ConverterWatch& watch)
{
    std::istringstream words(line);
    std::string word, phase, share;
    words >> word >> phase >> share;
    if (word != "progress" || share.empty())
        return false;
    if (watch.progress)
        watch.progress(phase, std::strtod(share.c_str(), nullptr));
    return true;
}

/// Reads what is there. False: the other end is closed.
bool read_some(int descriptor, std::string& text)
{
    std::array<char, 65536> buffer;
    const ssize_t count = ::read(descriptor, buffer.data(), buffer.size());
    if (count > 0)
        text.append(buffer.data(), static_cast<size_t>(count));
    return count > 0 || (count < 0 && errno == EINTR);
}

/// Runs a program in a process group of its own. Fails: Internal (it cannot be run), Interrupted.
Result<Ran> run_watched(const std::string& program, std::vector<std::string> arguments, const ConverterWatch& watch)
{
    arguments.insert(arguments.begin(), program);
    std::vector<char*> argv;
    for (std::string& argument : arguments)
        argv.push_back(argument.data());
    argv.push_back(nullptr);
    Pipe output, errors;
    if (::pipe2(output.ends.data(), O_CLOEXEC) != 0 || ::pipe2(errors.ends.data(), O_CLOEXEC) != 0)
        return cannot_run(program, errno);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, output.ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, errors.ends[1], STDERR_FILENO);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    pid_t child = -1;
    const int failed = posix_spawn(&child, program.c_str(), &actions, &attributes, argv.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    if (failed != 0)
        return cannot_run(program, failed);
    output.close_end(1);
    errors.close_end(1);

    constexpr int kAskEveryMs = 100;
    Ran ran;
    std::string said;
    bool cancelled = false;
    std::array<pollfd, 2> ends{pollfd{output.ends[0], POLLIN, 0}, pollfd{errors.ends[0], POLLIN, 0}};
    while (ends[0].fd >= 0 || ends[1].fd >= 0) {
        ::poll(ends.data(), ends.size(), watch.cancelled ? kAskEveryMs : -1);
        if (!cancelled && watch.cancelled && watch.cancelled()) {
            cancelled = true;
            ::kill(-child, SIGTERM); // its worker dies with it, and holds stderr open until then
        }
        if (ends[0].revents != 0 && !read_some(ends[0].fd, ran.output))
            ends[0].fd = -1;
        if (ends[1].revents != 0 && !read_some(ends[1].fd, said))
            ends[1].fd = -1;
        for (size_t end = said.find('\n'); end != std::string::npos; end = said.find('\n')) {
            const std::string line = said.substr(0, end);
            said.erase(0, end + 1);
            if (!take_progress(line, watch) && !line.empty())
                ran.last_words = line;
        }
    }
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (cancelled)
        return Error{ErrorCode::Interrupted, "", "the conversion was given up"};
    if (!said.empty())
        ran.last_words = said;
    if (WIFEXITED(status))
        ran.exit_code = WEXITSTATUS(status);
    return ran;
}

/// What trimray-pack said of a model, without its own name, the model's and the error's number.
std::string reason(std::string words, const std::string& model)
{
    const std::string before = "trimray-pack: " + model + ": ";
    if (words.starts_with(before))
        words.erase(0, before.size());
    if (const size_t number = words.rfind(" [E"); number != std::string::npos && words.ends_with("]"))
        words.erase(number);
    return words.empty() ? "no reason given" : words;
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

Result<Json> run_converter(const std::string& model, const std::string& output, const std::vector<std::string>& options,
                           const ConverterWatch& watch)
{
    const Result<std::string> program = find_program("trimray-pack");
    if (!program.ok())
        return program.error();
    std::vector<std::string> arguments{model, "-o", output, "--json"};
    if (watch.progress)
        arguments.push_back("--progress");
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Result<Ran> ran = run_watched(*program, arguments, watch);
    if (!ran.ok()) {
        sweep_stale_temporaries(output);
        return ran.error();
    }
    if (ran->exit_code != kExitOk && ran->exit_code != kExitPartial)
        return Error{code_of(ran->exit_code), model, "was not converted: " + reason(ran->last_words, model)};
    Json report = Json::parse(ran->output, nullptr, false);
    if (report.is_discarded())
        return Error{ErrorCode::Internal, *program, "its report is no JSON"};
    return report;
}

std::string missing_faces(size_t count, size_t part, size_t face, const std::string& reason)
{
    if (count == 1)
        return fmt::format("1 face is missing (face {} of part {}) because: {}", face, part, reason);
    return fmt::format("{} faces are missing, the first (face {} of part {}) because: {}", count, face, part, reason);
}

std::vector<std::string> losses(const Json& report)
{
    std::vector<std::string> lost;
    if (const Json& dropped = report["dropped"]; !dropped.empty())
        lost.push_back(missing_faces(dropped.size(), dropped[0]["part"].get<size_t>(), dropped[0]["face"].get<size_t>(),
                                     dropped[0]["reason"].get<std::string>()));
    if (report.contains("without_triangles") && !report["without_triangles"].empty())
        lost.push_back(fmt::format("{} faces have no triangles", report["without_triangles"].size()));
    for (const Json& warning : report["warnings"])
        lost.push_back(warning.get<std::string>());
    return lost;
}

} // namespace trimray
