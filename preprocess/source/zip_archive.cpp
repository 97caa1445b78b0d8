#include "preprocess/source/zip_archive.h"

#include "format/cad_names.h"

#include <algorithm>
#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>
#include <locale.h>
#include <set>

namespace trimray {
namespace {

/// While it lives, this thread's names are UTF-8: libarchive turns the names of members into the locale's letters, and
/// this program keeps the C locale, which has few of them.
class Utf8Names {
public:
    explicit Utf8Names(locale_t utf8) : before_(::uselocale(utf8)) {}
    Utf8Names(const Utf8Names&) = delete;
    Utf8Names& operator=(const Utf8Names&) = delete;
    ~Utf8Names() { ::uselocale(before_); }

private:
    locale_t before_;
};

template <auto function>
struct Calls {
    template <class T>
    void operator()(T* object) const
    {
        function(object);
    }
};

constexpr std::string_view kMemberHeader{"PK\x03\x04", 4};
constexpr std::string_view kEndOfDirectory{"PK\x05\x06", 4}; // at the start: of an archive without members

bool begins_with(const Descriptor& file, std::string_view magic)
{
    std::string head(magic.size(), 0);
    return ::pread(file.get(), head.data(), head.size(), 0) == static_cast<ssize_t>(head.size()) && head == magic;
}

/// The members of an archive one after the other, in the order of their bytes.
class ZipReader {
public:
    static Result<ZipReader> open(const std::string& path, const SourceLimits& limits)
    {
        Result<Descriptor> file = open_regular_file(path);
        if (!file)
            return file.error();
        if (!is_zip(*file))
            return Error{ErrorCode::UnsupportedFormat, path, "is no zip archive, so it has no members"};
        ZipReader reader(std::move(*file), path, limits);
        if (!reader.utf8_)
            return Error{ErrorCode::Internal, path, "this system has no locale C.UTF-8"};
        reader.is_empty_ = begins_with(reader.file_, kEndOfDirectory); // libarchive takes that for no archive
        archive_read_support_format_zip_seekable(reader.archive_.get());
        if (!reader.is_empty_ &&
            archive_read_open_fd(reader.archive_.get(), reader.file_.get(), 1u << 18) != ARCHIVE_OK)
            return reader.damaged(path);
        return reader;
    }

    /// The next member, good until the next call; none at the end. Fails: InvalidCad, UnsupportedFormat.
    Result<archive_entry*> next()
    {
        if (is_empty_)
            return nullptr;
        const Utf8Names utf8(utf8_.get());
        archive_entry* entry = nullptr;
        const int code = archive_read_next_header(archive_.get(), &entry);
        if (code == ARCHIVE_EOF)
            return nullptr;
        if (code != ARCHIVE_OK && code != ARCHIVE_WARN) // a warning: of something beside name and content
            return damaged(path_);
        if (++members_ > limits_.members)
            return Error{ErrorCode::UnsupportedFormat, path_,
                         fmt::format("holds more than {} files; unpack the models that are wanted", limits_.members)};
        return entry;
    }

    /// The next bytes of the member that `next` gave last; none at its end.
    Result<std::string_view> next_bytes(const std::string& where)
    {
        const void* data = nullptr;
        size_t size = 0;
        la_int64_t offset = 0;
        int code = ARCHIVE_OK;
        while (size == 0 && code == ARCHIVE_OK)
            code = archive_read_data_block(archive_.get(), &data, &size, &offset);
        if (code == ARCHIVE_EOF)
            return std::string_view();
        if (code != ARCHIVE_OK) // also a warning: that sizes or checksums differ
            return damaged(where);
        if (offset + size > limits_.bytes)
            return too_large(where, limits_);
        return std::string_view(static_cast<const char*>(data), size);
    }

private:
    ZipReader(Descriptor file, std::string path, const SourceLimits& limits)
        : file_(std::move(file)), path_(std::move(path)), limits_(limits)
    {
    }

    Error damaged(const std::string& where) const
    {
        const char* how = archive_error_string(archive_.get());
        return {ErrorCode::InvalidCad, where,
                fmt::format("the zip archive could not be read: {}; get a complete copy, or unpack it first",
                            how != nullptr ? how : "no reason given")};
    }

    Descriptor file_; // closed after the archive that reads it
    std::string path_;
    SourceLimits limits_;
    size_t members_ = 0;
    bool is_empty_ = false;
    std::unique_ptr<archive, Calls<archive_read_free>> archive_{archive_read_new()};
    std::unique_ptr<std::remove_pointer_t<locale_t>, Calls<::freelocale>> utf8_{
        ::newlocale(LC_CTYPE_MASK, "C.UTF-8", nullptr)};
};

class MemberStream : public ByteStream {
public:
    MemberStream(ZipReader reader, std::string where) : reader_(std::move(reader)), where_(std::move(where)) {}
    Result<std::string_view> next() override { return reader_.next_bytes(where_); }

private:
    ZipReader reader_;
    std::string where_;
};

/// Empty where the archive gives none.
std::string path_of(archive_entry* entry)
{
    const char* path = archive_entry_pathname(entry);
    return path != nullptr ? path : "";
}

bool is_listed(archive_entry* entry, const std::string& path)
{
    const bool of_macos = path.starts_with("__MACOSX/") || path.find("/__MACOSX/") != std::string::npos ||
                          without_folder(path).starts_with("._");
    return archive_entry_filetype(entry) == AE_IFREG && !of_macos && is_cad_name(path);
}

int64_t cad_bytes(archive_entry* entry, const std::string& path)
{
    const bool known = archive_entry_size_is_set(entry) != 0 && without_compression(path) == path;
    return known ? archive_entry_size(entry) : -1;
}

} // namespace

Error too_large(const std::string& where, const SourceLimits& limits)
{
    return {ErrorCode::InvalidCad, where,
            fmt::format("decompresses to more than {:.3g} GiB; this is no CAD file", limits.bytes / double(1u << 30))};
}

bool is_zip(const Descriptor& file)
{
    return begins_with(file, kMemberHeader) || begins_with(file, kEndOfDirectory);
}

Result<std::vector<ArchiveMember>> list_members(const std::string& archive, const SourceLimits& limits)
{
    Result<ZipReader> reader = ZipReader::open(archive, limits);
    if (!reader)
        return reader.error();
    const auto by_path = [](const ArchiveMember& a, const ArchiveMember& b) { return a.path < b.path; };
    std::set<ArchiveMember, decltype(by_path)> members(by_path); // the first of a path stays
    for (;;) {
        const Result<archive_entry*> entry = reader->next();
        if (!entry)
            return entry.error();
        if (*entry == nullptr)
            return std::vector<ArchiveMember>(members.begin(), members.end());
        if (const std::string path = path_of(*entry); is_listed(*entry, path))
            members.insert({path, cad_bytes(*entry, path)});
    }
}

Result<std::unique_ptr<ByteStream>> open_member(const std::string& archive, const std::string& member,
                                                const std::string& where, const SourceLimits& limits)
{
    Result<ZipReader> reader = ZipReader::open(archive, limits);
    if (!reader)
        return reader.error();
    for (;;) {
        const Result<archive_entry*> entry = reader->next();
        if (!entry)
            return entry.error();
        if (*entry == nullptr)
            return Error{ErrorCode::FileNotFound, where, "the archive has no such member; check the name"};
        if (path_of(*entry) != member)
            continue;
        if (archive_entry_filetype(*entry) != AE_IFREG)
            return Error{ErrorCode::UnsupportedFormat, where, "is a folder or a link; name a CAD file"};
        if (archive_entry_is_encrypted(*entry) != 0)
            return Error{ErrorCode::UnsupportedFormat, where, "is encrypted; unpack it with its password first"};
        return std::unique_ptr<ByteStream>(std::make_unique<MemberStream>(std::move(*reader), where));
    }
}

} // namespace trimray
