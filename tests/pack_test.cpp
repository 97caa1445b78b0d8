#include "format/derive.h"
#include "format/pack_file.h"
#include "format/pack_filter.h"
#include "format/pack_reader.h"
#include "format/pack_writer.h"
#include "format/trim_texture.h"
#include "synthetic_pack.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trimray {
namespace {

using Bytes = std::vector<std::byte>;

Bytes small_pack()
{
    return encode_pack(synthetic_image(), WriteOptions{});
}

PackHeader header_of(const Bytes& pack)
{
    PackHeader header;
    std::memcpy(&header, pack.data(), sizeof header);
    return header;
}

std::vector<SectionEntry> table_of(const Bytes& pack)
{
    std::vector<SectionEntry> table(header_of(pack).section_count);
    std::memcpy(table.data(), &pack[sizeof(PackHeader)], table.size() * sizeof(SectionEntry));
    return table;
}

/// Puts an edited header and table back with right checksums: what an attacker would do.
Bytes reseal(Bytes pack, PackHeader header, const std::vector<SectionEntry>& table)
{
    header.content_id = content_id(table);
    header.table_xxh3 = xxh3(table.data(), table.size() * sizeof(SectionEntry));
    header.header_xxh3 = xxh3(&header, offsetof(PackHeader, header_xxh3));
    std::memcpy(pack.data(), &header, sizeof header);
    std::memcpy(&pack[sizeof header], table.data(), table.size() * sizeof(SectionEntry));
    return pack;
}

int first_finding(const Bytes& pack)
{
    const std::vector<Finding> findings = validate_pack(pack);
    return findings.empty() ? 0 : findings.front().number;
}

template <class T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b)
{
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

void expect_same_image(const PackImage& a, const PackImage& b)
{
    for_each_array(a, [&](std::string_view id, bool, const auto& array) {
        for_each_array(b, [&](std::string_view other_id, bool, const auto& other) {
            if constexpr (std::is_same_v<decltype(array), decltype(other)>) {
                if (id == other_id) {
                    EXPECT_TRUE(same_bytes(array, other)) << id;
                }
            }
        });
    });
    EXPECT_EQ(a.strings.strings, b.strings.strings);
    EXPECT_EQ(a.provenance.source_name, b.provenance.source_name);
    EXPECT_EQ(a.provenance.options_json, b.provenance.options_json);
    EXPECT_EQ(a.preview_256_png, b.preview_256_png);
    EXPECT_EQ(a.preview_512_png, b.preview_512_png);
    EXPECT_EQ(a.proxy_draco, b.proxy_draco);
    EXPECT_EQ(a.world_scale_mm, b.world_scale_mm);
    EXPECT_EQ(a.bounds_hi_mm[2], b.bounds_hi_mm[2]);
    EXPECT_EQ(a.leaf_options.max_leaves_per_patch, b.leaf_options.max_leaves_per_patch);
    EXPECT_EQ(a.leaf_options.leaf_slope_deg, b.leaf_options.leaf_slope_deg);
}

TEST(pack, reads_back_what_was_written)
{
    for (const int level : {0, 3, 12}) {
        const PackImage image = synthetic_image();
        const Bytes pack = encode_pack(image, WriteOptions{level});
        const Result<LoadedPack> loaded = decode_pack(pack, ReadOptions{});
        ASSERT_TRUE(loaded.ok()) << loaded.error().where << ": " << loaded.error().detail;
        expect_same_image(image, loaded->image);
        EXPECT_EQ(loaded->file_bytes, pack.size());
    }
}

TEST(pack, content_id_does_not_depend_on_compression)
{
    EXPECT_EQ(header_of(encode_pack(synthetic_image(), WriteOptions{0})).content_id,
              header_of(encode_pack(synthetic_image(), WriteOptions{12})).content_id);
}

TEST(pack, same_image_gives_same_bytes)
{
    EXPECT_EQ(small_pack(), small_pack());
}

/// The synthetic image with leaves, trees, cells and textures made by the functions that a compact pack relies on.
PackImage derived_image()
{
    PackImage image = synthetic_image();
    derive_leaves(image, LeafOptions(image.leaf_options));
    derive_trees(image);
    derive_cells(image);
    derive_sdf(image);
    return image;
}

TEST(pack, a_compact_pack_makes_the_same_textures_of_every_kind)
{
    for (const TrimSource source : {TrimSource::Curve, TrimSource::Mask})
        for (const TrimLayout layout : {TrimLayout::Isotropic, TrimLayout::Square})
            for (const double bytes : {100.0, 20000.0}) {
                PackImage image = derived_image();
                allocate_trim_memory(image, bytes, {source, layout});
                derive_sdf(image);
                image.compact = true;
                Result<LoadedPack> loaded = decode_pack(encode_pack(image, WriteOptions{}), ReadOptions{});
                ASSERT_TRUE(loaded.ok()) << loaded.error().where << ": " << loaded.error().detail;
                expect_same_image(loaded->image, image);
            }
}

TEST(pack, texture_options_that_nobody_knows_are_refused)
{
    Bytes pack = encode_pack(synthetic_image(), WriteOptions{0}); // sections as they are
    std::vector<SectionEntry> table = table_of(pack);
    SectionEntry& facts = table.front();
    ASSERT_EQ(std::memcmp(facts.id, "FACT", 4), 0);
    ASSERT_EQ(facts.codec, 0);
    FactRecord record;
    std::memcpy(&record, &pack[facts.offset], sizeof record);
    record.trim_textures = 4;
    std::memcpy(&pack[facts.offset], &record, sizeof record);
    facts.stored_xxh3 = facts.decoded_xxh3 = xxh3(&record, sizeof record);
    EXPECT_EQ(first_finding(reseal(pack, header_of(pack), table)), 3237);
}

TEST(pack, a_compact_pack_becomes_the_full_one_at_load)
{
    PackImage image = derived_image();
    const Bytes full = encode_pack(image, WriteOptions{});
    image.compact = true;
    const Bytes compact = encode_pack(image, WriteOptions{});
    EXPECT_LT(compact.size(), full.size());
    Result<LoadedPack> loaded = decode_pack(compact, ReadOptions{});
    ASSERT_TRUE(loaded.ok()) << loaded.error().where << ": " << loaded.error().detail;
    image.compact = loaded->image.compact = false;
    expect_same_image(loaded->image, image);
    EXPECT_EQ(encode_pack(loaded->image, WriteOptions{}), full);
}

TEST(pack, what_a_compact_pack_would_unfold_to_counts_against_the_budget)
{
    PackImage image = derived_image();
    image.compact = true;
    const Bytes pack = encode_pack(image, WriteOptions{});
    ReadOptions options;
    options.max_decoded_bytes = header_of(pack).decoded_bytes;
    const Result<LoadedPack> loaded = decode_pack(pack, options);
    ASSERT_FALSE(loaded.ok());
    EXPECT_THAT(loaded.error().where, testing::HasSubstr("3123"));
}

TEST(pack, equal_strings_share_an_index)
{
    StringTable table;
    const uint a = table.add("a"), b = table.add("b");
    table.strings.push_back("c");
    EXPECT_EQ(table.add(""), 0u);
    EXPECT_EQ(table.add("a"), a);
    EXPECT_EQ(table.add("b"), b);
    EXPECT_EQ(table.add("c"), 3u);
    EXPECT_EQ(table.add("d"), 4u);
}

TEST(pack, every_truncation_is_refused)
{
    const Bytes pack = small_pack();
    for (size_t size = 0; size < pack.size(); ++size)
        ASSERT_NE(first_finding(Bytes(pack.begin(), pack.begin() + static_cast<ptrdiff_t>(size))), 0) << size;
}

TEST(pack, every_bit_flip_is_refused)
{
    Bytes pack = small_pack();
    for (size_t bit = 0; bit < 8 * pack.size(); ++bit) {
        pack[bit / 8] ^= static_cast<std::byte>(1 << bit % 8);
        ASSERT_NE(first_finding(pack), 0) << "byte " << bit / 8 << " bit " << bit % 8;
        ASSERT_FALSE(decode_pack(pack, ReadOptions{}).ok());
        pack[bit / 8] ^= static_cast<std::byte>(1 << bit % 8);
    }
}

TEST(pack, transfer_damage_is_told_apart_from_another_file)
{
    Bytes pack = small_pack();
    pack.erase(pack.begin() + 8); // CR LF became LF
    EXPECT_EQ(first_finding(pack), 3102);
    EXPECT_EQ(first_finding(Bytes(200, std::byte{'x'})), 3103);
}

/// Adds a section at the end, with all checksums right.
Bytes with_extra_section(const char* id, uint16_t codec = kCodecPlain)
{
    const PackImage image = synthetic_image();
    Bytes pack = encode_pack(image, WriteOptions{0});
    PackHeader header = header_of(pack);
    std::vector<SectionEntry> table = table_of(pack);
    const Bytes content(64, std::byte{7});
    // one more entry moves everything behind the table by whole units of the alignment
    const uint64_t old_end = sizeof header + table.size() * sizeof(SectionEntry);
    const uint64_t first = table.front().offset;
    const uint64_t moved = (old_end + sizeof(SectionEntry) + 63) / 64 * 64 - first;
    pack.insert(pack.begin() + static_cast<ptrdiff_t>(old_end), moved, std::byte{0});
    for (SectionEntry& e : table)
        e.offset += moved;
    SectionEntry extra{};
    std::memcpy(extra.id, id, 4);
    extra.codec = codec;
    const uint64_t alignment = section_alignment(extra);
    pack.resize((pack.size() + alignment - 1) / alignment * alignment);
    extra.offset = pack.size();
    extra.stored_bytes = extra.decoded_bytes = extra.count = content.size();
    extra.stride = 1;
    extra.stored_xxh3 = extra.decoded_xxh3 = xxh3(content.data(), content.size());
    table.push_back(extra);
    pack.insert(pack.end(), content.begin(), content.end());
    header.section_count += 1;
    header.decoded_bytes += content.size();
    header.file_bytes = pack.size();
    return reseal(std::move(pack), header, table);
}

TEST(pack, unknown_ancillary_sections_are_skipped)
{
    for (const uint16_t codec : {kCodecPlain, uint16_t{9}}) {
        const Result<LoadedPack> loaded = decode_pack(with_extra_section("zzzz", codec), ReadOptions{});
        ASSERT_TRUE(loaded.ok()) << loaded.error().where << ": " << loaded.error().detail;
        expect_same_image(loaded->image, synthetic_image());
    }
}

TEST(pack, unknown_critical_sections_are_refused_by_name)
{
    const Result<LoadedPack> loaded = decode_pack(with_extra_section("ZZZZ"), ReadOptions{});
    ASSERT_FALSE(loaded.ok());
    EXPECT_EQ(loaded.error().code, ErrorCode::UnsupportedPackFeature);
    EXPECT_THAT(loaded.error().where, testing::HasSubstr("3121"));
    EXPECT_THAT(loaded.error().where, testing::HasSubstr("ZZZZ"));
}

TEST(pack, unknown_required_features_and_versions_are_refused_and_optional_ones_ignored)
{
    const Bytes pack = small_pack();
    PackHeader header = header_of(pack);
    header.optional_features = 1ull << 40;
    header.version_minor = 9;
    EXPECT_TRUE(decode_pack(reseal(pack, header, table_of(pack)), ReadOptions{}).ok());
    header.required_features = 1ull << 40;
    EXPECT_EQ(first_finding(reseal(pack, header, table_of(pack))), 3122);
    header = header_of(pack);
    header.version_major = 2;
    EXPECT_EQ(first_finding(reseal(pack, header, table_of(pack))), 3105);
    header = header_of(pack);
    header.state = static_cast<uint32_t>(PackState::BeingWritten);
    EXPECT_EQ(first_finding(reseal(pack, header, table_of(pack))), 3106);
}

TEST(pack, hostile_tables_are_refused_before_anything_is_allocated)
{
    const Bytes pack = small_pack();
    using Edit = std::function<void(SectionEntry&)>;
    const std::pair<int, Edit> edits[] = {
        {3113, [](SectionEntry& e) { e.offset = UINT64_MAX - 63; }},
        {3113, [](SectionEntry& e) { e.offset += 64; }},
        {3113, [](SectionEntry& e) { e.stored_bytes = UINT64_MAX; }},
        {3115, [](SectionEntry& e) { e.decoded_bytes = 1ull << 62; }},
        {3115, [](SectionEntry& e) { e.count = (1ull << 62) / e.stride, e.decoded_bytes = e.count * e.stride; }},
        {3116, [](SectionEntry& e) { e.stride = 0; }},
        {3116, [](SectionEntry& e) { e.stride *= 2, e.count /= 2; }},
        {3111, [](SectionEntry& e) { e.id[1] = ' '; }},
        {3112, [](SectionEntry& e) { std::memcpy(e.id, "FACT", 4), e.stride = sizeof(FactRecord); }},
        {3125, [](SectionEntry& e) { e.codec = 7; }},
        {3126, [](SectionEntry& e) { e.delta_columns = ~0ull; }},
        {3108, [](SectionEntry& e) { e.reserved = 1; }},
        {3118, [](SectionEntry& e) { e.decoded_xxh3 ^= 1; }},
    };
    for (const auto& [number, edit] : edits) {
        std::vector<SectionEntry> table = table_of(pack);
        const auto instances = std::find_if(table.begin(), table.end(),
                                            [](const SectionEntry& e) { return std::memcmp(e.id, "INST", 4) == 0; });
        edit(*instances);
        EXPECT_EQ(first_finding(reseal(pack, header_of(pack), table)), number);
    }
}

TEST(pack, a_zip_bomb_meets_the_budget_before_it_is_unpacked)
{
    PackImage image = synthetic_image();
    image.proxy_draco.assign(1 << 26, std::byte{0});
    const Bytes pack = encode_pack(image, WriteOptions{});
    EXPECT_LT(pack.size(), 1u << 16);
    ReadOptions options;
    options.max_decoded_bytes = 1 << 20;
    const Result<LoadedPack> loaded = decode_pack(pack, options);
    ASSERT_FALSE(loaded.ok());
    EXPECT_THAT(loaded.error().where, testing::HasSubstr("3123"));
    options.previews_and_proxy = false; // what is not asked for costs nothing
    EXPECT_TRUE(decode_pack(pack, options).ok());
}

TEST(pack, frames_that_lie_about_their_size_are_refused)
{
    PackImage image = synthetic_image();
    image.proxy_draco.assign(3 << 20, std::byte{1});
    Bytes pack = encode_pack(image, WriteOptions{});
    std::vector<SectionEntry> table = table_of(pack);
    const auto proxy = std::find_if(table.begin(), table.end(),
                                    [](const SectionEntry& e) { return std::memcmp(e.id, "prox", 4) == 0; });
    ASSERT_EQ(proxy->codec, kCodecZstd);
    const uint64_t less = 1 << 20; // the third frame is one too many then
    proxy->decoded_bytes -= less, proxy->count -= less;
    PackHeader header = header_of(pack);
    header.decoded_bytes -= less;
    EXPECT_EQ(first_finding(reseal(pack, header, table)), 3128);
}

struct HostileEdit {
    int number;
    const char* what;
    std::function<void(PackImage&)> edit;
};

std::vector<HostileEdit> hostile_edits()
{
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    constexpr double kInf = std::numeric_limits<double>::infinity();
    using M = PackImage;
    return {
        {3202, "control point", [](M& m) { m.control_points[5] = kNan; }},
        {3202, "bounds", [](M& m) { m.bounds_hi_mm[1] = kInf; }},
        {3202, "axis", [](M& m) { m.patches[0].axis_x[1] = kNan; }},
        {3202, "face area", [](M& m) { m.faces[0].area_mm2 = kNan; }},
        {3202, "transform", [](M& m) { m.instances[0].transform[7] = kInf; }},
        {3203, "bounds order", [](M& m) { m.bounds_lo_mm[0] = 1000; }},
        {3204, "part scale", [](M& m) { m.parts[0].scale_mm = 0; }},
        {3204, "patch scale", [](M& m) { m.patches[1].scale = -1; }},
        {3205, "leaf options", [](M& m) { m.leaf_options.max_leaves_per_patch = 1u << 30; }},
        {3205, "leaf slope", [](M& m) { m.leaf_options.leaf_slope_deg = 0; }},
        {3206, "text", [](M& m) { m.strings.strings[1] = "\xC0\xAF"; }},
        {3206, "surrogate", [](M& m) { m.provenance.source_name = "\xED\xA0\x80"; }},
        {3207, "string index", [](M& m) { m.faces[2].name = 999; }},
        {3208, "tree parent", [](M& m) { m.tree[1].parent = 1; }},
        {3209, "instance part", [](M& m) { m.instances[1].part = 2; }},
        {3209, "leaf patch", [](M& m) { m.leaves[0].patch = 3; }},
        {3209, "patch face", [](M& m) { m.patches[0].face = 1; }},
        {3210, "singular", [](M& m) { m.instances[1].transform[0] = 0; }},
        {3211, "a rim along u alone", [](M& m) { m.faces[1].flags |= 3u << kFaceRimBit; }},
        {3211, "face kind", [](M& m) { m.faces[1].surface_kind = 6; }},
        {3212, "part ranges", [](M& m) { m.parts[1].first_face = 2; }},
        {3212, "face patches", [](M& m) { m.faces[1].patch_count = 2; }},
        {3213, "domain", [](M& m) { m.faces[1].domain_hi[0] = 0; }},
        {3214, "axes", [](M& m) { m.patches[0].axis_x[0] = 2; }},
        {3215, "kind", [](M& m) { m.patches[0].shape = 17; }},
        {3216, "radius", [](M& m) { m.patches[1].param[0] = 0; }},
        {3217, "degree", [](M& m) { m.patches[2].shape = kKindBezier | 26u << 8 | 1u << 16; }},
        {3218, "control net", [](M& m) { m.patches[2].first_control_point = 0xfffffff0u; }},
        {3219, "weight", [](M& m) { m.control_points[7] = 0; }},
        {3220, "trim point", [](M& m) { m.trim_points[2] = 1.5f; }},
        {3220, "trim control point", [](M& m) { m.trim_points[4] = kNan; }},
        {3221, "piece", [](M& m) { m.trim_pieces[0] = 5u << kPiecePointShift; }},
        {3221, "point range", [](M& m) { m.faces[2].point_count = 0xffffffffu; }},
        {3221, "entry word", [](M& m) { m.cell_entries[0].word = 3u << kPiecePointShift | kPieceCubic; }},
        {3222, "grid", [](M& m) { m.faces[2].grid = 0xffffffffu; }},
        {3222, "entries", [](M& m) { m.faces[2].entry_count = 3; }},
        {3223, "no end", [](M& m) { m.cell_entries[1].word &= ~kEntryLast; }},
        {3224, "cell", [](M& m) { m.cells[1] = kCellMixedCornerIn | 2u << 2; }},
        {3225, "texture", [](M& m) { m.faces[2].sdf_size = 5u | 4u << 16; }},
        {3225, "tile",
         [](M& m) { // one tile, number 2 where there is one
             m.faces[2].flags |= 1u << kFaceTileShiftBit;
             m.faces[2].sdf_size = 3u | 3u << 16;
             m.sdf_words[m.faces[2].sdf_first_word] = 3;
         }},
        {3238, "texture side", [](M& m) { m.faces[2].sdf_size = 5u; }},
        {3238, "tile shift", [](M& m) { m.faces[2].flags |= 5u << kFaceTileShiftBit; }},
        {3226, "leaf rectangle", [](M& m) { m.leaves[1].uv_hi = 32769u | 1u << 16; }},
        {3227, "quaternion", [](M& m) { m.leaves[1].quat_xy = 0x7fff7fffu; }},
        {3230, "unreached node", [](M& m) { m.top_nodes.push_back(m.top_nodes[0]); }},
        {3239, "a native surface bends", [](M& m) { m.leaves[0].quat_z_bend |= 1u << 24; }},
        {3232, "child count", [](M& m) { m.top_nodes[0].child[3] = kBvhLeaf; }},
        {3233, "leaf twice", [](M& m) { m.part_nodes[0].child[1] = kBvhLeaf | 0u; }},
        {3233, "leaf outside", [](M& m) { m.part_nodes[1].child[0] = kBvhLeaf | 1u; }},
        {3234, "cycle", [](M& m) { m.part_nodes[0].child[1] = 0; }},
        {3235, "lost leaf", [](M& m) { m.part_nodes[0].child[2] = kBvhEmpty, m.part_nodes[0].exponents -= 1u << 24; }},
        {3236, "exponent", [](M& m) { m.part_nodes[0].exponents |= 0xffu; }},
        {3211, "node padding", [](M& m) { m.part_nodes[0].reserved[1] = 1; }},
    };
}

TEST(pack, hostile_arrays_with_right_checksums_are_refused)
{
    for (const HostileEdit& hostile : hostile_edits()) {
        PackImage image = synthetic_image();
        hostile.edit(image);
        const Bytes pack = encode_pack(image, WriteOptions{0});
        std::vector<int> numbers;
        for (const Finding& f : validate_pack(pack))
            numbers.push_back(f.number);
        EXPECT_THAT(numbers, testing::Contains(hostile.number)) << hostile.what;
        EXPECT_FALSE(decode_pack(pack, ReadOptions{}).ok()) << hostile.what;
    }
}

TEST(pack, trees_deeper_than_the_limit_are_refused)
{
    for (const uint depth : {kMaxBvhDepth, kMaxBvhDepth + 1}) {
        PackImage image = synthetic_image();
        image.top_nodes.clear();
        for (uint n = 0; n < depth; ++n) {
            BvhNode node = synthetic_node(n + 1 < depth ? 1 : 3);
            if (n + 1 < depth)
                node.child[0] = n + 1;
            image.top_nodes.push_back(node);
        }
        EXPECT_EQ(validate_image(image).empty(), depth == kMaxBvhDepth);
    }
}

/// Follows every index as a tracer does, with bounds checked. Returns a sum, so that nothing is optimised away.
uint64_t walk(const PackImage& m)
{
    uint64_t sum = 0;
    const auto walk_tree = [&](size_t first, const std::vector<BvhNode>& nodes, auto&& visit_leaf) {
        std::vector<uint> stack{0};
        while (!stack.empty()) {
            const BvhNode& node = nodes.at(first + stack.back());
            stack.pop_back();
            for (const uint child : node.child) {
                if (child == kBvhEmpty)
                    continue;
                if ((child & kBvhLeaf) != 0)
                    visit_leaf(child & ~kBvhLeaf);
                else
                    stack.push_back(child);
            }
        }
    };
    const auto visit_face = [&](const FaceRecord& f) {
        for (uint c = 0; f.grid != 0 && c < (f.grid & 0xffff) * (f.grid >> 16); ++c) {
            const uint word = m.cells.at(f.first_cell + c);
            for (uint e = word >> 2; (word & 3) >= kCellMixedCornerOut; ++e) {
                const CellEntry& entry = m.cell_entries.at(f.first_entry + e);
                const uint last = (entry.word >> kPiecePointShift) + ((entry.word & kPieceCubic) != 0 ? 3 : 1);
                sum += m.trim_points.at(2 * (f.first_point + last) + 1) > 0;
                if ((entry.word & kEntryLast) != 0)
                    break;
            }
        }
        const TextureShape shape = texture_shape(f);
        for (uint y = 0; y < shape.height; ++y)
            for (uint x = 0; x < shape.width; ++x)
                sum += texel_level(shape, m.sdf_words.data() + f.sdf_first_word, x, y);
    };
    if (m.top_nodes.empty())
        return 0;
    walk_tree(0, m.top_nodes, [&](uint i) {
        const PartRecord& part = m.parts.at(m.instances.at(i).part);
        walk_tree(part.first_node, m.part_nodes, [&](uint leaf) {
            const PatchRecord& patch = m.patches.at(m.leaves.at(part.first_leaf + leaf).patch);
            visit_face(m.faces.at(patch.face));
            const uint points = ((patch.shape >> 8 & 0xff) + 1) * ((patch.shape >> 16 & 0xff) + 1);
            const uint floats = (patch.shape & kShapeRational) != 0 ? 4 : 3;
            if ((patch.shape & 0xff) == kKindBezier)
                sum += m.control_points.at(patch.first_control_point + floats * points - 1) > 0;
        });
    });
    return sum;
}

/// Changes one word of array number `target`, to a telling value or by one bit.
void mutate(PackImage& image, int target, std::mt19937& random)
{
    const uint interesting[] = {0,           1,           2,           3,           100,         0x7fffffffu,
                                0x80000000u, 0xffffffffu, 0x7fc00000u, 0x3f800000u, 0x53e8d4a5u, 0x00000001u};
    int index = 0;
    for_each_array(image, [&](std::string_view, bool, auto& array) {
        const auto words = std::as_writable_bytes(std::span(array));
        if (index++ != target || words.empty())
            return;
        const size_t at = random() % (words.size() / 4) * 4;
        uint word;
        std::memcpy(&word, &words[at], 4);
        word = random() % 2 == 0 ? interesting[random() % std::size(interesting)] : word ^ 1u << random() % 32;
        std::memcpy(&words[at], &word, 4);
    });
}

TEST(pack, whatever_passes_validation_can_be_walked)
{
    std::mt19937 random(7);
    int accepted = 0, refused = 0;
    for (int round = 0; round < 20000; ++round) {
        PackImage image = synthetic_image();
        mutate(image, static_cast<int>(random() % 15), random);
        if (validate_image(image).empty()) {
            ++accepted;
            ASSERT_NO_THROW(walk(image));
        } else {
            ++refused;
        }
    }
    EXPECT_GT(accepted, 1000); // colours, distances and the like are free
    EXPECT_GT(refused, 1000);
}

TEST(pack, hostile_compact_packs_unfold_to_something_that_can_be_walked_or_are_refused)
{
    std::mt19937 random(8);
    const int base_arrays[] = {2, 4, 6, 7, 10, 11}; // parts, faces, patches, control points, trim points and pieces
    int accepted = 0;
    for (int round = 0; round < 1500; ++round) {
        PackImage image = synthetic_image();
        image.compact = true;
        image.leaf_options.max_leaves_per_patch = 64;
        for (uint k = 0; k < 1 + random() % 2; ++k)
            mutate(image, base_arrays[random() % std::size(base_arrays)], random);
        ReadOptions options;
        options.max_decoded_bytes = 64 << 20;
        const Result<LoadedPack> loaded = decode_pack(encode_pack(image, WriteOptions{0}), options);
        if (!loaded.ok())
            continue;
        ++accepted;
        ASSERT_NO_THROW(walk(loaded->image));
    }
    EXPECT_GT(accepted, 100);
}

TEST(pack_filter, columns_come_back)
{
    std::mt19937 random(3);
    for (const uint32_t stride : {4u, 8u, 100u, 136u, 256u}) {
        Bytes records(stride * 123), columns(records.size()), back(records.size());
        for (std::byte& b : records)
            b = static_cast<std::byte>(random());
        const uint64_t mask = ~0ull >> (64 - stride / 4);
        const ColumnFilter filter{mask & 0x5A5A5A5A5A5A5A5Aull, mask & 0x3CC33CC33CC33CC3ull};
        filter_columns(records, stride, filter, columns);
        unfilter_columns(columns, stride, filter, back);
        EXPECT_EQ(records, back) << stride;
    }
}

} // namespace
} // namespace trimray
