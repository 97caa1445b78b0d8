// Tells when a file was written anew, in its place or by another that took it.
#pragma once

#include "format/result.h"

#include <atomic>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace trimray {

class FileWatch {
public:
    /// `wake` is called from a thread of its own when the file has changed.
    explicit FileWatch(std::function<void()> wake);
    ~FileWatch();
    FileWatch(const FileWatch&) = delete;
    FileWatch& operator=(const FileWatch&) = delete;

    /// From now on this file in place of the one before; changes that were not taken are forgotten. Fails:
    /// FileNotReadable (the system does not watch its folder).
    Status watch(const std::string& file);
    /// Whether the file was written since the last call.
    bool take_change() { return changed_.exchange(false); }

private:
    void run();

    std::function<void()> wake_;
    int inotify_ = -1, stop_ = -1, folder_ = -1; // descriptors; the watch of the file's folder
    std::mutex mutex_;
    std::string name_; // without its folder
    std::atomic<bool> changed_ = false;
    std::thread thread_;
};

} // namespace trimray
