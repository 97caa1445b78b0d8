#include "format/pack_writer.h"

#include "format/pack_file.h"
#include "format/pack_filter.h"
#include "format/pack_predict.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <memory>
#include <optional>

#include <tbb/parallel_for.h>
#include <xxhash.h>
#include <zstd.h>

namespace trimray {

uint64_t xxh3(const void* data, size_t size)
{
    return XXH3_64bits(data, size);
}

uint64_t content_id(const std::vector<SectionEntry>& table)
{
    std::vector<std::byte> summary(20 * table.size());
    for (size_t i = 0; i < table.size(); ++i) {
        std::memcpy(&summary[20 * i], table[i].id, 4);
        std::memcpy(&summary[20 * i + 4], &table[i].decoded_bytes, 8);
        std::memcpy(&summary[20 * i + 12], &table[i].decoded_xxh3, 8);
    }
    return xxh3(summary.data(), summary.size());
}

namespace {

using Bytes = std::vector<std::byte>;
using ByteSpan = std::span<const std::byte>;

struct Section {
    SectionEntry entry{};
    Bytes stored;
};

using Compressor = std::unique_ptr<ZSTD_CCtx, size_t (*)(ZSTD_CCtx*)>;

/// One zstd frame that states its content size.
Bytes compress_frame(ByteSpan content, int level)
{
    // kept: a new one clears its tables, which takes longer than compressing what most sections hold
    thread_local const Compressor context(ZSTD_createCCtx(), ZSTD_freeCCtx);
    Bytes frame(ZSTD_compressBound(content.size()));
    const size_t size =
        ZSTD_compressCCtx(context.get(), frame.data(), frame.size(), content.data(), content.size(), level);
    assert(!ZSTD_isError(size) && "the frame has the room zstd asked for");
    frame.resize(size);
    return frame;
}

/// Small sections take the strongest level: the time cannot be noticed, and in small packs the bytes can.
int level_for(size_t bytes, int level)
{
    constexpr size_t kSmall = 128u << 10;
    return bytes <= kSmall ? std::max(level, 19) : level;
}

constexpr int kTrialLevel = 3; // its ranking is that of higher levels nearly always, at a tenth of the time

/// The smallest of the four forms of each column, judged by a fast compression of the section's first frame; nothing
/// where the records as they are come out smaller.
std::optional<ColumnFilter> choose_filter(ByteSpan decoded, uint32_t stride)
{
    if (stride % 4 != 0 || stride > 4 * kMaxFilterColumns)
        return std::nullopt;
    const size_t n = std::min<size_t>(decoded.size() / stride, records_per_frame(stride));
    const uint32_t column_count = stride / 4;
    std::vector<int> best_form(column_count);
    tbb::parallel_for(uint32_t{0}, column_count, [&](uint32_t c) {
        Bytes words(4 * n), filtered(4 * n);
        for (size_t i = 0; i < n; ++i)
            std::memcpy(&words[4 * i], &decoded[i * stride + 4 * c], 4);
        size_t smallest = SIZE_MAX;
        for (int form = 0; form < 4; ++form) {
            filter_columns(words, 4, {static_cast<uint64_t>(form & 1), static_cast<uint64_t>(form >> 1)}, filtered);
            const size_t size = compress_frame(filtered, kTrialLevel).size();
            if (size < smallest) {
                smallest = size;
                best_form[c] = form;
            }
        }
    });
    ColumnFilter filter;
    for (uint32_t c = 0; c < column_count; ++c) {
        filter.delta_columns |= static_cast<uint64_t>(best_form[c] & 1) << c;
        filter.plane_columns |= static_cast<uint64_t>(best_form[c] >> 1) << c;
    }
    const ByteSpan records = decoded.first(n * stride);
    Bytes columns(records.size());
    filter_columns(records, stride, filter, columns);
    if (compress_frame(records, kTrialLevel).size() <= compress_frame(columns, kTrialLevel).size())
        return std::nullopt;
    return filter;
}

Bytes compress(ByteSpan decoded, const SectionEntry& entry, int level)
{
    const uint64_t frame_bytes = records_per_frame(entry.stride) * entry.stride;
    const size_t frame_count = (decoded.size() + frame_bytes - 1) / frame_bytes;
    std::vector<Bytes> frames(frame_count);
    tbb::parallel_for(size_t{0}, frame_count, [&](size_t i) {
        ByteSpan content = decoded.subspan(i * frame_bytes);
        content = content.first(std::min<size_t>(content.size(), frame_bytes));
        if (entry.filter == kFilterNone) {
            frames[i] = compress_frame(content, level);
            return;
        }
        Bytes columns(content.size());
        filter_columns(content, entry.stride, {entry.delta_columns, entry.plane_columns}, columns);
        frames[i] = compress_frame(columns, level);
    });
    Bytes all;
    for (const Bytes& frame : frames)
        all.insert(all.end(), frame.begin(), frame.end());
    return all;
}

/// The zstd form of the records: as they are, or as differences from their prediction where that is smaller (where much
/// repeats, it is not).
void compress_section(const PackImage& image, ByteSpan decoded, int level, Section& section)
{
    const std::string_view id(section.entry.id, 4);
    const Bytes predicted = has_prediction(id) ? predict_records(id, image, decoded) : Bytes{};
    for (const ByteSpan records : {decoded, ByteSpan(predicted)}) {
        if (records.empty())
            continue;
        SectionEntry entry = section.entry;
        const std::optional<ColumnFilter> filter = choose_filter(records, entry.stride);
        entry.codec = kCodecZstd;
        entry.filter = records.data() == predicted.data() ? kFilterPredicted : filter ? kFilterColumns : kFilterNone;
        entry.delta_columns = filter ? filter->delta_columns : 0;
        entry.plane_columns = filter ? filter->plane_columns : 0;
        Bytes stored = compress(records, entry, level_for(decoded.size(), level));
        if (section.stored.empty() || stored.size() < section.stored.size()) {
            section.entry = entry;
            section.stored = std::move(stored);
        }
    }
}

Section make_section(std::string_view id, uint32_t stride, ByteSpan decoded, int level, const PackImage& image)
{
    Section section;
    SectionEntry& entry = section.entry;
    std::memcpy(entry.id, id.data(), 4);
    entry.decoded_bytes = decoded.size();
    entry.stride = stride;
    entry.count = decoded.size() / stride;
    entry.decoded_xxh3 = xxh3(decoded.data(), decoded.size());
    if (level > 0)
        compress_section(image, decoded, level, section);
    if (level <= 0 || section.stored.size() >= decoded.size()) {
        section.stored.assign(decoded.begin(), decoded.end());
        entry.codec = kCodecPlain;
        entry.filter = kFilterNone;
        entry.delta_columns = entry.plane_columns = 0;
    }
    entry.stored_bytes = section.stored.size();
    entry.stored_xxh3 = xxh3(section.stored.data(), section.stored.size());
    return section;
}

void append_string(Bytes& bytes, std::string_view s)
{
    const auto* first = reinterpret_cast<const std::byte*>(s.data());
    bytes.insert(bytes.end(), first, first + s.size());
    bytes.push_back(std::byte{0});
}

FactRecord facts_of(const PackImage& image)
{
    FactRecord facts{};
    std::copy_n(image.bounds_lo_mm, 3, facts.bounds_lo_mm);
    std::copy_n(image.bounds_hi_mm, 3, facts.bounds_hi_mm);
    std::copy_n(image.world_origin_mm, 3, facts.world_origin_mm);
    facts.world_scale_mm = image.world_scale_mm;
    facts.max_turning_rad = image.leaf_options.max_turning_rad;
    facts.max_aspect = image.leaf_options.max_aspect;
    facts.max_leaves_per_patch = image.leaf_options.max_leaves_per_patch;
    facts.leaf_slope_deg = image.leaf_options.leaf_slope_deg;
    facts.trim_textures = (image.trim_textures.source == TrimSource::Mask ? kTexturesOfMasks : 0) |
                          (image.trim_textures.layout == TrimLayout::Square ? kTexturesSquare : 0);
    for_each_array(image, [&](std::string_view, bool is_derived, const auto& array) {
        if (is_derived)
            facts.derived_bytes += array.size() * sizeof(array[0]);
    });
    return facts;
}

/// The fields that derive_* fill are zero in a compact pack, so that the same model has one compact form.
PackImage without_derived_fields(const PackImage& image)
{
    PackImage bare;
    bare.parts = image.parts;
    bare.faces = image.faces;
    for (PartRecord& part : bare.parts)
        part.first_leaf = part.leaf_count = part.first_node = part.node_count = 0;
    for (FaceRecord& face : bare.faces)
        face.grid = face.first_cell = face.first_entry = face.entry_count = face.sdf_first_word = 0;
    return bare;
}

std::vector<Section> make_sections(const PackImage& image, int level)
{
    std::vector<Section> sections;
    const auto add = [&](std::string_view id, uint32_t stride, ByteSpan decoded) {
        if (!decoded.empty())
            sections.push_back(make_section(id, stride, decoded, level, image));
    };
    const FactRecord facts = facts_of(image);
    add(kSectionFacts, sizeof facts, std::as_bytes(std::span(&facts, 1)));
    Bytes text;
    const Provenance& p = image.provenance;
    for (const std::string* s :
         {&p.source_name, &p.source_format, &p.source_unit, &p.source_hash, &p.tool_version, &p.options_json})
        append_string(text, *s);
    add(kSectionProvenance, 1, text);
    text.clear();
    for (const std::string& s : image.strings.strings)
        append_string(text, s);
    add(kSectionStrings, 1, text);
    add(kSectionPreview256, 1, image.preview_256_png);
    add(kSectionPreview512, 1, image.preview_512_png);
    add(kSectionProxy, 1, image.proxy_draco);

    const PackImage bare = image.compact ? without_derived_fields(image) : PackImage{};
    for_each_array(image, [&](std::string_view id, bool is_derived, const auto& array) {
        using T = typename std::decay_t<decltype(array)>::value_type;
        ByteSpan bytes = std::as_bytes(std::span(array));
        if (image.compact && is_derived)
            return;
        if (image.compact && id == "PART")
            bytes = std::as_bytes(std::span(bare.parts));
        if (image.compact && id == "FACE")
            bytes = std::as_bytes(std::span(bare.faces));
        add(id, section_stride<T>(id), bytes);
    });
    return sections;
}

uint64_t align_up(uint64_t offset, uint64_t alignment)
{
    return (offset + alignment - 1) / alignment * alignment;
}

} // namespace

std::vector<std::byte> encode_pack(const PackImage& image, const WriteOptions& options)
{
    std::vector<Section> sections = make_sections(image, options.zstd_level);
    uint64_t end = sizeof(PackHeader) + sections.size() * sizeof(SectionEntry);
    uint64_t decoded_bytes = 0;
    std::vector<SectionEntry> table;
    for (Section& section : sections) {
        section.entry.offset = align_up(end, section_alignment(section.entry));
        end = section.entry.offset + section.entry.stored_bytes;
        decoded_bytes += section.entry.decoded_bytes;
        table.push_back(section.entry);
    }

    PackHeader header{};
    std::copy(kPackIdentifier.begin(), kPackIdentifier.end(), header.identifier);
    header.version_major = kPackVersionMajor;
    header.version_minor = kPackVersionMinor;
    header.file_bytes = end;
    header.decoded_bytes = decoded_bytes;
    header.required_features = image.compact ? kFeatureCompact : 0;
    header.content_id = content_id(table);
    header.state = static_cast<uint32_t>(PackState::Closed);
    header.section_count = static_cast<uint32_t>(table.size());
    header.table_offset = sizeof(PackHeader);
    header.table_xxh3 = xxh3(table.data(), table.size() * sizeof(SectionEntry));
    header.header_xxh3 = xxh3(&header, offsetof(PackHeader, header_xxh3));

    Bytes file(end); // padding stays zero
    std::memcpy(file.data(), &header, sizeof header);
    std::memcpy(&file[sizeof header], table.data(), table.size() * sizeof(SectionEntry));
    for (const Section& section : sections)
        std::copy(section.stored.begin(), section.stored.end(), file.begin() + section.entry.offset);
    return file;
}

} // namespace trimray
