#include "preprocess/source/byte_stream.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <vector>
#include <zlib.h>
#include <zstd.h>

namespace trimray {
namespace {

class FileStream : public ByteStream {
public:
    FileStream(Descriptor file, std::string path) : file_(std::move(file)), path_(std::move(path)) {}

    Result<std::string_view> next() override
    {
        ssize_t size = 0;
        do
            size = ::read(file_.get(), chunk_.data(), chunk_.size());
        while (size < 0 && errno == EINTR);
        if (size < 0)
            return Error{ErrorCode::FileNotReadable, path_, fmt::format("could not be read: {}", std::strerror(errno))};
        return std::string_view(chunk_.data(), static_cast<size_t>(size));
    }

private:
    Descriptor file_;
    std::string path_;
    std::vector<char> chunk_ = std::vector<char>(1u << 18);
};

/// Bytes that were read already, then the rest.
class PeekedStream : public ByteStream {
public:
    PeekedStream(std::string head, std::unique_ptr<ByteStream> rest) : head_(std::move(head)), rest_(std::move(rest)) {}

    Result<std::string_view> next() override
    {
        if (!std::exchange(head_is_next_, false))
            return rest_->next();
        return std::string_view(head_);
    }

private:
    std::string head_;
    std::unique_ptr<ByteStream> rest_;
    bool head_is_next_ = true;
};

// The codecs are the formats' own libraries. libarchive, which reads the archives, has filters for both, but its gzip
// filter does not compare the checksum and takes whatever follows for the end: a damaged model would pass.

struct CodecStep {
    size_t used = 0, made = 0;    // bytes
    const char* damage = nullptr; // what is wrong, if anything is
    bool between_frames = false;  // the input may end here
};

struct GzipCodec {
    static constexpr const char* kName = "gzip";
    static constexpr std::string_view kMagic{"\x1f\x8b\x08", 3};
    z_stream stream{};
    bool ended = false;

    GzipCodec() { inflateInit2(&stream, 16 + MAX_WBITS); } // 16: a gzip header, no other; fails only without memory
    ~GzipCodec() { inflateEnd(&stream); }
    GzipCodec(const GzipCodec&) = delete;
    GzipCodec& operator=(const GzipCodec&) = delete;

    CodecStep step(std::string_view in, std::vector<char>& out)
    {
        if (std::exchange(ended, false))
            inflateReset(&stream);                                               // another frame follows
        stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(in.data())); // zlib does not write there
        stream.avail_in = static_cast<uInt>(in.size());
        stream.next_out = reinterpret_cast<Bytef*>(out.data());
        stream.avail_out = static_cast<uInt>(out.size());
        const int code = inflate(&stream, Z_NO_FLUSH);
        ended = code == Z_STREAM_END;
        CodecStep done{in.size() - stream.avail_in, out.size() - stream.avail_out, nullptr, ended};
        if (code != Z_OK && code != Z_STREAM_END && code != Z_BUF_ERROR) // the last: nothing to be done without input
            done.damage = stream.msg != nullptr ? stream.msg : zError(code);
        return done;
    }
};

struct ZstdCodec {
    static constexpr const char* kName = "zstd";
    static constexpr std::string_view kMagic{"\x28\xb5\x2f\xfd", 4};
    std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context{ZSTD_createDCtx(), &ZSTD_freeDCtx};

    CodecStep step(std::string_view in, std::vector<char>& out)
    {
        ZSTD_inBuffer source{in.data(), in.size(), 0};
        ZSTD_outBuffer target{out.data(), out.size(), 0};
        const size_t left = ZSTD_decompressStream(context.get(), &target, &source);
        return {source.pos, target.pos, ZSTD_isError(left) != 0 ? ZSTD_getErrorName(left) : nullptr, left == 0};
    }
};

/// All frames of a compressed stream.
template <class Codec>
class CodecStream : public ByteStream {
public:
    CodecStream(std::unique_ptr<ByteStream> packed, std::string where)
        : packed_(std::move(packed)), where_(std::move(where))
    {
    }

    Result<std::string_view> next() override
    {
        for (;;) {
            if (in_.empty() && !holds_more_) {
                const Result<std::string_view> chunk = packed_->next();
                if (!chunk)
                    return chunk;
                if (chunk->empty() && !between_frames_)
                    return damaged("it ends too early");
                if (chunk->empty())
                    return std::string_view();
                in_ = *chunk;
            }
            const CodecStep done = codec_.step(in_, out_);
            if (done.damage != nullptr)
                return damaged(done.damage);
            in_.remove_prefix(done.used);
            between_frames_ = done.between_frames;
            holds_more_ = done.made == out_.size() && !between_frames_;
            if (done.made > 0)
                return std::string_view(out_.data(), done.made);
        }
    }

private:
    Error damaged(const char* how) const
    {
        return {ErrorCode::InvalidCad, where_,
                fmt::format("its {} compression is damaged: {}; get a complete copy", Codec::kName, how)};
    }

    std::unique_ptr<ByteStream> packed_;
    std::string where_;
    Codec codec_;
    std::string_view in_; // not used yet
    std::vector<char> out_ = std::vector<char>(1u << 18);
    bool holds_more_ = false; // the codec's output did not fit
    bool between_frames_ = false;
};

template <class Codec>
bool begins_as(std::string_view head)
{
    return head.substr(0, Codec::kMagic.size()) == Codec::kMagic;
}

} // namespace

Result<Descriptor> open_regular_file(const std::string& path)
{
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0)
        return Error{errno == ENOENT || errno == ENOTDIR ? ErrorCode::FileNotFound : ErrorCode::FileNotReadable, path,
                     fmt::format("{}; check the path", std::strerror(errno))};
    if (!S_ISREG(status.st_mode))
        return Error{ErrorCode::FileNotReadable, path, "is not a regular file; give the path of a CAD file"};
    Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (file.get() < 0)
        return Error{ErrorCode::FileNotReadable, path, fmt::format("could not be read: {}", std::strerror(errno))};
    return file;
}

std::unique_ptr<ByteStream> file_stream(Descriptor file, std::string path)
{
    return std::make_unique<FileStream>(std::move(file), std::move(path));
}

Result<DecodedStream> decoded(std::unique_ptr<ByteStream> packed, const std::string& where)
{
    std::string head;
    while (head.size() < ZstdCodec::kMagic.size()) {
        const Result<std::string_view> chunk = packed->next();
        if (!chunk)
            return chunk.error();
        if (chunk->empty())
            break;
        head += *chunk;
    }
    const bool gzip = begins_as<GzipCodec>(head), zstd = begins_as<ZstdCodec>(head);
    std::unique_ptr<ByteStream> bytes = std::make_unique<PeekedStream>(std::move(head), std::move(packed));
    if (gzip)
        bytes = std::make_unique<CodecStream<GzipCodec>>(std::move(bytes), where);
    if (zstd)
        bytes = std::make_unique<CodecStream<ZstdCodec>>(std::move(bytes), where);
    return DecodedStream{std::move(bytes), gzip || zstd};
}

} // namespace trimray
