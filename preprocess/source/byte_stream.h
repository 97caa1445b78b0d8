// Bytes in order, a chunk at a time: a file's, or what its compression holds.
#pragma once

#include "format/result.h"

#include <memory>
#include <string>
#include <string_view>
#include <unistd.h>
#include <utility>

namespace trimray {

/// An open file, closed with this object. -1: none.
class Descriptor {
public:
    explicit Descriptor(int fd = -1) : fd_(fd) {}
    Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
    Descriptor& operator=(Descriptor other) noexcept
    {
        std::swap(fd_, other.fd_);
        return *this;
    }
    ~Descriptor()
    {
        if (fd_ >= 0)
            ::close(fd_);
    }
    int get() const { return fd_; }

private:
    int fd_;
};

class ByteStream {
public:
    virtual ~ByteStream() = default;
    /// The next bytes, good until the next call; none at the end.
    virtual Result<std::string_view> next() = 0;
};

/// Fails: FileNotFound, FileNotReadable (also what is no regular file).
Result<Descriptor> open_regular_file(const std::string& path);

/// All of a file. Its `next` fails: FileNotReadable.
std::unique_ptr<ByteStream> file_stream(Descriptor file, std::string path);

struct DecodedStream {
    std::unique_ptr<ByteStream> bytes;
    bool was_compressed = false;
};

/// `packed` without its compression if it begins as gzip or zstd, and as it is if not; one level only. `where` names it
/// in errors. Fails: as `packed`; the stream's `next` also: InvalidCad (damaged compression, or cut off).
Result<DecodedStream> decoded(std::unique_ptr<ByteStream> packed, const std::string& where);

} // namespace trimray
