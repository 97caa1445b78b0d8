// The lines of a model's tree as a panel lists them: those that are open to view, or those that a search has found.
#pragma once

#include "runtime/view/model_tree.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace trimray {

struct TreeRow {
    enum class Kind {
        Node,      // an assembly, or a part that is placed once and has no other line
        Placement, // one of several of its node
        Face,
    };
    Kind kind = Kind::Node;
    uint node = 0;
    std::optional<uint> placement; // that it is, or that its face is of; none: an assembly
    uint face = 0;                 // of a Face
    uint depth = 0;
    bool can_open = false, is_open = false;
};

class TreeRows {
public:
    /// The root is open, and what is alone below it down to the first choice. Both must outlive it.
    TreeRows(const ModelTree& tree, const PackImage& image);

    std::span<const TreeRow> rows();
    /// Domain: a row of rows().
    void set_open(const TreeRow& row, bool open);
    /// Lists nodes that match, whatever is open, and what they are in; empty: no search.
    void search(const std::string& text);
    const std::string& searched() const { return text_; }
    size_t found() const { return found_.size(); }
    /// All that is below what was found, ascending; below the root only where nothing else was found.
    std::vector<uint> found_placements() const;
    /// Opens what has to be open for a placement to be seen, or one of its faces; ends a search that leaves it out.
    /// Returns the index of its row.
    size_t reveal(uint placement, std::optional<uint> face);

    std::string label(const TreeRow& row) const;
    std::optional<uint> color_rgba(const TreeRow& row) const;
    /// All that the row stands for, ascending.
    std::vector<uint> placements(const TreeRow& row) const;

private:
    bool is_merged(uint node) const { return tree_.placements(node).size() == 1 && tree_.children(node).empty(); }
    void add_tree();
    void add_placement(TreeRow row);

    const ModelTree& tree_;
    const PackImage& image_;
    std::vector<bool> open_nodes_;
    std::set<uint> open_placements_;
    std::string text_;
    std::vector<uint> found_;       // nodes
    std::vector<bool> shows_found_; // by node: it is found, or in it something is
    bool outdated_ = true;
    std::vector<TreeRow> rows_;
};

} // namespace trimray
