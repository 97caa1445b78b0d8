#include "runtime/view/pack_cache.h"

#include "runtime/view/user_folders.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <system_error>
#include <vector>

namespace trimray {
namespace {
namespace fs = std::filesystem;
} // namespace

Result<std::string> pack_cache_folder()
{
    return user_folder(UserFolder::Cache, "packs");
}

Result<std::string> cached_pack_name(const std::string& cad_file)
{
    std::error_code unknown; // opening it says so then
    if (fs::is_directory(cad_file, unknown))
        return Error{ErrorCode::FileNotReadable, cad_file, "is a folder; name the files in it"};
    const Result<std::string> folder = pack_cache_folder();
    if (!folder.ok())
        return folder.error();
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(cad_file.c_str(), "rb"), &std::fclose);
    if (!file)
        return Error{errno == ENOENT ? ErrorCode::FileNotFound : ErrorCode::FileNotReadable, cad_file,
                     std::strerror(errno)};
    const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(), &XXH3_freeState);
    XXH3_128bits_reset(state.get());
    std::array<char, 1 << 16> buffer;
    for (size_t count; (count = std::fread(buffer.data(), 1, buffer.size(), file.get())) > 0;)
        XXH3_128bits_update(state.get(), buffer.data(), count);
    if (std::ferror(file.get()) != 0)
        return Error{ErrorCode::FileNotReadable, cad_file, "cannot be read to its end"};
    const XXH128_hash_t hash = XXH3_128bits_digest(state.get());
    // the ending decides the format; of a zip or gzip it may be the name within
    const std::string ending = fs::path(cad_file).extension().string();
    return fmt::format("{}/{:016x}{:016x}{}-{}.tray", *folder, hash.high64, hash.low64, ending, TRIMRAY_VERSION);
}

void trim_pack_cache(const std::string& folder, uint64_t most_bytes, const std::string& keep)
{
    struct Entry {
        fs::file_time_type time;
        uint64_t bytes;
        fs::path path;
    };
    std::vector<Entry> entries;
    uint64_t sum = 0;
    std::error_code ignored; // a cache that cannot be listed or emptied is left as it is
    for (fs::directory_iterator it(folder, ignored), end; it != end; it.increment(ignored)) {
        if (it->path().extension() != ".tray")
            continue;
        const uint64_t bytes = it->file_size(ignored);
        entries.push_back({it->last_write_time(ignored), bytes, it->path()});
        sum += bytes;
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.time < b.time; });
    for (const Entry& entry : entries) {
        if (sum <= most_bytes)
            return;
        if (entry.path == fs::path(keep))
            continue;
        fs::remove(entry.path, ignored);
        sum -= entry.bytes;
    }
}

} // namespace trimray
