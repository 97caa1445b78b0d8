// The converter's input: a CAD file, plain or compressed with zstd, with the hash that identifies its content.
#pragma once

#include "format/result.h"

#include <cstdint>
#include <string>

namespace trimray {

/// A file ready for the importer. A compressed one is decompressed into a temporary file that has no name, so nothing
/// remains of it however this process ends; `path` is good while this object, or a process forked meanwhile, lives.
class SourceFile {
public:
    /// Fails: FileNotFound, FileNotReadable, InvalidCad (damaged compression), FileNotWritable (no room for it).
    static Result<SourceFile> open(const std::string& path);

    SourceFile(SourceFile&& other) noexcept;
    SourceFile& operator=(SourceFile&&) = delete;
    SourceFile(const SourceFile&) = delete;
    ~SourceFile();

    std::string path;   // what to read
    std::string name;   // without its folder, and without ".zst"
    uint64_t bytes = 0; // uncompressed
    std::string hash;   // "xxh3:<16 hex digits>" of the uncompressed bytes

private:
    SourceFile() = default;
    int descriptor_ = -1;
};

} // namespace trimray
