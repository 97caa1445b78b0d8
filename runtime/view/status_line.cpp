#include "runtime/effect_plan.h"
#include "runtime/view/panels.h"
#include "runtime/view/widgets.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <string>

namespace trimray {

namespace {
namespace fs = std::filesystem;
} // namespace

float status_line_height(float scale)
{
    return std::round(ImGui::GetFrameHeight() + 4 * scale);
}

void draw_status_line(Viewer& viewer, int width, int height, float scale)
{
    const float tall = status_line_height(scale);
    ImGui::SetNextWindowPos({0, float(height) - tall});
    ImGui::SetNextWindowSize({float(width), tall});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {8 * scale, 4 * scale});
    ImGui::Begin("status", nullptr, kBare);
    std::string line;
    const LoadedModel* model = viewer.model();
    if (model) {
        line = fs::path(model->file).filename().string();
        if (viewer.files().size() > 1)
            line += fmt::format(" ({} of {})", viewer.file_index() + 1, viewer.files().size());
        if (const size_t hidden = viewer.hidden_count(); hidden > 0)
            line += fmt::format("   {} hidden", hidden);
    }
    const std::optional<PickedPoint> point = viewer.hovered();
    if (const std::optional<SurfaceFacts>& facts = viewer.measured().last; model && !point && facts) {
        line += fmt::format(
            "   {}{}face {} ({}{})   uv {:.9g} {:.9g}   at {:.9g}, {:.9g}, {:.9g} mm   normal {:.4f} {:.4f} {:.4f}",
            facts->part_name, facts->part_name.empty() ? "" : ", ", facts->face, facts->kind_name,
            facts->radius_mm ? ", radius " + length_text(*facts->radius_mm, viewer.unit) : "", facts->uv_file[0],
            facts->uv_file[1], facts->point_mm[0], facts->point_mm[1], facts->point_mm[2], facts->normal[0],
            facts->normal[1], facts->normal[2]);
    }
    if (model && point && point->face >= 0) {
        const PackImage& image = viewer.image();
        const FaceRecord& face = image.faces[size_t(point->face)];
        const std::string& part = image.strings.strings[image.parts[face.part].name];
        line += fmt::format("   {}{}face {} ({})   uv {:.5g} {:.5g}   at {:.6g}, {:.6g}, {:.6g} mm", part,
                            part.empty() ? "" : ", ", point->face, surface_kind_name(face.surface_kind), point->uv[0],
                            point->uv[1], point->point_mm[0], point->point_mm[1], point->point_mm[2]);
    }
    text(line);
    const std::string keys = "H: keys";
    ImGui::SameLine(float(width) - ImGui::CalcTextSize(keys.c_str()).x - 10 * scale);
    ImGui::TextDisabled("%s", keys.c_str());
    ImGui::End();
    ImGui::PopStyleVar();
}

} // namespace trimray
