#include "runtime/camera_frame.h"
#include "runtime/view/panels.h"
#include "runtime/view/widgets.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace trimray {
namespace {

using namespace camera_math;

constexpr const char* kAxisNames[] = {"x", "y", "z"};

/// The axis that a normal lies along; nothing: it lies between them.
std::optional<size_t> axis_of(const Vec3& normal)
{
    const Vec3 unit = normalised(normal, {0, 0, 1});
    for (size_t axis = 0; axis < 3; ++axis)
        if (std::abs(unit[axis]) == 1)
            return axis;
    return std::nullopt;
}

/// Where it lies: along its axis, or along its own normal where that is none.
bool edit_offset(SectionPlane& plane, const PlacementView& placed)
{
    Vec3 along = normalised(plane.normal, {0, 0, 1});
    if (const std::optional<size_t> axis = axis_of(along))
        along[*axis] = 1;
    double lo = 0, hi = 0;
    for (size_t i = 0; i < 3; ++i) {
        lo += along[i] * (along[i] < 0 ? placed.bounds_hi_mm[i] : placed.bounds_lo_mm[i]);
        hi += along[i] * (along[i] < 0 ? placed.bounds_lo_mm[i] : placed.bounds_hi_mm[i]);
    }
    const double before = dot(along, plane.point_mm);
    double at = before;
    if (!ImGui::SliderScalar("##at", ImGuiDataType_Double, &at, &lo, &hi, "at %.4g mm"))
        return false;
    plane.point_mm = plane.point_mm + along * (at - before);
    return true;
}

bool edit_plane(SectionPlane& plane, const PlacementView& placed)
{
    bool changed = edit_offset(plane, placed);
    for (size_t axis = 0; axis < 3; ++axis) {
        ImGui::SameLine();
        if (ImGui::RadioButton(kAxisNames[axis], axis_of(plane.normal) == axis)) {
            plane.normal = section_through_middle(placed, axis).normal;
            changed = true;
        }
    }
    ImGui::SameLine();
    if (ImGui::Button("flip")) {
        plane.normal = plane.normal * -1;
        changed = true;
    }
    return changed;
}

} // namespace

bool edit_section(Viewer& viewer)
{
    SectionLook& section = viewer.state().look.look.section;
    const PlacementView placed = viewer.placed();
    bool cut = !section.planes.empty();
    if (ImGui::Checkbox("section", &cut))
        viewer.act(Action::ToggleSection);
    if (section.planes.empty())
        return false;
    bool changed = false;
    if (section.planes.size() < kMostSectionPlanes) {
        ImGui::SameLine();
        if (ImGui::Button("one more plane")) { // across the first axis that has none
            size_t axis = 0;
            while (axis < 2 && std::any_of(section.planes.begin(), section.planes.end(),
                                           [axis](const SectionPlane& p) { return axis_of(p.normal) == axis; }))
                ++axis;
            section.planes.push_back(section_through_middle(placed, axis));
            changed = true;
        }
    }
    ImGui::SameLine();
    ImGui::Checkbox("handles", &viewer.panels.handles);
    std::optional<size_t> taken_away;
    for (size_t i = 0; i < section.planes.size(); ++i) {
        ImGui::PushID(int(i));
        changed |= edit_plane(section.planes[i], placed);
        if (section.planes.size() > 1) {
            ImGui::SameLine();
            if (ImGui::Button("-"))
                taken_away = i;
        }
        ImGui::PopID();
    }
    if (taken_away) {
        section.planes.erase(section.planes.begin() + std::ptrdiff_t(*taken_away));
        changed = true;
    }
    changed |= choose("caps", section.caps,
                      {{CapStyle::None, "none"}, {CapStyle::Filled, "filled"}, {CapStyle::Hatched, "hatched"}});
    return changed;
}

void draw_section_handles(Viewer& viewer, float scale)
{
    const PictureRect& rect = viewer.picture_rect();
    const auto in_window = [&rect](const std::array<double, 2>& pixel) {
        return ImVec2{float(pixel[0]) + float(rect.x), float(pixel[1]) + float(rect.y)};
    };
    const std::optional<GrippedSection> grip = viewer.section_grip();
    ImDrawList* const list = ImGui::GetBackgroundDrawList();
    list->PushClipRect({float(rect.x), float(rect.y)}, {float(rect.x + rect.width), float(rect.y + rect.height)});
    constexpr ImU32 kQuiet = IM_COL32(255, 165, 60, 210), kHeld = IM_COL32(255, 225, 150, 255),
                    kShade = IM_COL32(0, 0, 0, 110);
    for (const SectionHandle& handle : viewer.section_handles()) {
        const bool held = grip && grip->handle.plane == handle.plane;
        const ImU32 moves = held && grip->grip == SectionGrip::Move ? kHeld : kQuiet;
        const ImU32 turns = held && grip->grip == SectionGrip::Turn ? kHeld : kQuiet;
        for (size_t i = 0; i < handle.rim_px.size(); ++i) {
            const ImVec2 a = in_window(handle.rim_px[i]), b = in_window(handle.rim_px[(i + 1) % handle.rim_px.size()]);
            list->AddLine(a, b, kShade, 3 * scale);
            list->AddLine(a, b, moves, 1.5f * scale);
        }
        const ImVec2 middle = in_window(handle.middle_px), tip = in_window(handle.tip_px);
        list->AddLine(middle, tip, kShade, 4.5f * scale);
        list->AddLine(middle, tip, moves, 2.5f * scale);
        list->AddCircleFilled(middle, 4 * scale, moves);
        list->AddCircleFilled(tip, 7.5f * scale, kShade);
        list->AddCircleFilled(tip, 6 * scale, turns);
    }
    list->PopClipRect();
}

} // namespace trimray
