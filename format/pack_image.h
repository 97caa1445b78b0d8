// PackImage: everything a pack holds, in memory, as plain arrays. The converter fills one, pack_writer turns it into
// bytes; pack_reader turns bytes into a PackView, the same arrays as read-only spans.
#pragma once

#include "format/pack_layout.h"

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace trimray {

/// Strings by index; index 0 is the empty string. UTF-8. Equal strings share an index.
struct StringTable {
    std::vector<std::string> strings{""};
    uint add(std::string_view s); // index of s, appended if new

private:
    std::unordered_map<std::string, uint> index_; // of the first indexed_ strings
    size_t indexed_ = 0;
};

struct Provenance {
    std::string source_name;   // file name without its folder
    std::string source_format; // "STEP AP214", "IGES 5.3", "BREP"
    std::string source_unit;   // "MM", "INCH", "M": what the file says; the pack is in millimetres
    std::string source_hash;   // content hash of the source, "xxh3-128:<32 hex digits>"; in older packs "xxh3:<16>"
    std::string tool_version;
    std::string options_json;
};

/// How patches are cut into leaves. Part of the pack, so that a compact one gives the same leaves at load.
struct LeafOptions {
    float max_turning_rad = 0.4f; // of a leaf's control polygon, each direction; small leaves may turn more
    float max_aspect = 4.0f;      // longer side over shorter, on the surface
    uint max_leaves_per_patch = 4096;
    // rays steeper than this against a leaf's plane are to meet it once by proof (LeafBend::least_slope); small leaves,
    // and those that no split helps, are left as they are. (0, 90]
    float leaf_slope_deg = 30.0f;
};

enum class TrimSource { Curve, Mask };
enum class TrimLayout { Isotropic, Square };

/// How distance textures are made. Part of the pack, so that a compact one gives the same textures at load.
struct TrimTextureOptions {
    TrimSource source = TrimSource::Curve;     // true distances to the pieces, or the paper's: to a mask's pixels
    TrimLayout layout = TrimLayout::Isotropic; // texels equal on the surface, or the paper's equal numbers of them
};

struct PackImage {
    std::vector<PartRecord> parts;
    std::vector<InstanceRecord> instances;
    std::vector<TreeNode> tree;
    std::vector<FaceRecord> faces;
    std::vector<PatchRecord> patches;
    std::vector<float> control_points;
    std::vector<LeafRecord> leaves;
    std::vector<BvhNode> top_nodes;  // over instances, world mm relative to world_origin_mm / world_scale_mm
    std::vector<BvhNode> part_nodes; // all parts' trees, in part units
    std::vector<float> trim_points;  // u, v pairs, uv_face
    std::vector<uint> trim_pieces;
    std::vector<uint> cells;
    std::vector<CellEntry> cell_entries;
    std::vector<uint> sdf_words;
    std::vector<DroppedFace> dropped;
    StringTable strings;
    Provenance provenance;
    double bounds_lo_mm[3] = {0, 0, 0}; // world, of all instances
    double bounds_hi_mm[3] = {0, 0, 0};
    double world_origin_mm[3] = {0, 0, 0}; // of the top tree's unit space
    double world_scale_mm = 1;
    LeafOptions leaf_options;
    TrimTextureOptions trim_textures;
    bool compact = false; // leaves, nodes, cells, textures are left out and rebuilt at load
    std::vector<std::byte> preview_256_png;
    std::vector<std::byte> preview_512_png;
    std::vector<std::byte> proxy_draco; // coarse triangles of all parts, see SPEC.md
};

} // namespace trimray
