#include "preprocess/worker/machine_memory.h"

#include <algorithm>
#include <fstream>
#include <unistd.h>

namespace trimray {
namespace {

namespace fs = std::filesystem;

/// The path of this process's control group. Source: cgroups(7), /proc/self/cgroup: "0::/path" for version 2.
std::string own_group()
{
    std::ifstream file("/proc/self/cgroup");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("0::"))
            return line.substr(3);
    return "/";
}

} // namespace

uint64_t group_memory(const fs::path& root, const std::string& group)
{
    uint64_t least = UINT64_MAX;
    fs::path folder = root;
    const auto look = [&] {
        uint64_t bytes = 0; // "max", or no file: no limit here
        if (std::ifstream file(folder / "memory.max"); file >> bytes)
            least = std::min(least, bytes);
    };
    look();
    for (const fs::path& part : fs::path(group).relative_path()) {
        folder /= part;
        look();
    }
    return least;
}

uint64_t machine_memory()
{
    const auto physical = static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
    return std::min(physical, group_memory("/sys/fs/cgroup", own_group()));
}

} // namespace trimray
