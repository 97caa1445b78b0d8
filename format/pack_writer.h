// PackImage -> bytes of a .tray file, and the atomic way onto the disk. The bytes are defined by SPEC.md.
#pragma once

#include "format/pack_image.h"
#include "format/result.h"

#include <cstddef>
#include <string>
#include <vector>

namespace trimray {

struct WriteOptions {
    int zstd_level = 12; // 0: sections are stored plain
};

/// Returns the pack's bytes; the same image and options give the same bytes.
std::vector<std::byte> encode_pack(const PackImage& image, const WriteOptions& options);

/// Whether a file that has been written survives a power cut.
enum class Durability {
    Synced,   // it does: fsync before and after the file gets its name
    Unsynced, // for what lives a second, or is made again at no cost
};

/// Writes bytes to `path` through a temporary file beside it, which then gets its name. Either the whole file appears
/// or nothing does. Sweeps temporaries of dead processes for the same target. Fails: FileNotWritable.
Status write_file_atomically(const std::string& path, const std::vector<std::byte>& bytes,
                             Durability durability = Durability::Synced);

/// Removes the temporaries that dead processes left beside `path`.
void sweep_stale_temporaries(const std::string& path);

} // namespace trimray
