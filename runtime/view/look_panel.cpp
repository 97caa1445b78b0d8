#include "runtime/camera_frame.h"
#include "runtime/view/panels.h"
#include "runtime/view/widgets.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace trimray {
namespace {

/// The direction that a map is about: an axis, or that of the view at hand.
bool edit_direction(const char* what, std::array<double, 3>& direction, const Camera& camera)
{
    ImGui::AlignTextToFramePadding();
    text(what);
    bool changed = false;
    constexpr const char* kNames[] = {"x", "y", "z"};
    for (size_t axis = 0; axis < 3; ++axis) {
        std::array<double, 3> along{};
        along[axis] = 1;
        ImGui::SameLine();
        if (ImGui::RadioButton(kNames[axis], direction == along)) {
            direction = along;
            changed = true;
        }
    }
    ImGui::SameLine();
    if (ImGui::Button("as seen")) {
        using namespace camera_math;
        direction = camera_axes(camera).forward * -1;
        changed = true;
    }
    return changed;
}

bool edit_map(SurfaceMapLook& map, const Camera& camera)
{
    const bool striped = map.map == SurfaceMap::Zebra || map.map == SurfaceMap::Isophotes;
    if (!striped && map.map != SurfaceMap::Draft)
        return false;
    bool changed = edit_direction(striped ? "stripes about" : "pulled along", map.direction, camera);
    if (striped) {
        int stripes = int(map.stripes);
        if (ImGui::SliderInt("stripes", &stripes, 2, 64)) {
            map.stripes = uint32_t(std::clamp(stripes, 1, 256));
            changed = true;
        }
    } else {
        constexpr double kLeast = 0, kMost = 45;
        changed |=
            ImGui::SliderScalar("draft angle", ImGuiDataType_Double, &map.draft_deg, &kLeast, &kMost, "%.1f deg");
        map.draft_deg = std::clamp(map.draft_deg, kLeast, kMost);
    }
    return changed;
}

} // namespace

void draw_look_panel(Viewer& viewer, float scale)
{
    const PictureRect& rect = viewer.picture_rect();
    ImGui::SetNextWindowPos({float(rect.x) + 10 * scale, float(rect.y) + 10 * scale});
    ImGui::SetNextWindowSizeConstraints({0, 0},
                                        {float(rect.width), std::max(float(rect.height) - 20 * scale, 6 * em())});
    ImGui::SetNextWindowBgAlpha(0.92f);
    ImGui::Begin("look", nullptr, kPanel | ImGuiWindowFlags_AlwaysAutoResize);
    ImGui::PushItemWidth(12 * em());
    ViewState& state = viewer.state();
    SceneRequest& look = state.look;
    bool changed = false;
    ImGui::TextDisabled("Drawing");
    EdgeLines lines = look.edges.value_or(EdgeLines::None);
    if (choose("lines", lines,
               {{EdgeLines::None, "none"}, {EdgeLines::Sharp, "sharp edges"}, {EdgeLines::All, "all edges"}})) {
        look.edges = lines;
        changed = true;
    }
    changed |= ImGui::SliderFloat("line width", &look.edge_width_px, 0.5f, 8, "%.1f px");
    bool outlines = look.silhouettes.value_or(false);
    if (ImGui::Checkbox("outlines", &outlines)) {
        look.silhouettes = outlines;
        changed = true;
    }
    ShadowKind shadows = look.shadows.value_or(ShadowKind::None);
    if (choose("shadows", shadows,
               {{ShadowKind::None, "none"}, {ShadowKind::Hard, "hard"}, {ShadowKind::Soft, "soft"}})) {
        look.shadows = shadows;
        changed = true;
    }
    int occlusion = int(look.look.occlusion.samples);
    if (ImGui::SliderInt("occlusion", &occlusion, 0, 64, "%d rays")) {
        look.look.occlusion.samples = uint32_t(std::max(occlusion, 0));
        changed = true;
    }
    bool through = look.look.xray.has_value();
    float opacity = look.look.xray.value_or(0.35f);
    const bool toggled = ImGui::Checkbox("see through", &through);
    if (through)
        ImGui::SameLine();
    if ((through && ImGui::SliderFloat("##opacity", &opacity, 0, 1, "%.2f")) || toggled) {
        look.look.xray = through ? std::optional(std::clamp(opacity, 0.0f, 1.0f)) : std::nullopt;
        changed = true;
    }
    changed |= choose("map", look.look.map.map,
                      {{SurfaceMap::None, "none"},
                       {SurfaceMap::Zebra, "zebra"},
                       {SurfaceMap::Isophotes, "isophotes"},
                       {SurfaceMap::CurvatureGaussian, "Gaussian curvature"},
                       {SurfaceMap::CurvatureMean, "mean curvature"},
                       {SurfaceMap::CurvatureMax, "largest curvature"},
                       {SurfaceMap::CurvatureMin, "smallest curvature"},
                       {SurfaceMap::Draft, "draft"}});
    changed |= edit_map(state.look.look.map, state.camera);
    if (viewer.model()) {
        changed |= edit_section(viewer);
        if (viewer.image().instances.size() > 1) {
            constexpr double kApart = 0, kFar = 3;
            changed |= ImGui::SliderScalar("apart", ImGuiDataType_Double, &look.look.arrangement.explode, &kApart,
                                           &kFar, "%.2f");
            look.look.arrangement.explode = std::max(look.look.arrangement.explode, 0.0);
        }
    }
    ImGui::Spacing();
    ImGui::TextDisabled("Accuracy");
    changed |= ImGui::SliderFloat("error", &state.error_px, 0.001f, 1, "%.3f px", ImGuiSliderFlags_Logarithmic);
    state.error_px = std::clamp(state.error_px, 0.001f, 1.0f);
    changed |= choose("trims", state.trim,
                      {{TrimMode::Auto, "the fastest that is right"},
                       {TrimMode::Exact, "exact"},
                       {TrimMode::Hybrid, "hybrid"},
                       {TrimMode::Sdf, "distance texture alone"},
                       {TrimMode::Kd, "kd-tree"}});
    changed |= choose("closest hit", state.closest,
                      {{ClosestPolicy::Certified, "certified"}, {ClosestPolicy::Stochastic, "stochastic"}});
    int samples = int(state.samples());
    if (ImGui::SliderInt("samples", &samples, 1, 4, fmt::format("{0} x {0} a pixel", samples).c_str())) {
        look.samples = uint32_t(std::clamp(samples, 1, 4));
        changed = true;
    }
    if (changed)
        viewer.changed(ImGui::IsMouseDown(ImGuiMouseButton_Left));
    ImGui::PopItemWidth();
    ImGui::End();
}

} // namespace trimray
