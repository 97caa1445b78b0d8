#include "runtime/view/panels.h"
#include "runtime/view/widgets.h"

#include <fmt/format.h>

#include <algorithm>

#include <vector>

namespace trimray {

void draw_measure_panel(Viewer& viewer, float scale)
{
    const PictureRect& rect = viewer.picture_rect();
    ImGui::SetNextWindowPos({float(rect.x + rect.width) - 10 * scale, float(rect.y) + 8 * em()}, 0, {1, 0});
    ImGui::SetNextWindowSizeConstraints({0, 0}, {float(rect.width), std::max(float(rect.height) - 9 * em(), 6 * em())});
    ImGui::SetNextWindowBgAlpha(0.92f);
    ImGui::Begin("measure", nullptr, kPanel | ImGuiWindowFlags_AlwaysAutoResize);
    ImGui::PushItemWidth(7 * em());
    choose("unit", viewer.unit,
           {{LengthUnit::Millimetre, "mm"},
            {LengthUnit::Centimetre, "cm"},
            {LengthUnit::Metre, "m"},
            {LengthUnit::Inch, "inch"}});
    ImGui::PopItemWidth();
    const MeasuredPicks& picks = viewer.measured();
    const auto list = [&](const char* heading, const std::vector<Dimension>& dimensions) {
        if (dimensions.empty())
            return;
        ImGui::TextDisabled("%s", heading);
        for (const Dimension& dimension : dimensions)
            text(fmt::format("{}: {}", name_of(dimension.kind), to_text(dimension, viewer.unit)));
    };
    if (!picks.last)
        ImGui::TextDisabled("Click a face, then another.");
    else {
        list("this face", dimensions_of(*picks.last));
        if (picks.edge)
            list("its nearest edge", dimensions_of(picks.edge->facts));
        if (picks.before)
            list("from the face before", dimensions_between(*picks.before, *picks.last));
    }
    ImGui::End();
}

} // namespace trimray
