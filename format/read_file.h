// A file's bytes, all of them.
#pragma once

#include "format/result.h"

#include <cstddef>
#include <string>
#include <vector>

namespace trimray {

/// The whole file. Fails: FileNotFound, FileNotReadable.
Result<std::vector<std::byte>> read_file(const std::string& path);

} // namespace trimray
