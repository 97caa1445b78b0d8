// A small pack image made by hand: two parts, four faces of different kinds, three instances (one mirrored), trims with
// lines and cubics, cells, a texture and trees. Every array has content; nothing needs the converter.
#pragma once

#include "format/pack_image.h"

#include <cmath>

namespace trimray {

inline PatchRecord synthetic_patch(uint face, uint shape, float radius)
{
    PatchRecord p{};
    p.scale = 0.5f;
    p.face = face;
    p.shape = shape;
    p.uv_offset[0] = p.uv_offset[1] = (shape & 0xff) == kKindBezier ? 0.0f : 0.5f;
    p.uv_scale[0] = p.uv_scale[1] = (shape & 0xff) == kKindBezier ? 1.0f : 0.25f;
    p.axis_x[0] = p.axis_y[1] = p.axis_z[2] = 1;
    p.param[0] = radius;
    return p;
}

/// A leaf over the whole patch with a box of half extent 1.25 around its origin.
inline LeafRecord synthetic_leaf(uint patch)
{
    LeafRecord leaf{};
    leaf.patch = patch;
    leaf.uv_hi = 32768u | 32768u << 16;
    leaf.center_z_half_x = 20480u << 16;
    leaf.half_yz = 20480u | 20480u << 16;
    return leaf;
}

/// A node with `count` leaves from 0 on, all with the whole box [-1, 1]^3.
inline BvhNode synthetic_node(uint count)
{
    BvhNode node{};
    node.origin[0] = node.origin[1] = node.origin[2] = -1;
    node.exponents = 120u | 120u << 8 | 120u << 16 | count << 24;
    for (uint c = 0; c < 4; ++c) {
        node.child[c] = c < count ? kBvhLeaf | c : kBvhEmpty;
        for (int axis = 0; axis < 3; ++axis) {
            node.lo[axis] |= (c < count ? 0u : 255u) << 8 * c;
            node.hi[axis] |= (c < count ? 255u : 0u) << 8 * c;
        }
    }
    return node;
}

inline FaceRecord synthetic_face(PackImage& image, uint part, uint kind, uint patch)
{
    FaceRecord f{};
    f.part = part;
    f.name = image.strings.add("Fläche");
    f.color_rgba = 0xff2040c0u;
    f.flags = kFaceHasColor;
    f.first_patch = patch;
    f.patch_count = 1;
    f.area_mm2 = 12.5f;
    f.tolerance_mm = 1e-4f;
    f.extent_mm[0] = f.extent_mm[1] = 10;
    f.surface_kind = kind;
    f.loop_count = 1;
    f.domain_hi[0] = f.domain_hi[1] = 10;
    return f;
}

/// Gives face `f` a loop (a corner of lines and one cubic), a 2 x 1 grid and a 5 x 2 texture.
inline void add_synthetic_trims(PackImage& image, FaceRecord& f)
{
    f.first_point = static_cast<uint>(image.trim_points.size() / 2);
    f.first_piece = static_cast<uint>(image.trim_pieces.size());
    const float points[] = {0, 0, 1, 0, 1, 0.5f, 0.5f, 1, 0, 1, 0, 0};
    image.trim_points.insert(image.trim_points.end(), std::begin(points), std::end(points));
    f.point_count = 6;
    const uint pieces[] = {0u << kPiecePointShift, 1u << kPiecePointShift | kPieceCubic, 4u << kPiecePointShift};
    image.trim_pieces.insert(image.trim_pieces.end(), std::begin(pieces), std::end(pieces));
    f.piece_count = 3;
    f.grid = 2u | 1u << 16;
    f.first_cell = static_cast<uint>(image.cells.size());
    f.first_entry = static_cast<uint>(image.cell_entries.size());
    image.cells.push_back(kCellIn);
    image.cells.push_back(kCellMixedCornerIn | 0u << 2);
    image.cell_entries.push_back({1u << kPiecePointShift | kPieceCubic, 0.25f});
    image.cell_entries.push_back({4u << kPiecePointShift | kEntryLast, kNoEta});
    f.entry_count = 2;
    f.sdf_size = 5u | 2u << 16;
    f.sdf_first_word = static_cast<uint>(image.sdf_words.size());
    for (uint w = 0; w < 4; ++w)
        image.sdf_words.push_back(0x80808080u + w);
    f.sdf_texel_mm = 2;
    f.sdf_band_texels = 0.75f;
}

inline PackImage synthetic_image()
{
    PackImage m;
    m.leaf_options = {0.12f, 4.0f, 1024, 25.0f}; // as in the golden packs, whatever the default
    m.provenance = {"Gehäuse.step", "STEP AP214", "MM", "xxh3:0123456789abcdef", "0.1.0", "{}"};
    m.tree = {{0, m.strings.add("assembly"), 0, 0}, {0, m.strings.add("child"), 0xff00ff00u, 0}};
    const uint bezier = kKindBezier | 1u << 8 | 2u << 16 | kShapeRational;
    m.patches = {synthetic_patch(0, kKindPlane, 0), synthetic_patch(1, kKindCylinder, 1), synthetic_patch(2, bezier, 0),
                 synthetic_patch(3, kKindSphere, 1)};
    for (int i = 0; i < 6; ++i)
        for (const float x : {0.25f * static_cast<float>(i % 3), 0.5f * static_cast<float>(i / 3), 0.125f, 1.0f})
            m.control_points.push_back(x);
    const uint kinds[] = {kKindPlane, kKindCylinder, kKindBezier, kKindSphere};
    for (uint i = 0; i < 4; ++i)
        m.faces.push_back(synthetic_face(m, i / 3, kinds[i], i));
    add_synthetic_trims(m, m.faces[0]);
    add_synthetic_trims(m, m.faces[2]);
    m.faces[3].flags |= kFaceNaturalBorder;
    for (uint i = 0; i < 4; ++i)
        m.leaves.push_back(synthetic_leaf(i));
    m.part_nodes = {synthetic_node(3), synthetic_node(1)};
    m.top_nodes = {synthetic_node(3)};

    PartRecord part{};
    part.scale_mm = 20;
    part.name = m.strings.add("плита");
    part.face_count = part.patch_count = part.leaf_count = 3;
    part.node_count = 1;
    m.parts.push_back(part);
    part.first_face = part.first_patch = part.first_leaf = 3;
    part.face_count = part.patch_count = part.leaf_count = 1;
    part.first_node = 1;
    m.parts.push_back(part);
    for (int i = 0; i < 3; ++i) {
        InstanceRecord instance{};
        instance.transform[0] = i == 2 ? -1 : 1; // the last is a mirror image
        instance.transform[5] = instance.transform[10] = 1;
        instance.transform[3] = 50.0 * i;
        instance.part = static_cast<uint>(i / 2);
        instance.tree_node = static_cast<uint>(i % 2);
        instance.color_rgba = 0xff808080u;
        m.instances.push_back(instance);
    }
    m.dropped.push_back({1, 4, m.strings.add("its domain has no area"), 0});
    for (int axis = 0; axis < 3; ++axis) {
        m.bounds_lo_mm[axis] = -20;
        m.bounds_hi_mm[axis] = 120;
    }
    m.world_scale_mm = 150;
    for (int i = 0; i < 100; ++i) {
        m.preview_256_png.push_back(static_cast<std::byte>(i * 37));
        m.proxy_draco.push_back(static_cast<std::byte>(i * 11));
    }
    return m;
}

} // namespace trimray
