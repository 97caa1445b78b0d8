#include "preprocess/source/content_hash.h"

#include <deque>
#include <filesystem>
#include <fmt/format.h>
#include <memory>
#include <set>
#include <system_error>
#include <utility>
#include <xxhash.h>

namespace trimray {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMaxFiles = 100'000;          // of one assembly
constexpr uint64_t kMaxReferred = 64ull << 30; // bytes of all of them; /proc/kcore is a file too, of 128 TiB

class Hash {
public:
    Hash() { XXH3_128bits_reset(state_.get()); }
    void add(std::string_view bytes) { XXH3_128bits_update(state_.get(), bytes.data(), bytes.size()); }
    std::string text() const
    {
        const XXH128_hash_t hash = XXH3_128bits_digest(state_.get());
        return fmt::format("xxh3-128:{:016x}{:016x}", hash.high64, hash.low64);
    }

private:
    std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state_{XXH3_createState(), &XXH3_freeState};
};

/// The files that one refers to, by the names it has for them.
struct Referring {
    fs::path folder;
    std::set<std::string> names;
};

Error too_many_references(const std::string& path, const std::string& what)
{
    return {ErrorCode::UnsupportedFormat, path, fmt::format("refers to {}; export it as one file", what)};
}

/// Bytes of a file that can be read, or 0: pipes and devices, which could block, and files of /proc have none.
uint64_t readable_bytes(const fs::path& path)
{
    std::error_code failed;
    if (!fs::is_regular_file(path, failed))
        return 0;
    const uint64_t size = fs::file_size(path, failed);
    return failed || ::access(path.c_str(), R_OK) != 0 ? 0 : size;
}

} // namespace

Result<Content> read_content(ByteStream& stream, const std::function<Status(std::string_view)>& sink)
{
    Content content;
    Hash hash;
    for (;;) {
        const Result<std::string_view> chunk = stream.next();
        if (!chunk)
            return chunk.error();
        if (chunk->empty())
            break;
        hash.add(*chunk);
        content.references.add(*chunk);
        content.bytes += chunk->size();
        if (sink)
            if (const Status taken = sink(*chunk); !taken)
                return taken.error();
    }
    content.hash = hash.text();
    return content;
}

Result<std::string> hash_with_references(const Content& content, const std::string& path)
{
    std::error_code failed;
    std::set<fs::path> seen{fs::canonical(path, failed)};
    if (content.references.overflown())
        return too_many_references(path, "too many files to look for");
    std::deque<Referring> queue{{fs::path(path).parent_path(), content.references.names()}};
    Hash hash;
    hash.add(content.hash);
    uint64_t bytes = 0;
    for (; !queue.empty(); queue.pop_front())
        for (const std::string& name : queue.front().names) {
            const fs::path file = queue.front().folder / name;
            const uint64_t size = readable_bytes(file);
            if (size == 0 || !seen.insert(fs::canonical(file, failed)).second)
                continue;
            if (bytes += size; seen.size() > kMaxFiles || bytes > kMaxReferred || bytes < size)
                return too_many_references(path, fmt::format("too many files, or too large ones, as {}", name));
            Result<Descriptor> opened = open_regular_file(file.string());
            if (!opened)
                return opened.error();
            const Result<Content> part = read_content(*file_stream(std::move(*opened), file.string()));
            if (!part)
                return part.error();
            if (part->references.overflown())
                return too_many_references(file.string(), "too many files to look for");
            hash.add(name);
            hash.add({"\0", 1}); // which no name has
            hash.add(part->hash);
            queue.push_back({file.parent_path(), part->references.names()});
        }
    return seen.size() == 1 ? content.hash : hash.text();
}

} // namespace trimray
