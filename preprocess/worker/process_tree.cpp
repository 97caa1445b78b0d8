#include "preprocess/worker/process_tree.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <memory>
#include <string_view>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace trimray {
namespace {

/// The start of a file in a process's folder; empty when the process is gone.
std::string_view read_proc(pid_t pid, const char* file, std::array<char, 1024>& text)
{
    std::array<char, 64> path{};
    fmt::format_to_n(path.data(), path.size() - 1, "/proc/{}/{}", pid, file);
    const int fd = open(path.data(), O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return {};
    const ssize_t size = read(fd, text.data(), text.size() - 1);
    close(fd);
    text[size > 0 ? static_cast<size_t>(size) : 0] = 0;
    return {text.data(), size > 0 ? static_cast<size_t>(size) : 0};
}

/// The parent of a process, 0 when it is gone. Source: proc(5), /proc/pid/stat: "pid (name) state parent ...".
pid_t parent_of(pid_t pid)
{
    std::array<char, 1024> text{};
    const std::string_view line = read_proc(pid, "stat", text);
    const size_t name_end = line.rfind(')'); // a name may hold spaces and brackets
    char state = 0;
    int parent = 0;
    if (name_end == std::string_view::npos || sscanf(line.data() + name_end + 1, " %c %d", &state, &parent) != 2)
        return 0;
    return parent;
}

} // namespace

ProcessTable ProcessTable::read()
{
    ProcessTable table;
    struct Close {
        void operator()(DIR* folder) const { closedir(folder); }
    };
    const std::unique_ptr<DIR, Close> folder{opendir("/proc")};
    while (const dirent* entry = folder ? readdir(folder.get()) : nullptr) {
        pid_t pid = 0;
        const char* end = entry->d_name + std::strlen(entry->d_name);
        if (const auto parsed = std::from_chars(entry->d_name, end, pid); parsed.ec != std::errc() || parsed.ptr != end)
            continue;
        if (const pid_t parent = parent_of(pid); parent > 0)
            table.children_.emplace(parent, pid);
    }
    return table;
}

std::vector<pid_t> ProcessTable::children_of(pid_t parent) const
{
    std::vector<pid_t> list;
    for (auto [it, end] = children_.equal_range(parent); it != end; ++it)
        list.push_back(it->second);
    return list;
}

std::vector<pid_t> ProcessTable::tree_of(pid_t root) const
{
    std::vector<pid_t> list{root};
    for (size_t i = 0; i < list.size(); ++i)
        for (const pid_t child : children_of(list[i]))
            if (std::find(list.begin(), list.end(), child) == list.end()) // numbers can be taken anew while we read
                list.push_back(child);
    return list;
}

uint64_t resident_bytes(pid_t pid)
{
    std::array<char, 1024> text{};
    unsigned long long total = 0, resident = 0;
    const std::string_view line = read_proc(pid, "statm", text);
    if (line.empty() || sscanf(line.data(), "%llu %llu", &total, &resident) != 2)
        return 0;
    return resident * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

uint64_t written_bytes(pid_t pid)
{
    std::array<char, 1024> text{};
    const std::string_view lines = read_proc(pid, "io", text);
    constexpr std::string_view kWritten = "wchar: ";
    const size_t at = lines.find(kWritten);
    return at == std::string_view::npos ? 0 : std::strtoull(lines.data() + at + kWritten.size(), nullptr, 10);
}

void adopt_orphans()
{
    prctl(PR_SET_CHILD_SUBREAPER, 1);
}

int end_orphans(const std::vector<pid_t>& known)
{
    int ended = 0;
    for (;;) { // ending one can bring its children here
        const ProcessTable table = ProcessTable::read();
        std::vector<pid_t> orphans = table.children_of(getpid());
        std::erase_if(orphans,
                      [&](pid_t child) { return std::find(known.begin(), known.end(), child) != known.end(); });
        if (orphans.empty())
            return ended;
        for (const pid_t orphan : orphans)
            for (const pid_t process : table.tree_of(orphan))
                kill(process, SIGKILL);
        for (const pid_t orphan : orphans) {
            while (waitpid(orphan, nullptr, 0) < 0 && errno == EINTR) {
            }
            ++ended;
        }
    }
}

} // namespace trimray
