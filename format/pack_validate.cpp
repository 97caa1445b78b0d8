// The checks on decoded arrays. After them no index leaves its array, no walk is endless and no number is NaN or
// infinite. SPEC.md, "What a reader checks", says the same in words; findings 32xx are these.
#include "format/affine.h"
#include "format/load_watch.h"
#include "format/pack_file.h"
#include "format/pack_reader.h"
#include "format/trim_texture.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

namespace trimray {
namespace {

// Numbers in patch and part units are about 1; beyond this, products of three of them leave single precision.
constexpr float kMaxMagnitude = 1e12f;
// Trim loops lie in [0,1]^2 up to rounding of their ends; inner control points of a monotone cubic may leave its hull
// of ends by a third.
constexpr float kTrimSlack = 1.0f / 1024;
constexpr float kTrimControlLo = -1, kTrimControlHi = 2;
// Axes are single-precision unit vectors: rounding is 1e-7, anything above this bound is not a rotation.
constexpr float kAxisTolerance = 1e-4f;

/// One finding for each number and section: the first fault in full, the rest counted.
class Report {
public:
    void add(int number, const char* section, std::string detail)
    {
        Entry& entry = entries_[{number, section}];
        if (entry.count++ == 0)
            entry.detail = std::move(detail);
    }
    bool empty() const { return entries_.empty(); }
    std::vector<Finding> findings() const
    {
        std::vector<Finding> all;
        for (const auto& [key, entry] : entries_) {
            const std::string more = entry.count > 1 ? fmt::format(" (and {} more)", entry.count - 1) : "";
            all.push_back({key.first, key.second, entry.detail + more});
        }
        return all;
    }

private:
    struct Entry {
        uint64_t count = 0;
        std::string detail;
    };
    std::map<std::pair<int, std::string>, Entry> entries_;
};

bool is_sane(float x)
{
    return std::abs(x) <= kMaxMagnitude; // false for NaN
}

template <size_t N>
bool are_sane(const float (&x)[N])
{
    return std::all_of(x, x + N, is_sane);
}

template <size_t N>
bool are_sane(const double (&x)[N])
{
    return std::all_of(x, x + N, [](double d) { return std::abs(d) <= kMaxMillimetres; });
}

bool is_range_inside(uint64_t first, uint64_t count, uint64_t size)
{
    return first <= size && count <= size - first;
}

float dot(const float (&a)[3], const float (&b)[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// UTF-8 as RFC 3629 has it: no overlong forms, no surrogates, nothing above U+10FFFF. NUL ends a string and is no part
/// of one.
bool is_text(std::string_view s)
{
    for (size_t i = 0; i < s.size();) {
        const auto lead = static_cast<unsigned char>(s[i]);
        const int length = lead < 0x80 ? 1 : lead < 0xC2 ? 0 : lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : lead < 0xF5 ? 4 : 0;
        if (lead == 0 || length == 0 || i + length > s.size())
            return false;
        for (int k = 1; k < length; ++k)
            if ((static_cast<unsigned char>(s[i + k]) & 0xC0) != 0x80)
                return false;
        const unsigned char second = length > 1 ? static_cast<unsigned char>(s[i + 1]) : 0;
        if ((lead == 0xE0 && second < 0xA0) || (lead == 0xED && second > 0x9F) || (lead == 0xF0 && second < 0x90) ||
            (lead == 0xF4 && second > 0x8F))
            return false;
        i += length;
    }
    return true;
}

class ImageValidator {
public:
    ImageValidator(const PackImage& image, const std::function<bool()>& cancelled)
        : image_(image), cancelled_(cancelled)
    {
        has_derived_ = !image.compact || !image.leaves.empty() || !image.part_nodes.empty() ||
                       !image.top_nodes.empty() || !image.cells.empty() || !image.sdf_words.empty();
    }

    std::vector<Finding> run()
    {
        check_sizes();
        if (!report_.empty())
            return report_.findings();
        check_frame();
        check_patches();
        check_control_points();
        check_trims();
        check_derived();
        return report_.findings();
    }

    /// Without what an outline lacks.
    std::vector<Finding> run_on_outline()
    {
        check_sizes();
        if (!report_.empty())
            return report_.findings();
        check_frame();
        check_patches();
        check_derived();
        return report_.findings();
    }

private:
    /// Asked with the number of each record; looked at every so many.
    bool is_given_up(size_t record) const
    {
        constexpr size_t kStep = 4096;
        return record % kStep == 0 && cancelled_ && cancelled_();
    }

    void check_frame()
    {
        check_facts();
        check_strings();
        check_assembly();
        check_parts();
        check_faces();
    }

    void check_derived()
    {
        if (!has_derived_ || !report_.empty())
            return;
        check_leaves();
        check_part_trees();
        check_top_tree();
    }

    void check_sizes()
    {
        for_each_array(image_, [&](std::string_view id, bool, const auto& array) {
            if (array.size() > kMaxElements)
                report_.add(3201, std::string(id).c_str(), fmt::format("{} elements", array.size()));
        });
        if (image_.trim_points.size() % 2 != 0)
            report_.add(3201, "TPNT", "an odd count of coordinates");
    }

    void check_facts()
    {
        const PackImage& m = image_;
        if (!are_sane(m.bounds_lo_mm) || !are_sane(m.bounds_hi_mm) || !are_sane(m.world_origin_mm))
            report_.add(3202, "FACT", "bounds are not finite");
        for (int axis = 0; axis < 3; ++axis)
            if (m.bounds_lo_mm[axis] > m.bounds_hi_mm[axis])
                report_.add(3203, "FACT", fmt::format("bounds are empty along axis {}", axis));
        if (!(m.world_scale_mm > 0 && m.world_scale_mm <= kMaxMillimetres))
            report_.add(3204, "FACT", fmt::format("world scale {}", m.world_scale_mm));
        const LeafOptions& leaf = m.leaf_options;
        if (!(leaf.max_turning_rad > 0 && leaf.max_turning_rad <= 100 && leaf.max_aspect >= 1 &&
              leaf.max_aspect <= kMaxMagnitude && leaf.leaf_slope_deg > 0 && leaf.leaf_slope_deg <= 90) ||
            leaf.max_leaves_per_patch == 0 || leaf.max_leaves_per_patch > kMaxLeavesPerPatch)
            report_.add(3205, "FACT",
                        fmt::format("leaf options {} {} {} {}", leaf.max_turning_rad, leaf.max_aspect,
                                    leaf.max_leaves_per_patch, leaf.leaf_slope_deg));
    }

    void check_strings()
    {
        const std::vector<std::string>& strings = image_.strings.strings;
        if (strings.empty() || !strings[0].empty())
            report_.add(3206, "STRS", "string 0 is not the empty string");
        for (size_t i = 0; i < strings.size(); ++i)
            if (!is_text(strings[i]))
                report_.add(3206, "STRS", fmt::format("string {} is not UTF-8 text", i));
        const Provenance& p = image_.provenance;
        for (const std::string* s :
             {&p.source_name, &p.source_format, &p.source_unit, &p.source_hash, &p.tool_version, &p.options_json})
            if (!is_text(*s))
                report_.add(3206, "prov", "not UTF-8 text");
    }

    void check_string_index(uint index, const char* section, size_t record)
    {
        if (index >= image_.strings.strings.size())
            report_.add(3207, section, fmt::format("record {}: string {}", record, index));
    }

    void check_assembly()
    {
        for (size_t i = 0; i < image_.tree.size(); ++i) {
            const TreeNode& node = image_.tree[i];
            if (i == 0 ? node.parent != 0 : node.parent >= i)
                report_.add(3208, "TREE", fmt::format("node {} has parent {}", i, node.parent));
            check_string_index(node.name, "TREE", i);
        }
        for (size_t i = 0; i < image_.instances.size(); ++i) {
            const InstanceRecord& instance = image_.instances[i];
            if (instance.part >= image_.parts.size())
                report_.add(3209, "INST", fmt::format("instance {} of part {}", i, instance.part));
            if (instance.tree_node >= image_.tree.size())
                report_.add(3209, "INST", fmt::format("instance {} at tree node {}", i, instance.tree_node));
            check_string_index(instance.name, "INST", i);
            check_transform(instance, i);
        }
        for (size_t i = 0; i < image_.dropped.size(); ++i) {
            const DroppedFace& d = image_.dropped[i];
            if (d.part >= image_.parts.size())
                report_.add(3209, "drop", fmt::format("record {} of part {}", i, d.part));
            check_string_index(d.reason, "drop", i);
            check_string_index(d.name, "drop", i);
        }
    }

    void check_transform(const InstanceRecord& instance, size_t i)
    {
        const double(&m)[12] = instance.transform;
        if (!are_sane(m)) {
            report_.add(3202, "INST", fmt::format("instance {}: its transform is not finite", i));
            return;
        }
        if (is_singular(m))
            report_.add(3210, "INST", fmt::format("instance {}: determinant {}", i, determinant(m)));
    }

    /// Parts follow each other in every array they own, and faces in theirs.
    void check_parts()
    {
        uint64_t face = 0, patch = 0, leaf = 0, node = 0;
        for (size_t i = 0; i < image_.parts.size(); ++i) {
            const PartRecord& p = image_.parts[i];
            if (!are_sane(p.origin_mm))
                report_.add(3202, "PART", fmt::format("part {}: its origin is not finite", i));
            if (!(p.scale_mm > 0 && p.scale_mm <= kMaxMillimetres))
                report_.add(3204, "PART", fmt::format("part {}: scale {}", i, p.scale_mm));
            if (p.reserved != 0)
                report_.add(3211, "PART", fmt::format("part {}", i));
            check_string_index(p.name, "PART", i);
            if (p.first_face != face || p.first_patch != patch)
                report_.add(3212, "PART",
                            fmt::format("part {} begins at face {}, patch {}; expected {}, {}", i, p.first_face,
                                        p.first_patch, face, patch));
            if (has_derived_ ? p.first_leaf != leaf || p.first_node != node
                             : (p.first_leaf | p.leaf_count | p.first_node | p.node_count) != 0)
                report_.add(3212, "PART",
                            fmt::format("part {} begins at leaf {}, node {}; expected {}, {}", i, p.first_leaf,
                                        p.first_node, leaf, node));
            face += p.face_count, patch += p.patch_count, leaf += p.leaf_count, node += p.node_count;
        }
        if (face != image_.faces.size() || patch != image_.patches.size() || leaf != image_.leaves.size() ||
            node != image_.part_nodes.size())
            report_.add(3212, "PART", "the parts do not cover all faces, patches, leaves and nodes");
    }

    void check_faces()
    {
        uint64_t patch = 0;
        for (size_t i = 0; i < image_.faces.size() && !is_given_up(i); ++i) {
            const FaceRecord& f = image_.faces[i];
            if (f.part >= image_.parts.size() || i - image_.parts[f.part].first_face >= image_.parts[f.part].face_count)
                report_.add(3209, "FACE", fmt::format("face {} of part {}", i, f.part));
            if (f.first_patch != patch || f.patch_count == 0)
                report_.add(3212, "FACE",
                            fmt::format("face {} has {} patches from {}; expected from {}", i, f.patch_count,
                                        f.first_patch, patch));
            patch += f.patch_count;
            check_string_index(f.name, "FACE", i);
            check_face_numbers(f, i);
        }
        if (patch != image_.patches.size())
            report_.add(3212, "FACE", "the faces do not cover all patches");
    }

    void check_face_numbers(const FaceRecord& f, size_t i)
    {
        constexpr uint kKnownFlags = kFaceReversed | kFaceNaturalBorder | kFaceHasColor | kFaceApproximated |
                                     kFaceOpenLoop | kFaceTexelCentres | kFaceTileShiftMask << kFaceTileShiftBit |
                                     kFaceRims;
        const uint rim_u = f.flags >> kFaceRimBit & kFaceRimMask;
        const uint rim_v = f.flags >> (kFaceRimBit + kFaceRimBits) & kFaceRimMask;
        if (f.surface_kind >= kSurfaceKindCount || (f.flags & ~kKnownFlags) != 0 || (rim_u == 0) != (rim_v == 0) ||
            f.border_classes > ((f.flags & kFaceNaturalBorder) != 0 ? 0xffu : 0u))
            report_.add(3211, "FACE", fmt::format("face {}: kind {}, flags {:#x}", i, f.surface_kind, f.flags));
        const float numbers[] = {f.sdf_texel_mm, f.sdf_band_texels, f.area_mm2,    f.tolerance_mm,
                                 f.deviation_mm, f.extent_mm[0],    f.extent_mm[1]};
        if (!std::all_of(std::begin(numbers), std::end(numbers), [](float x) { return x >= 0 && std::isfinite(x); }))
            report_.add(3202, "FACE", fmt::format("face {}: a length or area is negative or not finite", i));
        if (!are_sane(f.domain_lo) || !are_sane(f.domain_hi) || !(f.domain_lo[0] < f.domain_hi[0]) ||
            !(f.domain_lo[1] < f.domain_hi[1]))
            report_.add(3213, "FACE", fmt::format("face {}: its domain is empty or not finite", i));
    }

    void check_patches()
    {
        for (size_t i = 0; i < image_.patches.size() && !is_given_up(i); ++i) {
            const PatchRecord& p = image_.patches[i];
            if (p.face >= image_.faces.size() ||
                i - image_.faces[p.face].first_patch >= image_.faces[p.face].patch_count)
                report_.add(3209, "PTCH", fmt::format("patch {} of face {}", i, p.face));
            if (!are_sane(p.origin_hi) || !are_sane(p.origin_lo) || !are_sane(p.uv_offset) || !are_sane(p.uv_scale) ||
                !are_sane(p.axis_x) || !are_sane(p.axis_y) || !are_sane(p.axis_z) || !are_sane(p.param))
                report_.add(3202, "PTCH", fmt::format("patch {}", i));
            if (!(p.scale > 0 && p.scale <= kMaxMagnitude) || p.uv_scale[0] == 0 || p.uv_scale[1] == 0)
                report_.add(
                    3204, "PTCH",
                    fmt::format("patch {}: scale {}, uv scale {} {}", i, p.scale, p.uv_scale[0], p.uv_scale[1]));
            if (!is_rotation(p))
                report_.add(3214, "PTCH", fmt::format("patch {}", i));
            check_shape(p, i);
        }
    }

    void check_control_points()
    {
        if (!std::all_of(image_.control_points.begin(), image_.control_points.end(), is_sane))
            report_.add(3202, "CTRL", "a control point is not finite");
        for (size_t i = 0; i < image_.patches.size() && !is_given_up(i); ++i)
            if (has_net(image_.patches[i]))
                check_net(image_.patches[i], i);
    }

    static bool has_net(const PatchRecord& p)
    {
        const auto is_degree = [](uint degree) { return degree >= 1 && degree <= kMaxDegree; };
        return (p.shape & 0xff) == kKindBezier && p.shape >> 25 == 0 && is_degree(p.shape >> 8 & 0xff) &&
               is_degree(p.shape >> 16 & 0xff);
    }

    static bool is_rotation(const PatchRecord& p)
    {
        const float off[] = {dot(p.axis_x, p.axis_x) - 1, dot(p.axis_y, p.axis_y) - 1, dot(p.axis_z, p.axis_z) - 1,
                             dot(p.axis_x, p.axis_y),     dot(p.axis_y, p.axis_z),     dot(p.axis_z, p.axis_x)};
        return std::all_of(std::begin(off), std::end(off), [](float x) { return std::abs(x) <= kAxisTolerance; });
    }

    void check_shape(const PatchRecord& p, size_t i)
    {
        const uint kind = p.shape & 0xff, degree_u = p.shape >> 8 & 0xff, degree_v = p.shape >> 16 & 0xff;
        if (kind >= kSurfaceKindCount || p.shape >> 25 != 0) {
            report_.add(3215, "PTCH", fmt::format("patch {}: shape {:#x}", i, p.shape));
            return;
        }
        if (kind != kKindBezier) {
            if (p.shape != kind || p.first_control_point != 0)
                report_.add(3215, "PTCH", fmt::format("patch {}: a native surface of shape {:#x}", i, p.shape));
            const bool radius_needed = kind == kKindCylinder || kind == kKindSphere || kind == kKindTorus;
            if ((radius_needed && !(p.param[0] > 0)) || (kind == kKindTorus && !(p.param[1] > 0)) || p.param[0] < 0)
                report_.add(3216, "PTCH", fmt::format("patch {}: radii {} {}", i, p.param[0], p.param[1]));
            return;
        }
        if (!(p.param[0] >= 0 && p.param[1] >= 0))
            report_.add(3216, "PTCH", fmt::format("patch {}: roundings {} {}", i, p.param[0], p.param[1]));
        if (!has_net(p))
            report_.add(3217, "PTCH", fmt::format("patch {}: degrees {} {}", i, degree_u, degree_v));
    }

    void check_net(const PatchRecord& p, size_t i)
    {
        const uint degree_u = p.shape >> 8 & 0xff, degree_v = p.shape >> 16 & 0xff;
        const bool rational = (p.shape & kShapeRational) != 0;
        const uint64_t points = uint64_t{degree_u + 1} * (degree_v + 1);
        if (!is_range_inside(p.first_control_point, points * (rational ? 4 : 3), image_.control_points.size())) {
            report_.add(3218, "PTCH",
                        fmt::format("patch {}: {} control points from float {}", i, points, p.first_control_point));
            return;
        }
        for (uint64_t k = 0; rational && k < points; ++k)
            if (!(image_.control_points[p.first_control_point + 4 * k + 3] > 0))
                report_.add(3219, "PTCH", fmt::format("patch {}: weight {} is not positive", i, k));
    }

    void check_trims()
    {
        for (const float x : image_.trim_points)
            if (!(x >= kTrimControlLo && x <= kTrimControlHi)) {
                report_.add(3220, "TPNT", fmt::format("coordinate {}", x));
                return;
            }
        for (const CellEntry& entry : image_.cell_entries)
            if (!(entry.eta >= -1 && entry.eta <= kTrimControlHi))
                report_.add(3220, "CENT", fmt::format("crossing at {}", entry.eta));
        for (size_t i = 0; i < image_.faces.size() && !is_given_up(0); ++i) {
            const FaceRecord& f = image_.faces[i];
            if (!is_range_inside(f.first_point, f.point_count, image_.trim_points.size() / 2) ||
                !is_range_inside(f.first_piece, f.piece_count, image_.trim_pieces.size())) {
                report_.add(3221, "FACE", fmt::format("face {}: trim points or pieces outside their array", i));
                continue;
            }
            for (uint k = 0; k < f.piece_count; ++k)
                check_piece(f, image_.trim_pieces[f.first_piece + k], 0, "TPCE", i);
            check_texture(f, i);
            if (has_derived_) {
                check_cells(f, i);
            } else if ((f.grid | f.first_cell | f.first_entry | f.entry_count | f.sdf_first_word) != 0) {
                report_.add(3222, "FACE", fmt::format("face {}: cells in a compact pack", i));
            }
        }
    }

    void check_piece(const FaceRecord& f, uint word, uint allowed_flags, const char* section, size_t i)
    {
        const uint64_t first = word >> kPiecePointShift;
        const uint64_t last = first + ((word & kPieceCubic) != 0 ? 3 : 1);
        if ((word & 3u & ~(kPieceCubic | allowed_flags)) != 0 || last >= f.point_count) {
            report_.add(3221, section, fmt::format("face {}: piece {:#x} of {} points", i, word, f.point_count));
            return;
        }
        for (const uint64_t end : {first, last})
            for (int axis = 0; axis < 2; ++axis) {
                const float x = image_.trim_points[2 * (f.first_point + end) + axis];
                if (!(x >= -kTrimSlack && x <= 1 + kTrimSlack))
                    report_.add(3220, section, fmt::format("face {}: a piece ends at {}", i, x));
            }
    }

    void check_cells(const FaceRecord& f, size_t i)
    {
        if (!is_range_inside(f.first_entry, f.entry_count, image_.cell_entries.size())) {
            report_.add(3222, "FACE", fmt::format("face {}: cell entries outside their array", i));
            return;
        }
        for (uint k = 0; k < f.entry_count; ++k)
            check_piece(f, image_.cell_entries[f.first_entry + k].word, kEntryLast, "CENT", i);
        // a cell's entries end at the next one marked last: with the face's last entry marked, every walk ends
        if (f.entry_count > 0 && (image_.cell_entries[f.first_entry + f.entry_count - 1].word & kEntryLast) == 0)
            report_.add(3223, "CENT", fmt::format("face {}: its last entry is not marked last", i));
        if (f.grid == 0)
            return;
        const uint64_t columns = f.grid & 0xffff, rows = f.grid >> 16;
        if (columns == 0 || rows == 0 || !is_range_inside(f.first_cell, columns * rows, image_.cells.size())) {
            report_.add(3222, "FACE", fmt::format("face {}: {} x {} cells from {}", i, columns, rows, f.first_cell));
            return;
        }
        for (uint64_t c = 0; c < columns * rows; ++c) {
            const uint word = image_.cells[f.first_cell + c];
            const bool mixed = (word & 3) >= kCellMixedCornerOut;
            if (mixed && word >> 2 >= f.entry_count)
                report_.add(3224, "CELL",
                            fmt::format("face {}, cell {}: entry {} of {}", i, c, word >> 2, f.entry_count));
        }
    }

    void check_texture(const FaceRecord& f, size_t i)
    {
        if (f.sdf_size == 0)
            return;
        const TextureShape shape = texture_shape(f);
        const uint64_t tiles = static_cast<uint64_t>(shape.tiles_u) * shape.tiles_v;
        const std::string what = fmt::format("face {}: {} x {} texels, tile shift {}, from word {}", i, shape.width,
                                             shape.height, shape.tile_shift, f.sdf_first_word);
        if (shape.width == 0 || shape.height == 0 || std::max(shape.width, shape.height) > kMaxTextureSide ||
            shape.tile_shift > kMaxTileShift || tiles > kMaxTiles)
            report_.add(3238, "FACE", what);
        else if (has_derived_ && !is_range_inside(f.sdf_first_word, shape.words(0), image_.sdf_words.size()))
            report_.add(3225, "FACE", what);
        else if (has_derived_ && shape.tile_shift > 0)
            check_tiles(f, shape, i);
    }

    void check_tiles(const FaceRecord& f, const TextureShape& shape, size_t i)
    {
        const std::span<const uint> words = std::span(image_.sdf_words).subspan(f.sdf_first_word);
        for (uint tile = 0; tile < shape.tiles_u * shape.tiles_v; ++tile) {
            const uint entry = words[tile / 2] >> 16 * (tile % 2) & 0xffffu;
            if (entry >= kFirstTile && shape.words(entry - kFirstTile + 1) > words.size()) {
                report_.add(3225, "SDFW", fmt::format("face {}, tile {}: entry {}", i, tile, entry));
                return;
            }
        }
    }

    void check_leaves()
    {
        for (size_t part = 0; part < image_.parts.size(); ++part) {
            const PartRecord& p = image_.parts[part];
            for (size_t i = p.first_leaf; i < size_t{p.first_leaf} + p.leaf_count; ++i) {
                const LeafRecord& leaf = image_.leaves[i];
                if (is_given_up(i))
                    return;
                if (leaf.patch < p.first_patch || leaf.patch - p.first_patch >= p.patch_count)
                    report_.add(3209, "LEAF", fmt::format("leaf {} of patch {}", i, leaf.patch));
                const uint u_lo = leaf.uv_lo & 0xffff, v_lo = leaf.uv_lo >> 16;
                const uint u_hi = leaf.uv_hi & 0xffff, v_hi = leaf.uv_hi >> 16;
                if (u_lo >= u_hi || v_lo >= v_hi || u_hi > 32768 || v_hi > 32768)
                    report_.add(3226, "LEAF", fmt::format("leaf {}: [{}, {}] x [{}, {}]", i, u_lo, u_hi, v_lo, v_hi));
                const auto quat = [](uint bits) { return static_cast<int16_t>(bits & 0xffff) / 32767.0; };
                const double x = quat(leaf.quat_xy), y = quat(leaf.quat_xy >> 16), z = quat(leaf.quat_z_bend);
                constexpr double kRounding = 3.0 / 32767; // of three components, half a step each way
                if (x * x + y * y + z * z > 1 + kRounding)
                    report_.add(3227, "LEAF", fmt::format("leaf {}: quaternion {} {} {}", i, x, y, z));
                if (leaf.quat_z_bend >> 16 != 0 && leaf.patch < image_.patches.size() &&
                    (image_.patches[leaf.patch].shape & 0xffu) != kKindBezier)
                    report_.add(3239, "LEAF", fmt::format("leaf {}: a native surface bends", i));
            }
        }
    }

    void check_part_trees()
    {
        for (size_t i = 0; i < image_.parts.size(); ++i) {
            const PartRecord& p = image_.parts[i];
            const std::vector<bool> all(p.leaf_count, true);
            check_tree(std::span(image_.part_nodes).subspan(p.first_node, p.node_count), all, "NODE",
                       fmt::format("part {}", i));
        }
    }

    void check_top_tree()
    {
        // an instance of a part without leaves is never drawn, and the part has no root to enter
        std::vector<bool> drawn(image_.instances.size());
        for (size_t i = 0; i < drawn.size(); ++i)
            drawn[i] = image_.parts[image_.instances[i].part].leaf_count > 0;
        check_tree(image_.top_nodes, drawn, "TOPN", "top tree");
    }

    /// Parents come before their children, so the tree has no cycle; every node but the root and every wanted leaf is
    /// reached once, and no other leaf.
    void check_tree(std::span<const BvhNode> nodes, const std::vector<bool>& wanted, const char* section,
                    const std::string& where)
    {
        std::vector<uint8_t> depth(nodes.size(), 0); // 0: not reached
        std::vector<bool> reached(wanted.size(), false);
        if (!nodes.empty())
            depth[0] = 1;
        for (size_t n = 0; n < nodes.size(); ++n) {
            if (is_given_up(n))
                return;
            if (depth[n] == 0) {
                report_.add(3230, section, fmt::format("{}: node {} is not reached", where, n));
                continue;
            }
            if (depth[n] > kMaxBvhDepth) {
                report_.add(3231, section, fmt::format("{}: node {} is deeper than {}", where, n, kMaxBvhDepth));
                return;
            }
            check_node_numbers(nodes[n], section, where, n);
            const uint count = nodes[n].exponents >> 24;
            for (uint c = 0; c < 4; ++c) {
                const uint child = nodes[n].child[c];
                if ((c < count) == (child == kBvhEmpty)) {
                    report_.add(3232, section, fmt::format("{}: node {} has {} children", where, n, count));
                } else if (child == kBvhEmpty) {
                    continue;
                } else if ((child & kBvhLeaf) != 0) {
                    const uint leaf = child & ~kBvhLeaf;
                    if (leaf >= wanted.size() || !wanted[leaf] || reached[leaf])
                        report_.add(3233, section,
                                    fmt::format("{}: leaf {} does not exist or comes twice", where, leaf));
                    else
                        reached[leaf] = true;
                } else if (child <= n || child >= nodes.size() || depth[child] != 0) {
                    report_.add(3234, section, fmt::format("{}: node {} has child {}", where, n, child));
                } else {
                    depth[child] = static_cast<uint8_t>(depth[n] + 1);
                }
            }
        }
        for (size_t leaf = 0; leaf < wanted.size(); ++leaf)
            if (wanted[leaf] && !reached[leaf])
                report_.add(3235, section, fmt::format("{}: leaf {} is not reached", where, leaf));
    }

    void check_node_numbers(const BvhNode& node, const char* section, const std::string& where, size_t n)
    {
        bool sane = are_sane(node.origin) && node.exponents >> 24 >= 1 && node.exponents >> 24 <= 4;
        for (int axis = 0; axis < 3; ++axis) {
            // 2^60 is far above any box of a model in units of about 1, and 255 steps of it stay finite
            constexpr uint kLargestExponent = 127 + 60;
            sane = sane && (node.exponents >> 8 * axis & 0xff) <= kLargestExponent;
        }
        if (!sane)
            report_.add(3236, section, fmt::format("{}: node {}", where, n));
        if (node.reserved[0] != 0 || node.reserved[1] != 0)
            report_.add(3211, section, fmt::format("{}: node {}", where, n));
    }

    const PackImage& image_;
    const std::function<bool()>& cancelled_;
    bool has_derived_ = true;
    Report report_;
};

} // namespace

std::vector<Finding> validate_image(const PackImage& image)
{
    return validate_image(image, {});
}

std::vector<Finding> validate_image(const PackImage& image, const std::function<bool()>& cancelled)
{
    return ImageValidator(image, cancelled).run();
}

bool is_valid_outline(const PackImage& image, const std::function<bool()>& cancelled)
{
    return ImageValidator(image, cancelled).run_on_outline().empty() && !(cancelled && cancelled());
}

} // namespace trimray
