#include "runtime/view/panels.h"
#include "runtime/view/widgets.h"

#include <algorithm>
#include <vector>

namespace trimray {
namespace {

constexpr const char* kGap = "   "; // behind what is said of a key

/// Of all rows below one another.
float column_width(const std::vector<CheatSheetRow>& rows)
{
    float keys = 0, what = 0;
    for (const CheatSheetRow& row : rows) {
        keys = std::max(keys, ImGui::CalcTextSize(row.keys.c_str()).x);
        what = std::max(what, ImGui::CalcTextSize((row.what + kGap).c_str()).x);
    }
    return keys + what + 2 * ImGui::GetStyle().ItemSpacing.x;
}

} // namespace

void draw_cheat_sheet(Viewer& viewer, int width, int height, float scale)
{
    ImGui::SetNextWindowPos({0.5f * float(width), 0.5f * float(height)}, 0, {0.5f, 0.5f});
    ImGui::SetNextWindowSizeConstraints({0, 0}, {0.96f * float(width), 0.96f * float(height)});
    ImGui::SetNextWindowBgAlpha(0.94f);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {16 * scale, 12 * scale});
    ImGui::Begin("cheat sheet", nullptr, kPanel | ImGuiWindowFlags_AlwaysAutoResize);
    ImGui::AlignTextToFramePadding();
    text("Keys and mouse as in");
    for (const Preset& preset : presets()) {
        ImGui::SameLine();
        if (ImGui::RadioButton(preset.title, &preset == &viewer.preset()))
            viewer.set_preset(preset);
    }
    const std::vector<CheatSheetRow> rows = cheat_sheet(viewer.preset());
    const size_t columns = 2 * column_width(rows) < 0.9f * float(width) ? 2 : 1;
    const size_t height_rows = (rows.size() + columns - 1) / columns;
    if (ImGui::BeginTable("keys", int(2 * columns), ImGuiTableFlags_SizingFixedFit)) {
        for (size_t i = 0; i < height_rows; ++i) {
            ImGui::TableNextRow();
            for (size_t column = 0; column < columns; ++column) {
                const size_t at = column * height_rows + i;
                if (at >= rows.size())
                    continue;
                ImGui::TableSetColumnIndex(int(2 * column));
                ImGui::TextColored({0.55f, 0.78f, 1, 1}, "%s", rows[at].keys.c_str());
                ImGui::TableSetColumnIndex(int(2 * column + 1));
                text(rows[at].what + kGap);
            }
        }
        ImGui::EndTable();
    }
    ImGui::End();
    ImGui::PopStyleVar();
}

} // namespace trimray
