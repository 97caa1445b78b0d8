// The folder that a batch writes to, which many processes and hosts may share:
//   store/ab/abcd...tray   packs, by the key of what they were made from
//   packs/<file>.tray      a link to each file's pack, under the file's own name
//   ledger/*.jsonl         what happened (ledger.h)
//   tmp/, claims/          of runs at work; what dead ones left is swept
#pragma once

#include "format/result.h"

#include <filesystem>
#include <optional>
#include <string>

namespace trimray {

/// A lock on a file, which ends with the process however that ends; held on every host that shares the folder, where
/// the file system has locks.
class FileLock {
public:
    /// Makes the file if need be. Nothing: another process holds it, or the file cannot be made.
    static std::optional<FileLock> take(const std::filesystem::path& path);
    FileLock(FileLock&& other) noexcept;
    FileLock& operator=(FileLock&& other) noexcept;
    FileLock(const FileLock&) = delete;
    ~FileLock(); // lets go; the file stays

    /// Removes the file while it is held.
    void remove_file();

private:
    FileLock(std::filesystem::path path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}
    std::filesystem::path path_;
    int descriptor_;
};

/// True when another process holds the lock.
bool is_locked(const std::filesystem::path& path);

class Store {
public:
    /// Makes the folders. Fails: FileNotWritable.
    static Result<Store> open(const std::filesystem::path& folder);

    const std::filesystem::path& folder() const { return folder_; }
    std::filesystem::path ledger_folder() const { return folder_ / "ledger"; }
    std::filesystem::path pack_path(const std::string& key) const;
    std::filesystem::path claim_path(const std::string& key) const;
    /// Relative to the folder.
    static std::filesystem::path link_name(const std::string& file);

    /// Moves a finished pack, which lies in a scratch folder of this store, to its key. Fails: FileNotWritable.
    Status publish(const std::filesystem::path& pack, const std::string& key) const;

    /// Links a file's name to the pack under `key`, in the place of an older link. Fails: FileNotWritable.
    Status link(const std::string& file, const std::string& key) const;

    /// Removes scratch folders and claims of processes that are gone.
    void sweep() const;

private:
    explicit Store(std::filesystem::path folder) : folder_(std::move(folder)) {}
    std::filesystem::path folder_;
};

/// A folder for temporary files of one process, in tmp/ of a store: locked while the process lives, removed with it.
class ScratchFolder {
public:
    /// Fails: FileNotWritable.
    static Result<ScratchFolder> make(const Store& store);
    ScratchFolder(ScratchFolder&&) noexcept = default;
    ~ScratchFolder();

    const std::filesystem::path& path() const { return path_; }

    /// An empty folder in it, for one worker. Fails: FileNotWritable.
    Result<std::filesystem::path> empty_folder(const std::string& name) const;

private:
    ScratchFolder(std::filesystem::path path, FileLock lock) : path_(std::move(path)), lock_(std::move(lock)) {}
    std::filesystem::path path_;
    FileLock lock_;
};

} // namespace trimray
