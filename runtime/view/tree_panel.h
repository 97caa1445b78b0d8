// The panel with the model's tree: names, colours, counts, boxes that hide and show, and a search. A click selects in
// the picture what a line stands for, and a click in the picture shows its line.
#pragma once

#include "runtime/view/tree_rows.h"
#include "runtime/view/viewer.h"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace trimray {

class TreePanel {
public:
    /// Along the window's left side, from `top`, `height` high, at most `widest` wide. Returns how wide it is.
    float draw(Viewer& viewer, float top, float height, float widest, float scale);

private:
    void follow(Viewer& viewer);
    void draw_search(Viewer& viewer);
    void draw_rows(Viewer& viewer);
    void draw_row(Viewer& viewer, const TreeRow& row);
    void draw_box(Viewer& viewer, const TreeRow& row);
    void choose_row(Viewer& viewer, const TreeRow& row, bool adds);
    bool is_selected(const Viewer& viewer, const TreeRow& row) const;

    float width_ = 0;    // 0: not drawn yet
    uint64_t model_ = 0; // whose rows these are; 0: nobody's
    const ModelTree* tree_ = nullptr;
    std::optional<TreeRows> rows_;
    std::vector<uint64_t> shown_; // by node: how many of its placements are visible
    uint64_t arrangement_ = 0, selection_ = 0;
    std::optional<uint> node_; // that the selection was made from
    std::optional<size_t> scroll_to_;
    std::array<char, 256> text_{};
};

} // namespace trimray
