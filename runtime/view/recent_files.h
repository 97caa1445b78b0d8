// The models that were open last, newest first, kept in a file between runs.
#pragma once

#include "format/result.h"

#include <cstddef>
#include <string>
#include <vector>

namespace trimray {

struct RecentFile {
    std::string file; // absolute
    std::string pack; // where its pack is: itself, or the one in the cache
    bool operator==(const RecentFile&) const = default;
};

constexpr size_t kMostRecentFiles = 24;

/// None where there is no such list. Fails: FileNotReadable; InvalidScene (it is none).
Result<std::vector<RecentFile>> read_recent_files(const std::string& list);

/// Puts a file first, reading the list anew: other windows write it too. Fails: as read_recent_files; FileNotWritable.
Status remember_file(const std::string& list, const RecentFile& opened);

} // namespace trimray
