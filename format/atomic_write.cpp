// The atomic way onto the disk: a temporary file beside the target, fsync, rename, fsync of the folder.
#include "format/pack_writer.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <random>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

namespace trimray {
namespace {

namespace fs = std::filesystem;

Error not_writable(const fs::path& path, const char* step, int error_number)
{
    return {ErrorCode::FileNotWritable, path.string(), fmt::format("{}: {}", step, std::strerror(error_number))};
}

/// "." + the target's name + ".": what the temporaries of a target begin with. Long names are cut, so that the
/// temporary's own name stays within the 255 bytes that file systems allow.
std::string temporary_prefix(const fs::path& target)
{
    constexpr size_t kLongestName = 200;
    return fmt::format(".{}.", target.filename().string().substr(0, kLongestName));
}

fs::path folder_of(const fs::path& target)
{
    return target.has_parent_path() ? target.parent_path() : fs::path(".");
}

/// Closes its file, and removes it unless the rename has happened.
struct TemporaryFile {
    fs::path path;
    int descriptor = -1;
    bool renamed = false;
    ~TemporaryFile()
    {
        if (descriptor >= 0)
            ::close(descriptor);
        if (descriptor >= 0 && !renamed)
            ::unlink(path.c_str());
    }
};

int write_all(int descriptor, const std::vector<std::byte>& bytes)
{
    constexpr size_t kChunk = 64u << 20; // a write above 2 GiB comes back short
    for (size_t done = 0; done < bytes.size();) {
        const ssize_t n = ::write(descriptor, &bytes[done], std::min(kChunk, bytes.size() - done));
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return n < 0 ? errno : ENOSPC;
        done += static_cast<size_t>(n);
    }
    return 0;
}

int sync_folder(const fs::path& folder)
{
    const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0)
        return errno;
    // some network file systems cannot fsync a folder and say EINVAL; the rename stands there all the same
    const int failed = ::fsync(descriptor) != 0 && errno != EINVAL ? errno : 0;
    ::close(descriptor);
    return failed;
}

} // namespace

// Temporaries are called `.<name>.<pid>.<random>.tmp`.
void sweep_stale_temporaries(const std::string& path)
{
    const fs::path target(path);
    const std::string prefix = temporary_prefix(target);
    constexpr std::string_view kSuffix = ".tmp";
    std::error_code ignored; // sweeping is a courtesy: a folder that cannot be listed fails at the write, with a reason
    for (fs::directory_iterator it(folder_of(target), ignored), end; it != end; it.increment(ignored)) {
        const std::string name = it->path().filename().string();
        if (!name.starts_with(prefix) || !name.ends_with(kSuffix))
            continue;
        pid_t pid = 0;
        const char* first = name.data() + prefix.size();
        const auto parsed = std::from_chars(first, name.data() + name.size(), pid);
        const bool has_pid = parsed.ec == std::errc() && parsed.ptr != name.data() + name.size() && *parsed.ptr == '.';
        if (has_pid && pid > 0 && ::kill(pid, 0) != 0 && errno == ESRCH)
            fs::remove(it->path(), ignored);
    }
}

Status write_file_atomically(const std::string& path, const std::vector<std::byte>& bytes, Durability durability)
{
    const fs::path target(path);
    if (!target.has_filename())
        return not_writable(target, "name of the file", EISDIR);
    struct stat existing;
    if (::stat(target.c_str(), &existing) == 0 && !S_ISREG(existing.st_mode))
        return not_writable(target, "target is not a regular file", S_ISDIR(existing.st_mode) ? EISDIR : EINVAL);
    sweep_stale_temporaries(path);

    std::random_device random;
    TemporaryFile temporary;
    temporary.path = folder_of(target) / fmt::format("{}{}.{:08x}.tmp", temporary_prefix(target), ::getpid(), random());
    temporary.descriptor = ::open(temporary.path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (temporary.descriptor < 0)
        return not_writable(target, "create a temporary file beside it", errno);
    if (const int failed = write_all(temporary.descriptor, bytes))
        return not_writable(target, "write", failed);
    if (durability == Durability::Synced && ::fsync(temporary.descriptor) != 0)
        return not_writable(target, "fsync", errno);
    if (::rename(temporary.path.c_str(), target.c_str()) != 0)
        return not_writable(target, "rename", errno);
    temporary.renamed = true;
    if (const int failed = durability == Durability::Synced ? sync_folder(folder_of(target)) : 0)
        return not_writable(target, "fsync of its folder", failed);
    return Done{};
}

} // namespace trimray
