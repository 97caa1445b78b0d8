// Packs of CAD files that were opened before: $XDG_CACHE_HOME/trimray/packs, named by the file's content and the
// version that converted it, so a file that changed or moved is neither stale nor converted twice.
#pragma once

#include "format/result.h"

#include <cstdint>
#include <string>

namespace trimray {

/// The cache's folder, made if it is not there. Fails: FileNotWritable, FileNotFound (neither XDG_CACHE_HOME nor HOME).
Result<std::string> pack_cache_folder();

/// Where the pack of a CAD file is, or is to be. Fails: FileNotFound, FileNotReadable; as pack_cache_folder.
Result<std::string> cached_pack_name(const std::string& cad_file);

constexpr uint64_t kPackCacheBytes = 4ull << 30;

/// Removes those packs that were read longest ago, until all that stay take `most_bytes` at most; never `keep`.
void trim_pack_cache(const std::string& folder, uint64_t most_bytes, const std::string& keep);

} // namespace trimray
