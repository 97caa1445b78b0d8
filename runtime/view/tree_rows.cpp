#include "runtime/view/tree_rows.h"

#include <algorithm>

namespace trimray {

TreeRows::TreeRows(const ModelTree& tree, const PackImage& image)
    : tree_(tree), image_(image), open_nodes_(tree.nodes().size())
{
    uint node = 0;
    open_nodes_[0] = !is_merged(0);
    while (tree_.children(node).size() == 1 && tree_.placements(node).empty()) {
        node = tree_.children(node)[0];
        open_nodes_[node] = !is_merged(node);
    }
}

std::span<const TreeRow> TreeRows::rows()
{
    if (outdated_) {
        rows_.clear();
        if (text_.empty() || !found_.empty())
            add_tree();
        outdated_ = false;
    }
    return rows_;
}

// Without recursion: files may nest assemblies as deep as they like.
void TreeRows::add_tree()
{
    const bool searches = !text_.empty();
    std::vector<uint> waiting{0};
    while (!waiting.empty()) {
        const uint node = waiting.back();
        waiting.pop_back();
        const uint depth = tree_.nodes()[node].depth;
        const std::span<const uint> children = tree_.children(node), own = tree_.placements(node);
        if (is_merged(node)) {
            add_placement({.kind = TreeRow::Kind::Node, .node = node, .placement = own[0], .depth = depth});
            continue;
        }
        const bool open = (searches || open_nodes_[node]) && !(children.empty() && own.empty());
        rows_.push_back({.kind = TreeRow::Kind::Node,
                         .node = node,
                         .placement = {},
                         .depth = depth,
                         .can_open = !children.empty() || !own.empty(),
                         .is_open = open});
        if (!open)
            continue;
        // its own placements first: what is below them is a list, not a tree
        for (const uint placement : own)
            add_placement({.kind = TreeRow::Kind::Placement, .node = node, .placement = placement, .depth = depth + 1});
        for (size_t i = children.size(); i-- > 0;)
            if (!searches || shows_found_[children[i]])
                waiting.push_back(children[i]);
    }
}

void TreeRows::add_placement(TreeRow row)
{
    const PartRecord& part = image_.parts[image_.instances[*row.placement].part];
    row.can_open = part.face_count > 0;
    row.is_open = row.can_open && open_placements_.contains(*row.placement);
    rows_.push_back(row);
    if (!row.is_open)
        return;
    for (uint i = 0; i < part.face_count; ++i)
        rows_.push_back({.kind = TreeRow::Kind::Face,
                         .node = row.node,
                         .placement = row.placement,
                         .face = part.first_face + i,
                         .depth = row.depth + 1});
}

void TreeRows::set_open(const TreeRow& row, bool open)
{
    if (row.placement && open)
        open_placements_.insert(*row.placement);
    else if (row.placement)
        open_placements_.erase(*row.placement);
    else
        open_nodes_[row.node] = open;
    outdated_ = true;
}

void TreeRows::search(const std::string& text)
{
    if (text == text_)
        return;
    text_ = text;
    found_ = tree_.search(text);
    shows_found_.assign(tree_.nodes().size(), false);
    for (uint node : found_)
        for (; !shows_found_[node]; node = tree_.nodes()[node].parent)
            shows_found_[node] = true;
    outdated_ = true;
}

std::vector<uint> TreeRows::found_placements() const
{
    std::vector<uint> all;
    for (const uint node : found_) {
        if (node == 0 && found_.size() > 1)
            continue; // a model is often named by its parts: then they are meant
        const std::vector<uint> below = tree_.placements_below(node);
        all.insert(all.end(), below.begin(), below.end());
    }
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
}

size_t TreeRows::reveal(uint placement, std::optional<uint> face)
{
    const uint node = tree_.node_of(placement);
    if (!text_.empty() && !shows_found_[node])
        search("");
    for (const uint above : tree_.path_to(node))
        if (!is_merged(above))
            open_nodes_[above] = true;
    if (face)
        open_placements_.insert(placement);
    outdated_ = true;
    const std::span<const TreeRow> all = rows();
    const auto at = std::find_if(all.begin(), all.end(), [&](const TreeRow& row) {
        return row.placement == placement && (!face || (row.kind == TreeRow::Kind::Face && row.face == *face));
    });
    return size_t(at - all.begin());
}

std::string TreeRows::label(const TreeRow& row) const
{
    switch (row.kind) {
    case TreeRow::Kind::Face:
        return tree_.face_label(row.face);
    case TreeRow::Kind::Placement:
        return tree_.placement_label(*row.placement);
    case TreeRow::Kind::Node:
        break;
    }
    return tree_.nodes()[row.node].label;
}

std::optional<uint> TreeRows::color_rgba(const TreeRow& row) const
{
    if (row.kind == TreeRow::Kind::Face)
        return tree_.face_color(row.face);
    if (row.placement)
        return tree_.placement_color(*row.placement);
    return tree_.nodes()[row.node].color_rgba;
}

std::vector<uint> TreeRows::placements(const TreeRow& row) const
{
    return row.placement ? std::vector{*row.placement} : tree_.placements_below(row.node);
}

} // namespace trimray
