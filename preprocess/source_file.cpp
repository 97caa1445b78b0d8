#include "preprocess/source_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fmt/format.h>
#include <memory>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>
#include <vector>
#include <xxhash.h>
#include <zstd.h>

namespace trimray {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMaxDecompressed = 64ull << 30; // above any CAD file; a few kilobytes of zstd can ask for more

struct Descriptor {
    int fd = -1;
    ~Descriptor()
    {
        if (fd >= 0)
            ::close(fd);
    }
    int release() { return std::exchange(fd, -1); }
};

struct Hash {
    std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state{XXH3_createState(), &XXH3_freeState};
    Hash() { XXH3_64bits_reset(state.get()); }
    void add(const void* data, size_t size) { XXH3_64bits_update(state.get(), data, size); }
    std::string text() const { return fmt::format("xxh3:{:016x}", XXH3_64bits_digest(state.get())); }
};

/// Bytes read, 0 at the end, negative on failure.
ssize_t read_chunk(int fd, std::vector<char>& chunk)
{
    ssize_t size = 0;
    do
        size = ::read(fd, chunk.data(), chunk.size());
    while (size < 0 && errno == EINTR);
    return size;
}

Error unreadable(const std::string& path)
{
    return {ErrorCode::FileNotReadable, path, fmt::format("could not be read: {}", std::strerror(errno))};
}

/// A file in the temporary folder that is unlinked at once.
Result<int> nameless_file()
{
    std::error_code error;
    const fs::path folder = fs::temp_directory_path(error);
    if (error)
        return Error{ErrorCode::FileNotWritable, "temporary folder",
                     fmt::format("{}; set TMPDIR to a folder that exists", error.message())};
    std::string name = (folder / "trimray-source-XXXXXX").string();
    const int fd = ::mkostemp(name.data(), O_CLOEXEC);
    if (fd < 0)
        return Error{ErrorCode::FileNotWritable, folder.string(),
                     fmt::format("no temporary file: {}; set TMPDIR to a folder with room", std::strerror(errno))};
    ::unlink(name.c_str());
    return fd;
}

Status write_all(int fd, const char* data, size_t size)
{
    while (size > 0) {
        const ssize_t written = ::write(fd, data, size);
        if (written < 0 && errno == EINTR)
            continue;
        if (written <= 0)
            return Error{ErrorCode::FileNotWritable, "temporary file",
                         fmt::format("{}; set TMPDIR to a folder with room", std::strerror(errno))};
        data += written;
        size -= static_cast<size_t>(written);
    }
    return Done{};
}

/// Decompresses all frames of `in` into `out`; returns the number of bytes.
Result<uint64_t> decompress(const std::string& path, int in, int out, Hash& hash)
{
    const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context{ZSTD_createDCtx(), &ZSTD_freeDCtx};
    std::vector<char> input(ZSTD_DStreamInSize()), output(ZSTD_DStreamOutSize());
    uint64_t total = 0;
    size_t open_frame = 0; // 0: between frames
    for (;;) {
        const ssize_t got = read_chunk(in, input);
        if (got < 0)
            return unreadable(path);
        if (got == 0)
            break;
        ZSTD_inBuffer source{input.data(), static_cast<size_t>(got), 0};
        while (source.pos < source.size) {
            ZSTD_outBuffer target{output.data(), output.size(), 0};
            open_frame = ZSTD_decompressStream(context.get(), &target, &source);
            if (ZSTD_isError(open_frame))
                return Error{ErrorCode::InvalidCad, path,
                             fmt::format("its zstd compression is damaged: {}; get a complete copy",
                                         ZSTD_getErrorName(open_frame))};
            total += target.pos;
            if (total > kMaxDecompressed)
                return Error{ErrorCode::InvalidCad, path, "decompresses to more than 64 GiB; this is no CAD file"};
            hash.add(output.data(), target.pos);
            if (const Status written = write_all(out, output.data(), target.pos); !written)
                return written.error();
        }
    }
    if (open_frame != 0)
        return Error{ErrorCode::InvalidCad, path, "its zstd compression ends too early; get a complete copy"};
    return total;
}

} // namespace

Result<SourceFile> SourceFile::open(const std::string& path)
{
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0)
        return Error{errno == ENOENT || errno == ENOTDIR ? ErrorCode::FileNotFound : ErrorCode::FileNotReadable, path,
                     fmt::format("{}; check the path", std::strerror(errno))};
    if (!S_ISREG(status.st_mode))
        return Error{ErrorCode::FileNotReadable, path, "is not a regular file; give the path of a CAD file"};
    Descriptor in{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
    if (in.fd < 0)
        return unreadable(path);

    SourceFile source;
    source.path = path;
    source.name = fs::path(path).filename().string();
    Hash hash;
    constexpr unsigned char kZstdMagic[4] = {0x28, 0xb5, 0x2f, 0xfd};
    unsigned char magic[4] = {};
    if (::pread(in.fd, magic, sizeof magic, 0) == sizeof magic && std::equal(magic, magic + 4, kZstdMagic)) {
        const Result<int> temporary = nameless_file();
        if (!temporary)
            return temporary.error();
        Descriptor out{*temporary};
        const Result<uint64_t> bytes = decompress(path, in.fd, out.fd, hash);
        if (!bytes)
            return bytes.error();
        source.bytes = *bytes;
        source.descriptor_ = out.release();
        source.path = fmt::format("/proc/self/fd/{}", source.descriptor_);
        if (source.name.ends_with(".zst"))
            source.name.resize(source.name.size() - 4);
    } else {
        std::vector<char> chunk(1u << 20);
        ssize_t size = 0;
        while ((size = read_chunk(in.fd, chunk)) > 0) {
            hash.add(chunk.data(), static_cast<size_t>(size));
            source.bytes += static_cast<uint64_t>(size);
        }
        if (size < 0)
            return unreadable(path);
    }
    source.hash = hash.text();
    return source;
}

SourceFile::SourceFile(SourceFile&& other) noexcept
    : path(std::move(other.path)), name(std::move(other.name)), bytes(other.bytes), hash(std::move(other.hash)),
      descriptor_(std::exchange(other.descriptor_, -1))
{
}

SourceFile::~SourceFile()
{
    if (descriptor_ >= 0)
        ::close(descriptor_);
}

} // namespace trimray
