// What a pack holds, as far as tracing it depends on that: found once, by one walk over its arrays. The effect plan
// (effect_plan.h) and the tracers ask for nothing else about a pack as a whole.
#pragma once

#include "format/pack_image.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace trimray {

/// How many Bezier patches are of one degree.
struct DegreeCount {
    uint32_t degree_u = 0, degree_v = 0;
    bool rational = false;
    size_t patches = 0;
};

struct PackFacts {
    std::array<size_t, kSurfaceKindCount> patches{}; // by kKind...
    std::vector<DegreeCount> degrees;                // most patches first, then by degree; polynomial before rational
    uint32_t largest_net_floats = 0;                 // of a Bezier patch's control points

    size_t open_parts = 0; // parts with a face that ends where no other begins: they close no solid
    size_t parts = 0, faces = 0, trimmed_faces = 0, rim_faces = 0, colored_faces = 0;
    size_t instances = 0, mirrored_instances = 0, colored_instances = 0;
    std::array<size_t, kEdgeClassCount> edges{}; // pieces of trims and sides of natural borders, by kEdge...
    size_t bezier_leaves = 0, flagged_leaves = 0;
    size_t shown_instances = 0;   // all of them; less where someone counts what an arrangement leaves
    uint32_t part_tree_depth = 0; // nodes on the longest path of the deepest part's tree
    uint32_t stack_size = 0; // waiting children at most while the trees are walked, top and deepest part's together

    size_t bezier_patches() const { return patches[kKindBezier]; }
    size_t rational_patches() const;
    uint32_t largest_degree() const; // of either direction; 0: there are none
    /// Bit kKind... of those that it holds.
    uint32_t kinds() const;
};

PackFacts pack_facts(const PackImage& image);

/// PackFacts::stack_size where another tree lies over the parts' trees.
uint32_t stack_size(uint32_t part_tree_depth, std::span<const BvhNode> top_nodes);

} // namespace trimray
