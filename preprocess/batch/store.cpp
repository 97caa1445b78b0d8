#include "preprocess/batch/store.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fmt/format.h>
#include <random>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace trimray {
namespace {

namespace fs = std::filesystem;

Error not_writable(const fs::path& path, const std::string& why)
{
    return {ErrorCode::FileNotWritable, path.string(), why};
}

Status make_folder(const fs::path& path)
{
    std::error_code failed;
    fs::create_directories(path, failed);
    if (failed)
        return not_writable(path, fmt::format("cannot be made: {}", failed.message()));
    return Done{};
}

/// The same file now as when it was opened: it may have been removed meanwhile, and made anew by another process.
bool is_still(const fs::path& path, int descriptor)
{
    struct stat opened {
    }, named{};
    return fstat(descriptor, &opened) == 0 && stat(path.c_str(), &named) == 0 && opened.st_ino == named.st_ino &&
           opened.st_dev == named.st_dev;
}

void sync_folder(const fs::path& folder)
{
    const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0)
        return; // the pack is there; it is only not sure to survive a power cut
    fsync(descriptor);
    close(descriptor);
}

} // namespace

std::optional<FileLock> FileLock::take(const fs::path& path)
{
    for (;;) {
        const int descriptor = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
        if (descriptor < 0)
            return std::nullopt;
        if (flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
            close(descriptor);
            return std::nullopt;
        } // a file system without locks: work goes on, and may be done twice, never wrongly
        if (is_still(path, descriptor))
            return FileLock(path, descriptor);
        close(descriptor);
    }
}

FileLock::FileLock(FileLock&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1))
{
}

FileLock& FileLock::operator=(FileLock&& other) noexcept
{
    std::swap(path_, other.path_);
    std::swap(descriptor_, other.descriptor_);
    return *this;
}

FileLock::~FileLock()
{
    if (descriptor_ >= 0)
        close(descriptor_);
}

void FileLock::remove_file()
{
    unlink(path_.c_str());
}

bool is_locked(const fs::path& path)
{
    const int descriptor = open(path.c_str(), O_RDWR | O_CLOEXEC); // NFS wants it open for writing
    if (descriptor < 0)
        return false;
    const bool locked = flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    close(descriptor);
    return locked;
}

Result<Store> Store::open(const fs::path& folder)
{
    for (const char* part : {"store", "packs", "ledger", "tmp", "claims"})
        if (const Status made = make_folder(folder / part); !made)
            return made.error();
    return Store(folder);
}

fs::path Store::pack_path(const std::string& key) const
{
    return folder_ / "store" / key.substr(0, 2) / (key + ".tray"); // 256 folders: none grows too large to list
}

fs::path Store::claim_path(const std::string& key) const
{
    return folder_ / "claims" / key;
}

fs::path Store::link_name(const std::string& file)
{
    return fs::path("packs") / (file + ".tray");
}

Status Store::publish(const fs::path& pack, const std::string& key) const
{
    const fs::path target = pack_path(key);
    if (const Status made = make_folder(target.parent_path()); !made)
        return made;
    std::error_code failed;
    fs::rename(pack, target, failed);
    if (failed)
        return not_writable(target, fmt::format("rename: {}", failed.message()));
    sync_folder(target.parent_path());
    return Done{};
}

Status Store::link(const std::string& file, const std::string& key) const
{
    const fs::path name = folder_ / link_name(file);
    const fs::path target = fs::relative(pack_path(key), name.parent_path());
    std::error_code failed;
    if (fs::read_symlink(name, failed) == target)
        return Done{};
    if (const Status made = make_folder(name.parent_path()); !made)
        return made;
    const fs::path temporary = name.parent_path() / fmt::format(".{:08x}.tmp", std::random_device()());
    failed.clear();
    fs::create_symlink(target, temporary, failed);
    if (!failed)
        fs::rename(temporary, name, failed);
    if (failed)
        return not_writable(name, fmt::format("no link to its pack: {}", failed.message()));
    return Done{};
}

void Store::sweep() const
{
    std::error_code ignored; // a courtesy: what cannot be removed does no harm
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_ / "tmp", ignored))
        if (const auto lock = FileLock::take(entry.path() / "lock"))
            fs::remove_all(entry.path(), ignored);
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_ / "claims", ignored))
        if (auto lock = FileLock::take(entry.path()))
            lock->remove_file();
}

Result<ScratchFolder> ScratchFolder::make(const Store& store)
{
    std::random_device random;
    constexpr int kTries = 16; // another process may sweep the folder away before it is locked
    for (int i = 0; i < kTries; ++i) {
        const fs::path path = store.folder() / "tmp" / fmt::format("{:08x}{:08x}", random(), random());
        if (const Status made = make_folder(path); !made)
            return made.error();
        if (std::optional<FileLock> lock = FileLock::take(path / "lock"))
            return ScratchFolder(path, std::move(*lock));
    }
    return not_writable(store.folder() / "tmp", "no scratch folder could be made and locked");
}

ScratchFolder::~ScratchFolder()
{
    std::error_code ignored;
    if (!path_.empty())
        fs::remove_all(path_, ignored);
}

Result<fs::path> ScratchFolder::empty_folder(const std::string& name) const
{
    const fs::path folder = path_ / name;
    std::error_code failed;
    if (!fs::is_empty(folder, failed) || failed) {
        failed.clear();
        fs::remove_all(folder, failed);
        if (const Status made = make_folder(folder); !made)
            return made.error();
    }
    return folder;
}

} // namespace trimray
