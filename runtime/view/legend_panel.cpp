#include "runtime/view/map_legend.h"
#include "runtime/view/panels.h"
#include "runtime/view/widgets.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace trimray {
namespace {

ImU32 color_of(const LegendStop& stop)
{
    return IM_COL32(stop.srgb[0], stop.srgb[1], stop.srgb[2], 255);
}

/// What the map measures under the pointer.
std::optional<double> value_under_pointer(const Viewer& viewer)
{
    const ShownPicture* hits = viewer.hits();
    const ShownPicture* shown = viewer.shown();
    const PictureRect& rect = viewer.picture_rect();
    const ImVec2 pointer = ImGui::GetIO().MousePos;
    if (!hits || !shown || hits->order != shown->order || hits->frame.map_value.empty())
        return std::nullopt;
    const double x = (double(pointer.x) - rect.x) / rect.width, y = (double(pointer.y) - rect.y) / rect.height;
    if (!(x >= 0 && x < 1 && y >= 0 && y < 1))
        return std::nullopt;
    const size_t at = size_t(y * hits->frame.height) * hits->frame.width + size_t(x * hits->frame.width);
    if (hits->frame.face[at] < 0)
        return std::nullopt;
    return hits->frame.map_value[at];
}

/// Where a value stands on the scale: its stops ascend, as values do where they mean one.
std::optional<double> position_of(const MapLegend& legend, double value)
{
    const auto& stops = legend.stops;
    if (stops.empty() || !(stops.front().value < stops.back().value))
        return std::nullopt;
    if (value <= stops.front().value)
        return 0;
    for (size_t i = 1; i < stops.size(); ++i)
        if (value <= stops[i].value && stops[i].value > stops[i - 1].value)
            return stops[i - 1].position + (stops[i].position - stops[i - 1].position) * (value - stops[i - 1].value) /
                                               (stops[i].value - stops[i - 1].value);
    return 1;
}

} // namespace

void draw_legend_panel(Viewer& viewer, float scale)
{
    const SurfaceMapLook& map = viewer.state().look.look.map;
    if (!viewer.model() || map.map == SurfaceMap::None)
        return;
    const MapLegend legend = map_legend(viewer.image(), map);
    const PictureRect& rect = viewer.picture_rect();
    // where no other panel is
    const float middle = float(rect.y) + 0.5f * float(rect.height);
    if (viewer.panels.costs)
        ImGui::SetNextWindowPos({float(rect.x) + (viewer.panels.look ? 24 * em() : 10 * scale), middle}, 0, {0, 0.5f});
    else
        ImGui::SetNextWindowPos({float(rect.x + rect.width) - 10 * scale, middle}, 0, {1, 0.5f});
    ImGui::SetNextWindowBgAlpha(0.85f);
    ImGui::Begin("legend", nullptr, kBare | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoInputs);
    text(legend.unit.empty() ? legend.title : fmt::format("{}, {}", legend.title, legend.unit));
    const float width = 1.6f * em(), height = 14 * em();
    float wide = 0;
    for (const std::vector<LegendLabel>* labels : {&legend.ticks, &legend.names})
        for (const LegendLabel& label : *labels)
            wide = std::max(wide, ImGui::CalcTextSize(label.text.c_str()).x);
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    const float top = corner.y + 0.6f * em(), mark = 0.8f * em();
    const auto down = [&](double position) { return top + float(1 - position) * height; };
    ImGui::Dummy({mark + width + 0.8f * em() + wide, height + 1.2f * em()});
    ImDrawList* list = ImGui::GetWindowDrawList();
    const float left = corner.x + mark, right = left + width;
    for (size_t i = 1; i < legend.stops.size(); ++i) {
        const LegendStop &a = legend.stops[i - 1], &b = legend.stops[i];
        if (b.position > a.position)
            list->AddRectFilledMultiColor({left, down(b.position)}, {right, down(a.position)}, color_of(b), color_of(b),
                                          color_of(a), color_of(a));
    }
    list->AddRect({left, top}, {right, top + height}, IM_COL32(10, 12, 15, 255), 0, 0, hairline());
    const ImU32 words = ImGui::GetColorU32(ImGuiCol_Text);
    for (const LegendLabel& tick : legend.ticks) {
        list->AddLine({right, down(tick.position)}, {right + 0.4f * em(), down(tick.position)}, words, hairline());
        list->AddText({right + 0.6f * em(), down(tick.position) - 0.5f * em()}, words, tick.text.c_str());
    }
    for (const LegendLabel& name : legend.names)
        list->AddText({right + 0.6f * em(), down(name.position) - 0.5f * em()}, words, name.text.c_str());
    if (const std::optional<double> value = value_under_pointer(viewer)) {
        if (const std::optional<double> position = position_of(legend, *value)) {
            const float y = down(*position);
            list->AddTriangleFilled({left - mark, y - 0.4f * em()}, {left, y}, {left - mark, y + 0.4f * em()},
                                    IM_COL32(255, 170, 60, 255));
        }
        text(fmt::format("here {:.4g}{}{}", *value, legend.unit.empty() ? "" : " ", legend.unit));
    } else
        text(" ");
    if (!legend.note.empty()) {
        ImGui::PushTextWrapPos(14 * em());
        ImGui::TextDisabled("%s", legend.note.c_str());
        ImGui::PopTextWrapPos();
    }
    ImGui::End();
}

} // namespace trimray
