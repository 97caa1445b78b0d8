#include "format/read_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>

#include <fmt/format.h>

namespace trimray {

Result<std::vector<std::byte>> read_file(const std::string& path)
{
    std::vector<std::byte> bytes;
    std::FILE* file = std::fopen(path.c_str(), "rb");
    if (file == nullptr)
        return Error{errno == ENOENT ? ErrorCode::FileNotFound : ErrorCode::FileNotReadable, path,
                     fmt::format("{}; check the name", std::strerror(errno))};
    constexpr size_t kChunk = size_t{1} << 20;
    size_t got = 0;
    do {
        const size_t had = bytes.size();
        bytes.resize(had + kChunk);
        got = std::fread(bytes.data() + had, 1, kChunk, file);
        bytes.resize(had + got);
    } while (got == kChunk);
    const int failure = std::ferror(file) != 0 ? errno : 0;
    std::fclose(file);
    if (failure != 0)
        return Error{ErrorCode::FileNotReadable, path, fmt::format("{}; check the file", std::strerror(failure))};
    return bytes;
}

} // namespace trimray
