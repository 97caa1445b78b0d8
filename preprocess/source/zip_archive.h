// The CAD files in a zip archive. Nothing is ever extracted under a member's name, so absolute names and ".." are only
// names. The archive's own directory says what it holds (it stands at the end, so a cut archive is noticed).
#pragma once

#include "format/result.h"
#include "preprocess/source/byte_stream.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace trimray {

/// What a hostile file may ask for.
struct SourceLimits {
    uint64_t bytes = 64ull << 30; // decompressed; above any CAD file, and a few kilobytes can ask for more
    size_t members = 1'000'000;   // of an archive, of all kinds
};

/// `where` decompresses to more than limits.bytes.
Error too_large(const std::string& where, const SourceLimits& limits);

struct ArchiveMember {
    std::string path;   // in the archive
    int64_t bytes = -1; // of the CAD file; -1: not known before it is decompressed
};

/// The archive's CAD files by their names (is_cad_name), sorted by path. Left out: folders, links, what macOS keeps
/// beside files (__MACOSX, ._name), and all but the first of several members with one path.
/// Fails: FileNotFound, FileNotReadable, UnsupportedFormat (no zip archive, too many members), InvalidCad (damaged).
Result<std::vector<ArchiveMember>> list_members(const std::string& archive, const SourceLimits& limits = {});

/// Whether the file begins as a zip archive does.
bool is_zip(const Descriptor& file);

/// The member's content, the first of that path. `where` names it in errors. Fails: as list_members, and FileNotFound
/// (no such member), UnsupportedFormat (encrypted, or a folder); the stream's `next`: InvalidCad (damaged, too large).
Result<std::unique_ptr<ByteStream>> open_member(const std::string& archive, const std::string& member,
                                                const std::string& where, const SourceLimits& limits);

} // namespace trimray
