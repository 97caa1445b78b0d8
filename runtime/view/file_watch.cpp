#include "runtime/view/file_watch.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>

namespace trimray {
namespace fs = std::filesystem;

FileWatch::FileWatch(std::function<void()> wake)
    : wake_(std::move(wake)), inotify_(inotify_init1(IN_CLOEXEC | IN_NONBLOCK)), stop_(eventfd(0, EFD_CLOEXEC))
{
    if (inotify_ >= 0 && stop_ >= 0)
        thread_ = std::thread([this] { run(); });
}

FileWatch::~FileWatch()
{
    const uint64_t one = 1;
    if (thread_.joinable()) {
        while (write(stop_, &one, sizeof one) < 0 && errno == EINTR) {
        }
        thread_.join();
    }
    if (inotify_ >= 0)
        close(inotify_);
    if (stop_ >= 0)
        close(stop_);
}

Status FileWatch::watch(const std::string& file)
{
    const std::lock_guard lock(mutex_);
    if (folder_ >= 0)
        inotify_rm_watch(inotify_, folder_);
    folder_ = -1;
    const fs::path path(file);
    name_ = path.filename().string();
    changed_ = false;
    const std::string folder = path.has_parent_path() ? path.parent_path().string() : ".";
    // a folder, for programs write a new file and then give it the name; and only when it is whole
    if (thread_.joinable())
        folder_ = inotify_add_watch(inotify_, folder.c_str(), IN_CLOSE_WRITE | IN_MOVED_TO);
    if (folder_ < 0)
        return Error{ErrorCode::FileNotReadable, file,
                     fmt::format("is not watched for changes: {}", std::strerror(errno))};
    return Done{};
}

void FileWatch::run()
{
    for (;;) {
        std::array<pollfd, 2> waited{pollfd{inotify_, POLLIN, 0}, pollfd{stop_, POLLIN, 0}};
        if (poll(waited.data(), waited.size(), -1) < 0 && errno != EINTR)
            return;
        if (waited[1].revents != 0)
            return;
        alignas(inotify_event) std::array<char, 4096> buffer;
        bool met = false;
        for (ssize_t size; (size = read(inotify_, buffer.data(), buffer.size())) > 0;) {
            const std::lock_guard lock(mutex_);
            for (const char* at = buffer.data(); at < buffer.data() + size;) {
                const auto* event = reinterpret_cast<const inotify_event*>(at);
                met |= event->len > 0 && event->wd == folder_ && name_ == event->name;
                at += sizeof(inotify_event) + event->len;
            }
        }
        if (met) {
            changed_ = true;
            wake_();
        }
    }
}

} // namespace trimray
