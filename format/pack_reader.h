// Bytes of a .tray file -> PackImage. Everything in a file is hostile until validated; what read_pack returns is safe
// to trace: every index, count, depth and number has been checked, so neither tracer can read out of bounds or loop for
// ever.
#pragma once

#include "format/pack_image.h"
#include "format/result.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace trimray {

/// One fault of a pack. Numbers never change; SPEC.md lists them.
struct Finding {
    int number = 0;
    std::string section; // four-character id, or "header"
    std::string detail;  // expected and found
};

struct SectionInfo {
    std::string id;
    uint64_t stored_bytes = 0, decoded_bytes = 0, count = 0;
    bool critical = true;
};

struct ReadOptions {
    bool previews_and_proxy = true;           // false: skip those sections
    uint64_t max_decoded_bytes = 16ull << 30; // budget for everything decoded
};

struct LoadedPack {
    PackImage image;
    std::vector<SectionInfo> sections;
    uint64_t file_bytes = 0;
    uint64_t content_id = 0;
    int version_major = 0, version_minor = 0;
};

/// Reads and validates a pack; derives what a compact pack leaves out. Reads by pread.
/// Fails: FileNotFound, FileNotReadable, InvalidPack (first finding), UnsupportedPackFeature.
Result<LoadedPack> read_pack(const std::string& path, const ReadOptions& options);
Result<LoadedPack> decode_pack(std::span<const std::byte> bytes, const ReadOptions& options);

/// The pictures that a pack stores of itself, PNG; empty where it has none.
struct StoredPreviews {
    std::vector<std::byte> png_256, png_512;
};

/// Reads nothing else but the table of sections. Fails: as read_pack, of what is read.
Result<StoredPreviews> read_previews(const std::string& path);

/// All findings, for `trimray validate`; empty: the pack is valid.
std::vector<Finding> validate_pack(std::span<const std::byte> bytes);

/// The checks on decoded arrays alone (counts, indices, tree depth, degrees, finite numbers).
std::vector<Finding> validate_image(const PackImage& image);

} // namespace trimray
