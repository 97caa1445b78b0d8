// The converter's input: a CAD file, plain or compressed (gzip, zstd), on its own or in a zip archive, with the hash
// that identifies its content.
#pragma once

#include "format/result.h"
#include "preprocess/source/byte_stream.h"
#include "preprocess/source/zip_archive.h"

#include <cstdint>
#include <string>

namespace trimray {

/// A file ready for the importer. What is compressed or in an archive is copied into a temporary file that has no name,
/// so nothing remains of it however this process ends; `path` is good while this object, or a process forked meanwhile,
/// lives.
class SourceFile {
public:
    /// `path` is a file's, or ARCHIVE!/MEMBER for a member of a zip archive, itself compressed or not; a zip archive
    /// alone stands for the one CAD file in it. A file that is really called so comes before a member.
    /// Fails: FileNotFound, FileNotReadable, Usage (an archive with several CAD files), EmptyCad (or with none),
    /// InvalidCad (damaged compression), UnsupportedFormat (encrypted; too many members), FileNotWritable (no room).
    static Result<SourceFile> open(const std::string& path, const SourceLimits& limits = {});

    std::string path;         // what to read; absolute, as the CAD kernel seeks no files beside a path like a/b.step
    std::string file;         // what was opened: the file of that name, or the archive
    std::string name;         // of the file or member without its folder and, if it is compressed, ".zst" or ".gz"
    uint64_t bytes = 0;       // uncompressed
    std::string hash;         // "xxh3-128:<32 hex digits>" of the uncompressed bytes
    std::string content_hash; // of these and of the files that the importer reads with them (hash_with_references)

private:
    Descriptor copy_; // without a name
};

} // namespace trimray
