#include "runtime/view/tree_panel.h"

#include "runtime/view/widgets.h"

#include <fmt/format.h>

#include <algorithm>

namespace trimray {
namespace {

ImVec4 color_of(uint rgba)
{
    const auto part = [rgba](int shift) { return float(rgba >> shift & 255u) / 255.0f; };
    return {part(0), part(8), part(16), 1};
}

/// A strip along the panel's right side that makes it wider and narrower.
void draw_splitter(float& width, float least, float most, float scale)
{
    const float thick = 5 * scale;
    const ImVec2 size = ImGui::GetWindowSize();
    ImGui::SetCursorPos({size.x - thick, 0});
    ImGui::InvisibleButton("width", {thick, size.y});
    if (ImGui::IsItemActive())
        width += ImGui::GetIO().MouseDelta.x;
    if (ImGui::IsItemHovered() || ImGui::IsItemActive()) {
        const ImVec2 lo = ImGui::GetItemRectMin(), hi = ImGui::GetItemRectMax();
        ImGui::GetWindowDrawList()->AddRectFilled({hi.x - 2 * scale, lo.y}, hi, IM_COL32(70, 130, 200, 255));
    }
    width = std::clamp(width, least, std::max(least, most));
}

} // namespace

float TreePanel::draw(Viewer& viewer, float top, float height, float widest, float scale)
{
    if (width_ == 0)
        width_ = std::min(18 * em(), widest);
    const float width = std::round(width_);
    ImGui::SetNextWindowPos({0, top});
    ImGui::SetNextWindowSize({width, height});
    ImGui::Begin("tree", nullptr, kPanel | ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoScrollWithMouse);
    if (viewer.model()) {
        follow(viewer);
        draw_search(viewer);
        ImGui::BeginChild("rows", {width - ImGui::GetCursorPosX() - 6 * scale, 0}, false,
                          ImGuiWindowFlags_HorizontalScrollbar);
        draw_rows(viewer);
        ImGui::EndChild();
    }
    draw_splitter(width_, 8 * em(), widest, scale);
    ImGui::End();
    return width;
}

// What happened elsewhere: another model, something picked in the picture, parts hidden by a key.
void TreePanel::follow(Viewer& viewer)
{
    if (model_ != viewer.model_count()) {
        model_ = viewer.model_count();
        tree_ = &viewer.tree();
        rows_.emplace(*tree_, viewer.image());
        rows_->search(text_.data());
        node_.reset();
        shown_.clear();
        selection_ = 0;
    }
    const std::span<const uint8_t> visible = viewer.visible();
    if (shown_.empty() || arrangement_ != viewer.arrangement_count()) {
        shown_ = tree_->count_below(visible);
        arrangement_ = viewer.arrangement_count();
    }
    if (selection_ == viewer.selection_count())
        return;
    selection_ = viewer.selection_count();
    node_.reset();
    if (const Selection& selection = viewer.selection(); !selection.empty()) {
        // a click in the picture means the part first: its faces are listed where it is open already
        scroll_to_ = rows_->reveal(selection.placements.front(), {});
    }
}

void TreePanel::draw_search(Viewer& viewer)
{
    ImGui::SetNextItemWidth(-0.4f * em());
    if (std::exchange(viewer.panels.wants_search, false))
        ImGui::SetKeyboardFocusHere();
    if (ImGui::InputTextWithHint("##search", "search", text_.data(), text_.size()))
        rows_->search(text_.data());
    if (ImGui::IsItemDeactivated() && ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Enter)))
        viewer.select(rows_->found_placements());
    if (!rows_->searched().empty())
        ImGui::TextDisabled("%s", rows_->found() == 0
                                      ? "nothing has this name"
                                      : fmt::format("{} found; Enter selects them", rows_->found()).c_str());
    if (const size_t hidden = viewer.hidden_count(); hidden > 0) {
        ImGui::AlignTextToFramePadding();
        ImGui::TextDisabled("%s", fmt::format("{} hidden", hidden).c_str());
        ImGui::SameLine();
        if (ImGui::SmallButton("show all"))
            viewer.act(Action::ShowAll);
    }
}

void TreePanel::draw_rows(Viewer& viewer)
{
    const std::vector<TreeRow> rows(rows_->rows().begin(), rows_->rows().end()); // a click may change them
    const float height = ImGui::GetTextLineHeightWithSpacing();
    if (const std::optional<size_t> row = std::exchange(scroll_to_, std::nullopt)) {
        const float at = float(*row) * height, seen = ImGui::GetWindowHeight();
        if (at < ImGui::GetScrollY() || at + height > ImGui::GetScrollY() + seen)
            ImGui::SetScrollY(std::max(0.0f, at - 0.4f * seen));
    }
    ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {0, 0});
    ImGuiListClipper clipper;
    clipper.Begin(int(rows.size()), height);
    while (clipper.Step())
        for (int i = clipper.DisplayStart; i < clipper.DisplayEnd; ++i) {
            ImGui::PushID(i);
            draw_row(viewer, rows[size_t(i)]);
            ImGui::PopID();
        }
    ImGui::PopStyleVar();
}

void TreePanel::draw_row(Viewer& viewer, const TreeRow& row)
{
    const float side = ImGui::GetTextLineHeight();
    ImGui::SetCursorPosX(ImGui::GetCursorPosX() + float(row.depth) * 0.8f * em());
    if (row.can_open) {
        ImGui::PushStyleColor(ImGuiCol_Button, 0);
        if (ImGui::ArrowButton("open", row.is_open ? ImGuiDir_Down : ImGuiDir_Right))
            rows_->set_open(row, !row.is_open);
        ImGui::PopStyleColor();
    } else
        ImGui::Dummy({side, side});
    ImGui::SameLine(0, 0.25f * em());
    if (row.placement ? row.kind != TreeRow::Kind::Face : tree_->nodes()[row.node].placements > 0) {
        draw_box(viewer, row);
        ImGui::SameLine(0, 0.4f * em());
    }
    if (const std::optional<uint> color = rows_->color_rgba(row)) {
        const ImVec2 at = ImGui::GetCursorScreenPos();
        ImGui::GetWindowDrawList()->AddRectFilled({at.x, at.y + 0.15f * side},
                                                  {at.x + 0.7f * side, at.y + 0.85f * side},
                                                  ImGui::GetColorU32(color_of(*color)), 0.13f * em());
        ImGui::Dummy({0.7f * side, side});
        ImGui::SameLine(0, 0.4f * em());
    }
    const bool shown =
        row.placement ? viewer.visible().empty() || viewer.visible()[*row.placement] != 0 : shown_[row.node] > 0;
    if (!shown)
        ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
    std::string label = rows_->label(row);
    if (!row.placement && tree_->nodes()[row.node].placements > 1)
        label += fmt::format("  ({})", tree_->nodes()[row.node].placements);
    const ImVec2 wide{std::max(ImGui::CalcTextSize(label.c_str()).x, ImGui::GetContentRegionAvail().x), 0};
    if (ImGui::Selectable((label + "###row").c_str(), is_selected(viewer, row), ImGuiSelectableFlags_AllowDoubleClick,
                          wide))
        choose_row(viewer, row, ImGui::GetIO().KeyCtrl);
    if (!shown)
        ImGui::PopStyleColor();
    if (ImGui::IsItemHovered() && ImGui::GetItemRectMax().x > ImGui::GetWindowPos().x + ImGui::GetWindowWidth())
        ImGui::SetTooltip("%s", label.c_str());
    std::optional<Action> chosen;
    if (ImGui::BeginPopupContextItem("menu")) {
        if (ImGui::IsWindowAppearing() && !is_selected(viewer, row))
            choose_row(viewer, row, false);
        for (const Action action :
             {Action::FitSelection, Action::IsolateSelection, Action::HideSelection, Action::ShowAll})
            if (ImGui::MenuItem(action_text(action).what, chords_of(viewer.preset(), action).c_str()))
                chosen = action;
        ImGui::EndPopup();
    }
    if (chosen)
        viewer.act(*chosen);
}

void TreePanel::draw_box(Viewer& viewer, const TreeRow& row)
{
    const uint64_t all = row.placement ? 1 : tree_->nodes()[row.node].placements;
    const uint64_t shown =
        row.placement ? viewer.visible().empty() || viewer.visible()[*row.placement] != 0 : shown_[row.node];
    int bits = shown == 0 ? 0 : shown == all ? 3 : 1; // one of two: the box is neither full nor empty
    if (ImGui::CheckboxFlags("##shown", &bits, 3))
        viewer.show(rows_->placements(row), shown != all);
}

void TreePanel::choose_row(Viewer& viewer, const TreeRow& row, bool adds)
{
    if (row.kind == TreeRow::Kind::Face && !adds)
        viewer.select_face(*row.placement, row.face);
    else
        viewer.select(rows_->placements(row), adds);
    selection_ = viewer.selection_count(); // the lines stay where they are
    node_ = row.placement ? std::nullopt : std::optional(row.node);
    if (ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left))
        viewer.act(Action::FitSelection);
}

bool TreePanel::is_selected(const Viewer& viewer, const TreeRow& row) const
{
    if (!row.placement)
        return node_ == row.node;
    const Selection& selection = viewer.selection();
    if (!selection.has(*row.placement))
        return false;
    return row.kind == TreeRow::Kind::Face ? selection.face == row.face : !selection.face || !row.is_open;
}

} // namespace trimray
