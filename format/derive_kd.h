// The kd-tree baseline: for each face a 2D kd-tree over its trims' monotone sets, built at load when asked for.
// Source: Sloup & Havran, "Optimizing Ray Tracing of Trimmed NURBS Surfaces on the GPU", CGF 2021. What it has:
//   - monotone pieces grouped in monotone sets: a leaf keeps one run of a set, found at v by one binary search, however
//     many pieces of it pass through; a run's or a piece's box decides what is left or right of it without solving
//   - planes chosen by a cost like the surface area heuristic's, over areas, at the ends of what lies in a node and
//     between them; empty space is cut off, for a leaf without runs costs nothing. Subtrees that save less time than
//     their bytes are worth are taken back, so that a face's tree stays in proportion to its pieces
//   - what lies in a node is clipped to it as pieces, not as boxes
//   - leaves where no curve is near hold in or out and nothing else is read; the others hold their class at the end of
//     a ray that does not leave them, so that no piece outside a leaf is ever tested
//   - nodes of 8 bytes, children side by side; a leaf's only run lies in the node itself; walked without a stack
//   - points of its own, a run's beside each other, so that no piece needs a record
// The planes are numbers that a query compares with as they are, and so are the boxes' sides: no margins, and the
// answers are those of the even-odd rule but for the rounding of a cubic's or a line's evaluation.
#pragma once

#include "format/kd_layout.h"
#include "format/pack_image.h"
#include "format/result.h"

#include <cstddef>
#include <vector>

namespace trimray {

struct KdTrims {
    std::vector<KdNode> nodes;
    std::vector<KdRun> runs;
    std::vector<float> points; // u, v pairs, uv_face
    std::vector<KdFace> faces; // of each face of the image; a face without trims has a single leaf, in or out
    size_t size_bytes() const;
};

/// Builds the trees of all faces, on all cores; the same on any number of threads. Each face has its own tree, as it
/// has its own cells and texture. Domain: a validated image.
/// Fails: InvalidPack (faces that share pieces), UnsupportedPackFeature (too many points for the numbers' bits).
Result<KdTrims> derive_kd(const PackImage& image);

/// Bytes of the model's kd-trees, the unit of `--trim-memory 50%`. Domain: an image of the converter's.
double kd_trim_bytes(const PackImage& image);

} // namespace trimray
