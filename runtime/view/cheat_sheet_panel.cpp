#include "runtime/view/panels.h"
#include "runtime/view/widgets.h"

#include <vector>

namespace trimray {

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
    constexpr int kColumns = 2;
    const size_t half = (rows.size() + kColumns - 1) / kColumns;
    if (ImGui::BeginTable("keys", 2 * kColumns, ImGuiTableFlags_SizingFixedFit)) {
        for (size_t i = 0; i < half; ++i) {
            ImGui::TableNextRow();
            for (size_t column = 0; column < kColumns; ++column) {
                const size_t at = column * half + i;
                if (at >= rows.size())
                    continue;
                ImGui::TableSetColumnIndex(int(2 * column));
                ImGui::TextColored({0.55f, 0.78f, 1, 1}, "%s", rows[at].keys.c_str());
                ImGui::TableSetColumnIndex(int(2 * column + 1));
                text(rows[at].what + "   ");
            }
        }
        ImGui::EndTable();
    }
    ImGui::End();
    ImGui::PopStyleVar();
}

} // namespace trimray
