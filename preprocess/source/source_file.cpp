#include "preprocess/source/source_file.h"

#include "format/cad_names.h"
#include "preprocess/source/content_hash.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fmt/format.h>
#include <memory>
#include <system_error>
#include <utility>
#include <vector>

namespace trimray {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMemberMark = "!/";

/// A file, or a member of it.
struct Place {
    std::string file, member;
    std::string text() const { return member.empty() ? file : fmt::format("{}{}{}", file, kMemberMark, member); }
};

/// A file of this very name, or the first "!/" after what is a file; else the name as it is.
Place place_of(const std::string& path)
{
    std::error_code none;
    if (!fs::exists(path, none))
        for (size_t at = 0; (at = path.find(kMemberMark, at)) != std::string::npos; at += kMemberMark.size())
            if (const std::string file = path.substr(0, at); fs::is_regular_file(file, none))
                return {file, path.substr(at + kMemberMark.size())};
    return {path, ""};
}

/// The one CAD file in an archive. Fails: as list_members, Usage, EmptyCad.
Result<Place> only_member(const std::string& archive, const SourceLimits& limits)
{
    const Result<std::vector<ArchiveMember>> members = list_members(archive, limits);
    if (!members)
        return members.error();
    if (members->empty())
        return Error{ErrorCode::EmptyCad, archive, "the archive holds no CAD file (.step, .iges, .brep)"};
    if (members->size() == 1)
        return Place{archive, members->front().path};
    constexpr size_t kNamed = 3;
    std::string names;
    for (size_t i = 0; i < std::min(members->size(), kNamed); ++i)
        names += fmt::format("{}{}", i == 0 ? "" : ", ", Place{archive, (*members)[i].path}.text());
    return Error{ErrorCode::Usage, archive,
                 fmt::format("the archive holds {} CAD files; name one: {}{}", members->size(), names,
                             members->size() > kNamed ? ", ..." : "")};
}

/// The file's or member's bytes as they are stored; `place` becomes the archive's one member if it names none.
Result<std::unique_ptr<ByteStream>> stored_bytes(Place& place, const SourceLimits& limits)
{
    Result<Descriptor> file = open_regular_file(place.file);
    if (!file)
        return file.error();
    if (place.member.empty() && !is_zip(*file))
        return file_stream(std::move(*file), place.file);
    if (place.member.empty()) {
        const Result<Place> only = only_member(place.file, limits);
        if (!only)
            return only.error();
        place = *only;
    }
    return open_member(place.file, place.member, place.text(), limits);
}

/// A file in the temporary folder that is unlinked at once.
Result<Descriptor> nameless_file()
{
    std::error_code error;
    const fs::path folder = fs::temp_directory_path(error);
    if (error)
        return Error{ErrorCode::FileNotWritable, "temporary folder",
                     fmt::format("{}; set TMPDIR to a folder that exists", error.message())};
    std::string name = (folder / "trimray-source-XXXXXX").string();
    Descriptor file(::mkostemp(name.data(), O_CLOEXEC));
    if (file.get() < 0)
        return Error{ErrorCode::FileNotWritable, folder.string(),
                     fmt::format("no temporary file: {}; set TMPDIR to a folder with room", std::strerror(errno))};
    ::unlink(name.c_str());
    return file;
}

Status write_all(const Descriptor& file, std::string_view bytes)
{
    while (!bytes.empty()) {
        const ssize_t written = ::write(file.get(), bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR)
            continue;
        if (written <= 0)
            return Error{ErrorCode::FileNotWritable, "temporary file",
                         fmt::format("{}; set TMPDIR to a folder with room", std::strerror(errno))};
        bytes.remove_prefix(static_cast<size_t>(written));
    }
    return Done{};
}

/// Reads `stream` into `file`.
Result<Content> copy_content(ByteStream& stream, const Descriptor& file, const std::string& where,
                             const SourceLimits& limits)
{
    uint64_t total = 0;
    return read_content(stream, [&](std::string_view chunk) -> Status {
        total += chunk.size();
        if (total > limits.bytes)
            return too_large(where, limits);
        return write_all(file, chunk);
    });
}

} // namespace

Result<SourceFile> SourceFile::open(const std::string& path, const SourceLimits& limits)
{
    Place place = place_of(path);
    Result<std::unique_ptr<ByteStream>> stored = stored_bytes(place, limits);
    if (!stored)
        return stored.error();
    Result<DecodedStream> stream = decoded(std::move(*stored), place.text());
    if (!stream)
        return stream.error();

    SourceFile source;
    source.file = place.file;
    source.name = without_folder(place.member.empty() ? place.file : place.member);
    if (stream->was_compressed)
        source.name = without_compression(source.name);
    const bool is_copied = stream->was_compressed || !place.member.empty();
    Result<Content> content = Content{};
    if (is_copied) {
        Result<Descriptor> copy = nameless_file();
        if (!copy)
            return copy.error();
        content = copy_content(*stream->bytes, *copy, place.text(), limits);
        source.path = fmt::format("/proc/self/fd/{}", copy->get());
        source.copy_ = std::move(*copy);
    } else {
        content = read_content(*stream->bytes);
        std::error_code none; // the file was opened by this path, so there is a current folder
        source.path = fs::absolute(place.file, none).string();
    }
    if (!content)
        return content.error();
    source.bytes = content->bytes;
    source.hash = source.content_hash = content->hash;
    if (is_copied) // the importer finds no other files beside a temporary one
        return source;
    Result<std::string> with_others = hash_with_references(*content, place.file);
    if (!with_others)
        return with_others.error();
    source.content_hash = std::move(*with_others);
    return source;
}

} // namespace trimray
