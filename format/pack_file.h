// The bytes around a pack's arrays: header, section table, sections in streaming order. Shared by writer, reader and
// validator; SPEC.md says the same in words and tables, and the two change together.
#pragma once

#include "format/pack_image.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace trimray {

static_assert(std::endian::native == std::endian::little, "a pack is little-endian and is read by copying");

inline constexpr std::array<unsigned char, 12> kPackIdentifier = {0xAB, 'T',  'R',  'A',  'Y',  ' ',
                                                                  '1',  0xBB, '\r', '\n', 0x1A, '\n'};
inline constexpr uint16_t kPackVersionMajor = 1;
inline constexpr uint16_t kPackVersionMinor = 0;

enum class PackState : uint32_t { BeingWritten = 0x656E706F, Closed = 0x64736C63 }; // "open", "clsd"

// Feature bits. A reader refuses required bits it does not know and ignores optional ones.
inline constexpr uint64_t kFeatureCompact = 1; // derived sections are absent and rebuilt at load
inline constexpr uint64_t kKnownRequiredFeatures = kFeatureCompact;

struct PackHeader {
    unsigned char identifier[12];
    uint16_t version_major, version_minor;
    uint64_t file_bytes;
    uint64_t decoded_bytes; // of all sections
    uint64_t required_features, optional_features;
    uint64_t content_id;
    uint32_t state; // PackState
    uint32_t section_count;
    uint64_t table_offset;
    uint64_t table_xxh3;
    uint64_t reserved[5];
    uint64_t header_xxh3; // of the 120 bytes before
};
static_assert(sizeof(PackHeader) == 128 && offsetof(PackHeader, header_xxh3) == 120);

inline constexpr uint16_t kCodecPlain = 0;
inline constexpr uint16_t kCodecZstd = 1;
inline constexpr uint16_t kFilterNone = 0;
inline constexpr uint16_t kFilterColumns = 1;
inline constexpr uint16_t kFilterPredicted = 2; // differences from what the words before lead to expect, in columns

struct SectionEntry {
    char id[4];
    uint16_t codec;
    uint16_t filter;
    uint64_t offset;
    uint64_t stored_bytes, decoded_bytes;
    uint64_t count;  // elements
    uint32_t stride; // bytes of an element
    uint32_t reserved;
    uint64_t delta_columns, plane_columns; // of kFilterColumns, one bit a 4-byte column
    uint64_t stored_xxh3, decoded_xxh3;
};
static_assert(sizeof(SectionEntry) == 80);

inline constexpr uint64_t kFrameBytes = 1ull << 20; // largest decoded size of a zstd frame
inline constexpr uint32_t kMaxSections = 256;
inline constexpr uint32_t kMaxStride = 4096;
inline constexpr uint64_t kMaxElements = 0x7fffffffull; // indices are 32 bits, and bit 31 marks leaves
inline constexpr uint32_t kMaxLeavesPerPatch = 4096;

/// Plain sections lie where a mapping or an upload can use them as they are; compressed ones are only read through.
inline constexpr uint64_t kPlainAlignment = 64;
inline constexpr uint64_t kCompressedAlignment = 8;
inline uint64_t section_alignment(const SectionEntry& entry)
{
    return entry.codec == kCodecPlain ? kPlainAlignment : kCompressedAlignment;
}

/// Whole records that fit a frame; every frame of a section but its last holds this many.
inline uint64_t records_per_frame(uint32_t stride)
{
    return kFrameBytes / stride;
}

/// Section FACT: what concerns the whole pack.
struct FactRecord {
    double bounds_lo_mm[3], bounds_hi_mm[3];
    double world_origin_mm[3], world_scale_mm;
    float max_turning_rad, max_aspect;
    uint32_t max_leaves_per_patch;
    uint32_t trim_textures; // kTexturesOfMasks, kTexturesSquare
    uint64_t derived_bytes; // of all derived sections, in memory; counts against the budget when they are rebuilt
    float leaf_slope_deg;
    uint32_t reserved;
};
static_assert(sizeof(FactRecord) == 112);

// FactRecord.trim_textures
inline constexpr uint32_t kTexturesOfMasks = 1; // TrimSource::Mask
inline constexpr uint32_t kTexturesSquare = 2;  // TrimLayout::Square

// Sections that are not plain arrays of records.
inline constexpr std::string_view kSectionFacts = "FACT";
inline constexpr std::string_view kSectionProvenance = "prov";
inline constexpr std::string_view kSectionStrings = "STRS";
inline constexpr std::string_view kSectionPreview256 = "p256";
inline constexpr std::string_view kSectionPreview512 = "p512";
inline constexpr std::string_view kSectionProxy = "prox";

/// Calls f(id, is_derived, array) for every array of records, in the order of the file.
template <class Image, class F>
void for_each_array(Image& image, F&& f)
{
    f("TREE", false, image.tree);
    f("INST", false, image.instances);
    f("PART", false, image.parts);
    f("TOPN", true, image.top_nodes);
    f("FACE", false, image.faces);
    f("drop", false, image.dropped);
    f("PTCH", false, image.patches);
    f("CTRL", false, image.control_points);
    f("NODE", true, image.part_nodes);
    f("LEAF", true, image.leaves);
    f("TPNT", false, image.trim_points);
    f("TPCE", false, image.trim_pieces);
    f("CELL", true, image.cells);
    f("CENT", true, image.cell_entries);
    f("SDFW", true, image.sdf_words);
}

/// Bytes of an element in the file: trim points go as (u, v) pairs, everything else as in memory.
template <class T>
uint32_t section_stride(std::string_view id)
{
    return id == "TPNT" ? 8u : static_cast<uint32_t>(sizeof(T));
}

inline bool is_critical(std::string_view id)
{
    return id[0] >= 'A' && id[0] <= 'Z';
}

/// XXH3, 64 bits, seed 0.
uint64_t xxh3(const void* data, size_t size);

/// The content id: XXH3 over (id, decoded size, decoded XXH3) of each section in the table's order.
uint64_t content_id(const std::vector<SectionEntry>& table);

} // namespace trimray
