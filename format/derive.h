// Sections that follow from others: leaves from patches, trees from leaves, cells and distance textures from trim
// pieces. The converter calls these to fill a pack; the loader calls the same functions on a compact pack, so both give
// the same bytes. All are deterministic on any number of threads. `cancelled`, where there is one, is asked by any
// thread between patches, parts or faces; once it says true it goes on saying so, and what is filled then is of no use.
#pragma once

#include "format/pack_image.h"
#include "format/result.h"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace trimray {

/// Fills image.leaves, the parts' leaf ranges and the Bezier patches' param from patches and control points. A leaf's
/// box holds the surface over its rectangle (convex hull of its control points, rounded outwards). Source: paper eq.
/// 1-2; Piegl & Tiller 5.3.
void derive_leaves(PackImage& image, const LeafOptions& options, const std::function<bool()>& cancelled = {});

/// Fills image.part_nodes, image.top_nodes and the parts' node ranges. Reorders each part's leaves into tree order.
void derive_trees(PackImage& image, const std::function<bool()>& cancelled = {});

/// The tree over placements, as PackImage's top_nodes, world_... and bounds_... have it.
struct TopTree {
    std::vector<BvhNode> nodes; // none: nothing is placed
    double origin_mm[3] = {0, 0, 0};
    double scale_mm = 1;
    double bounds_lo_mm[3] = {0, 0, 0}, bounds_hi_mm[3] = {0, 0, 0};
};

/// The tree over `instances` where `visible` is not 0; empty: over all. Its leaves are numbers in `instances`.
/// Shapes: as many in `visible` as in `instances`. Domain: image has its parts' trees.
TopTree derive_top_tree(const PackImage& image, std::span<const InstanceRecord> instances,
                        std::span<const uint8_t> visible = {});

/// Fills image.cells, image.cell_entries and the faces' grids from trim points and pieces (pack_layout.h, CellEntry).
void derive_cells(PackImage& image, const std::function<bool()>& cancelled = {});

/// Fills image.sdf_words from trim points, pieces and what allocate_trim_memory set: image.trim_textures and each
/// face's sdf_size.
void derive_sdf(PackImage& image, const std::function<bool()>& cancelled = {});

/// Sets image.trim_textures, and each trimmed face's sdf_size so that the textures take about total_bytes: M_i =
/// ceil(M_total A_i / sum A), H_i = floor(sqrt(M_i)) (paper eq. 4, 5) in the square layout; the isotropic one has equal
/// texels on the surface, and what faces leave of their M_i goes to small ones. Bytes are texels here: what rows padded
/// to whole words take beyond H_i^2 comes on top.
void allocate_trim_memory(PackImage& image, double total_bytes, const TrimTextureOptions& options);

} // namespace trimray
