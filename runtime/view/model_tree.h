// A pack's assembly as a tree to show: nodes with names, colours and counts, the placements under each, names and
// colours of faces, and a search by names. Built once for a pack, by walks over its arrays.
#pragma once

#include "format/pack_image.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trimray {

struct ModelTreeNode {
    std::string label;              // its name, or one made up: never empty
    bool named = false;             // in the file
    std::optional<uint> color_rgba; // its own, sRGB, R in the low byte
    uint parent = 0;                // the root is its own
    uint depth = 0;                 // the root's is 0
    // of its whole subtree; a face counts as often as it is placed
    uint64_t placements = 0, faces = 0;
};

class ModelTree {
public:
    /// Domain: a validated image, which must outlive it. A pack without a tree gets a root that holds all placements.
    explicit ModelTree(const PackImage& image);

    /// Node 0 is the root; parents come before their children.
    std::span<const ModelTreeNode> nodes() const { return nodes_; }
    /// In the file's order.
    std::span<const uint> children(uint node) const { return list(children_, child_begin_, node); }
    /// The placements that are its own, by instance number.
    std::span<const uint> placements(uint node) const { return list(placements_, placement_begin_, node); }
    /// Those of its whole subtree, ascending.
    std::vector<uint> placements_below(uint node) const;

    /// By node: how many placements of its subtree are marked; empty `marked`: all are.
    std::vector<uint64_t> count_below(std::span<const uint8_t> marked) const;

    uint node_of(uint instance) const;
    /// From the root to the node: what has to be open to see it.
    std::vector<uint> path_to(uint node) const;

    /// A placement's name, else its part's label.
    std::string placement_label(uint instance) const;
    /// A part's name, or "Part 3", counted from 1.
    std::string part_label(uint part) const;
    /// A face's name, or "Face 4 (torus)" by its number in the pack.
    std::string face_label(uint face) const;

    /// sRGB, R in the low byte: a face's own; that of a placement as it is seen: what all of its faces have, else its
    /// own.
    std::optional<uint> face_color(uint face) const;
    std::optional<uint> placement_color(uint instance) const;

    /// The nodes, ascending, whose label, or that of a placement or part placed right under them, has `text` in it.
    /// Letters of the Latin, Greek and Cyrillic alphabets match in either case. An empty text matches nothing.
    std::vector<uint> search(std::string_view text) const;

private:
    static std::span<const uint> list(const std::vector<uint>& all, const std::vector<uint>& begin, uint node)
    {
        return std::span(all).subspan(begin[node], begin[node + 1] - begin[node]);
    }
    std::string label_of(uint node) const;

    const PackImage& image_;
    std::vector<ModelTreeNode> nodes_;
    std::vector<uint> children_, child_begin_;       // of node i: children_[child_begin_[i] ... child_begin_[i + 1]]
    std::vector<uint> placements_, placement_begin_; // likewise
    std::vector<uint> part_color_;                   // that all of its faces have; 0: there is none such
};

/// UTF-8 with capital letters of the Latin (to U+017F), Greek and Cyrillic alphabets made small.
std::string small_letters(std::string_view text);

} // namespace trimray
