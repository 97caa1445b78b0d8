#include "preprocess/preview.h"

#include "format/pack_writer.h"

#include <fmt/format.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace trimray {
namespace {

namespace fs = std::filesystem;

/// A folder of our own that goes away with its contents.
class TemporaryFolder {
public:
    TemporaryFolder()
    {
        std::error_code error;
        std::string name = (fs::temp_directory_path(error) / "trimray-preview-XXXXXX").string();
        if (!error && mkdtemp(name.data()) != nullptr)
            path_ = name;
    }
    ~TemporaryFolder()
    {
        std::error_code ignored; // nothing is lost when a temporary file stays
        if (!path_.empty())
            fs::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    const fs::path& path() const { return path_; }

private:
    fs::path path_;
};

/// Runs a program to its end with its output thrown away; returns its exit status, or -1 when it could not be started
/// or was ended by a signal.
int run_quietly(const std::string& program, std::vector<std::string> arguments)
{
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (std::string& argument : arguments)
        argv.push_back(argument.data());
    argv.push_back(nullptr);
    const pid_t child = fork();
    if (child == 0) { // only what is safe where other threads held locks
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        const int null_fd = open("/dev/null", O_WRONLY);
        dup2(null_fd, STDOUT_FILENO);
        dup2(null_fd, STDERR_FILENO);
        execv(program.c_str(), argv.data());
        _exit(127);
    }
    if (child < 0)
        return -1;
    int status = 0;
    while (waitpid(child, &status, 0) < 0)
        if (errno != EINTR)
            return -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::vector<std::byte> read_bytes(const fs::path& path)
{
    std::ifstream file(path, std::ios::binary);
    const std::vector<char> chars(std::istreambuf_iterator<char>(file), {});
    const auto* first = reinterpret_cast<const std::byte*>(chars.data());
    return {first, first + chars.size()};
}

} // namespace

Status add_previews(PackImage& image, const std::string& trimray_program)
{
    const TemporaryFolder folder;
    if (folder.path().empty())
        return Error{ErrorCode::FileNotWritable, "temporary folder", "no preview: no temporary folder could be made"};
    const fs::path pack = folder.path() / "scene.tray";
    constexpr int kPlain = 0; // the file lives for a second: no time for compression
    if (const Status written = write_file_atomically(pack.string(), encode_pack(image, {kPlain}), Durability::Unsynced);
        !written.ok())
        return written.error();
    const int status =
        run_quietly(trimray_program, {"preview", pack.string(), "-o", (folder.path() / "preview").string()});
    std::vector<std::byte> small = read_bytes(folder.path() / "preview-256.png");
    std::vector<std::byte> large = read_bytes(folder.path() / "preview-512.png");
    if (status != 0 || small.empty() || large.empty())
        return Error{ErrorCode::Internal, trimray_program,
                     fmt::format("no preview: `trimray preview` ended with status {}", status)};
    image.preview_256_png = std::move(small);
    if (!image.compact) // a compact pack keeps what a file list shows
        image.preview_512_png = std::move(large);
    return Done{};
}

std::string find_trimray_program()
{
    std::error_code error;
    const fs::path self = fs::read_symlink("/proc/self/exe", error);
    if (error)
        return {};
    const fs::path candidate = self.parent_path() / "trimray";
    if (access(candidate.c_str(), X_OK) == 0 && fs::is_regular_file(candidate, error))
        return candidate.string();
    return {};
}

} // namespace trimray
