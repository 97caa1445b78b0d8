#include "runtime/camera_frame.h"
#include "runtime/view/panels.h"
#include "runtime/view/widgets.h"

#include <algorithm>
#include <array>

namespace trimray {
namespace {

struct CubeSide {
    std::array<double, 3> normal, right, up; // of its writing
    const char* label;
    const char* view;
};
constexpr CubeSide kSides[] = {
    {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}, "FRONT", "front"}, {{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}, "BACK", "back"},
    {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, "RIGHT", "right"},  {{-1, 0, 0}, {0, -1, 0}, {0, 0, 1}, "LEFT", "left"},
    {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, "TOP", "top"},      {{0, 0, -1}, {1, 0, 0}, {0, 1, 0}, "BOTTOM", "bottom"},
};

bool is_inside(const ImVec2 (&quad)[4], ImVec2 p)
{
    int turns = 0;
    for (int i = 0; i < 4; ++i) {
        const ImVec2 a = quad[i], b = quad[(i + 1) % 4];
        turns += (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) > 0 ? 1 : -1;
    }
    return turns == 4 || turns == -4;
}

} // namespace

void draw_view_cube(Viewer& viewer, float scale)
{
    if (!viewer.model() && !viewer.early())
        return;
    using namespace camera_math;
    const PictureRect& rect = viewer.picture_rect();
    const float size = 6.5f * em();
    ImGui::SetNextWindowPos({float(rect.x + rect.width) - size - 8 * scale, float(rect.y) + 8 * scale});
    ImGui::SetNextWindowSize({size, size});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {0, 0});
    ImGui::Begin("cube", nullptr, kBare | ImGuiWindowFlags_NoBackground);
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    const ImVec2 middle{corner.x + 0.5f * size, corner.y + 0.5f * size};
    const bool clicked = ImGui::InvisibleButton("cube", {size, size});
    const bool hovered = ImGui::IsItemHovered();
    const ImVec2 pointer = ImGui::GetIO().MousePos;
    const CameraAxes axes = camera_axes(viewer.state().camera);
    const auto on_screen = [&](const Vec3& p) {
        const float half = 0.29f * size; // a corner of the cube, seen from a corner, is within the square
        return ImVec2{middle.x + half * float(dot(p, axes.right)), middle.y - half * float(dot(p, axes.up))};
    };
    ImDrawList* list = ImGui::GetWindowDrawList();
    for (const CubeSide& side : kSides) {
        const double facing = -dot(side.normal, axes.forward);
        if (facing <= 0.02)
            continue;
        ImVec2 quad[4];
        constexpr double kCorners[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
        for (int i = 0; i < 4; ++i)
            quad[i] = on_screen(side.normal + side.right * kCorners[i][0] + side.up * kCorners[i][1]);
        const bool under = hovered && is_inside(quad, pointer);
        const int light = int(90 + 90 * facing);
        list->AddQuadFilled(quad[0], quad[1], quad[2], quad[3],
                            under ? IM_COL32(90, 150, 220, 235) : IM_COL32(light, light + 4, light + 10, 225));
        list->AddQuad(quad[0], quad[1], quad[2], quad[3], IM_COL32(20, 24, 30, 255), scale);
        if (facing > 0.35) {
            const float font = 0.72f * em();
            const ImVec2 words = ImGui::GetFont()->CalcTextSizeA(font, 1e9f, 0, side.label);
            const ImVec2 at = on_screen(side.normal);
            list->AddText(ImGui::GetFont(), font, {at.x - 0.5f * words.x, at.y - 0.5f * words.y},
                          IM_COL32(15, 18, 22, 255), side.label);
        }
        if (clicked && under)
            viewer.look_from(side.view);
    }
    constexpr struct {
        Vec3 along;
        ImU32 color;
        const char* name;
    } kAxes[] = {{{1, 0, 0}, IM_COL32(235, 90, 80, 255), "x"},
                 {{0, 1, 0}, IM_COL32(110, 200, 90, 255), "y"},
                 {{0, 0, 1}, IM_COL32(90, 140, 245, 255), "z"}};
    for (const auto& axis : kAxes) {
        const Vec3 from{-1.05, -1.05, -1.05};
        const ImVec2 a = on_screen(from), b = on_screen(from + axis.along * 2.25);
        list->AddLine(a, b, axis.color, 2 * scale);
        const float font = 0.85f * em();
        const ImVec2 letter = ImGui::GetFont()->CalcTextSizeA(font, 1e9f, 0, axis.name);
        list->AddText(ImGui::GetFont(), font,
                      {std::clamp(b.x + 2 * scale, corner.x, corner.x + size - letter.x),
                       std::clamp(b.y - 0.5f * em(), corner.y, corner.y + size - letter.y)},
                      axis.color, axis.name);
    }
    ImGui::End();
    ImGui::PopStyleVar();
}

} // namespace trimray
