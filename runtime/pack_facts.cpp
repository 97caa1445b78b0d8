#include "runtime/pack_facts.h"

#include "runtime/leaf_slopes.h"

#include <algorithm>
#include <map>
#include <span>
#include <tuple>

namespace trimray {
namespace {

// Nodes on the longest path from the root of a tree. Validation has bounded it by kMaxBvhDepth.
uint32_t tree_depth(std::span<const BvhNode> nodes)
{
    if (nodes.empty())
        return 1; // the tracers' own empty node
    struct Level {
        uint32_t node;
        uint32_t depth;
    };
    uint32_t deepest = 0;
    std::vector<Level> waiting{{0, 1}};
    while (!waiting.empty()) {
        const Level at = waiting.back();
        waiting.pop_back();
        deepest = std::max(deepest, at.depth);
        for (const uint32_t child : nodes[at.node].child)
            if (child != kBvhEmpty && !(child & kBvhLeaf))
                waiting.push_back({child, at.depth + 1});
    }
    return deepest;
}

void add_patches(const PackImage& image, PackFacts& facts)
{
    std::map<std::tuple<bool, uint32_t, uint32_t>, size_t> degrees;
    for (const PatchRecord& patch : image.patches) {
        const uint kind = patch.shape & 0xffu, degree_u = patch.shape >> 8 & 0xffu,
                   degree_v = patch.shape >> 16 & 0xffu;
        ++facts.patches[kind];
        if (kind != kKindBezier)
            continue;
        const bool rational = (patch.shape & kShapeRational) != 0;
        ++degrees[{rational, degree_u, degree_v}];
        facts.largest_net_floats =
            std::max(facts.largest_net_floats, (degree_u + 1) * (degree_v + 1) * (rational ? 4u : 3u));
    }
    for (const auto& [degree, patches] : degrees)
        facts.degrees.push_back({std::get<1>(degree), std::get<2>(degree), std::get<0>(degree), patches});
    std::stable_sort(facts.degrees.begin(), facts.degrees.end(),
                     [](const DegreeCount& a, const DegreeCount& b) { return a.patches > b.patches; });
}

/// Whether a face ends where no other begins.
bool has_free_border(const PackImage& image, const FaceRecord& face)
{
    if ((face.flags & kFaceNaturalBorder) != 0) {
        for (uint side = 0; side < 4; ++side)
            if ((face.border_classes >> 2 * side & 3u) == kEdgeFree)
                return true;
        return false;
    }
    const auto pieces = std::span(image.trim_pieces).subspan(face.first_piece, face.piece_count);
    return std::any_of(pieces.begin(), pieces.end(),
                       [](uint word) { return (word >> kPieceClassShift & 3u) == kEdgeFree; });
}

void add_faces(const PackImage& image, PackFacts& facts)
{
    std::vector<uint8_t> is_open(image.parts.size());
    for (const FaceRecord& face : image.faces)
        is_open[face.part] |= has_free_border(image, face) ? 1 : 0;
    facts.open_parts = size_t(std::count(is_open.begin(), is_open.end(), uint8_t{1}));
    facts.faces = image.faces.size();
    for (const FaceRecord& face : image.faces) {
        const bool natural = (face.flags & kFaceNaturalBorder) != 0;
        facts.trimmed_faces += !natural;
        facts.rim_faces += (face.flags & kFaceRims) != 0;
        facts.colored_faces += (face.flags & kFaceHasColor) != 0;
        if (natural)
            for (uint side = 0; side < 4; ++side)
                ++facts.edges[face.border_classes >> 2 * side & 3u];
    }
    for (const uint word : image.trim_pieces)
        ++facts.edges[word >> kPieceClassShift & 3u];
}

void add_instances(const PackImage& image, PackFacts& facts)
{
    facts.parts = image.parts.size();
    facts.instances = facts.shown_instances = image.instances.size();
    for (const InstanceRecord& instance : image.instances) {
        const double* t = instance.transform; // row-major 3x4
        const double determinant = t[0] * (t[5] * t[10] - t[6] * t[9]) - t[1] * (t[4] * t[10] - t[6] * t[8]) +
                                   t[2] * (t[4] * t[9] - t[5] * t[8]);
        facts.mirrored_instances += determinant < 0;
        facts.colored_instances += (instance.color_rgba >> 24) != 0;
    }
}

uint32_t part_tree_depth(const PackImage& image)
{
    uint32_t part_depth = 1;
    for (const PartRecord& part : image.parts)
        part_depth =
            std::max(part_depth, tree_depth(std::span(image.part_nodes).subspan(part.first_node, part.node_count)));
    return part_depth;
}

} // namespace

size_t PackFacts::rational_patches() const
{
    size_t sum = 0;
    for (const DegreeCount& degree : degrees)
        sum += degree.rational ? degree.patches : 0;
    return sum;
}

uint32_t PackFacts::largest_degree() const
{
    uint32_t largest = 0;
    for (const DegreeCount& degree : degrees)
        largest = std::max({largest, degree.degree_u, degree.degree_v});
    return largest;
}

uint32_t PackFacts::kinds() const
{
    uint32_t bits = 0;
    for (uint kind = 0; kind < kSurfaceKindCount; ++kind)
        bits |= uint32_t{patches[kind] > 0} << kind;
    return bits;
}

uint32_t stack_size(uint32_t part_tree_depth, std::span<const BvhNode> top_nodes)
{
    // a visit takes one and leaves up to four, on each level; a root is one; the part's root comes on top
    return 3 * (tree_depth(top_nodes) + part_tree_depth) + 2;
}

PackFacts pack_facts(const PackImage& image)
{
    PackFacts facts;
    add_patches(image, facts);
    add_faces(image, facts);
    add_instances(image, facts);
    const LeafSlopes slopes = leaf_slopes(image);
    facts.bezier_leaves = slopes.leaves;
    facts.flagged_leaves = slopes.flagged;
    facts.part_tree_depth = part_tree_depth(image);
    facts.stack_size = stack_size(facts.part_tree_depth, image.top_nodes);
    return facts;
}

} // namespace trimray
