// How much memory there is for this process: the machine's, or less where a container or a job has been given less.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace trimray {

/// Bytes that this process may use, as the machine and its control groups of version 2 say.
uint64_t machine_memory();

/// The least memory.max (bytes) of a control group and those above it; UINT64_MAX: none sets one.
/// `root`: where cgroup 2 is mounted; `group`: its path below that. Source: cgroup-v2.rst, "memory.max".
uint64_t group_memory(const std::filesystem::path& root, const std::string& group);

} // namespace trimray
