#include "runtime/view/panels.h"
#include "runtime/view/widgets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trimray {

void draw_look_panel(Viewer& viewer, float scale)
{
    const PictureRect& rect = viewer.picture_rect();
    ImGui::SetNextWindowPos({float(rect.x) + 10 * scale, float(rect.y) + 10 * scale});
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
    if (viewer.model()) {
        const PackImage& image = viewer.image();
        bool cut = !look.look.section.planes.empty();
        if (ImGui::Checkbox("section", &cut))
            viewer.act(Action::ToggleSection);
        if (!look.look.section.planes.empty()) {
            SectionPlane& plane = look.look.section.planes.front();
            const auto leading = [&plane] {
                size_t axis = 0;
                for (size_t i = 1; i < 3; ++i)
                    if (std::abs(plane.normal[i]) > std::abs(plane.normal[axis]))
                        axis = i;
                return axis;
            };
            size_t axis = leading();
            for (size_t i = 0; i < 3; ++i) {
                ImGui::SameLine();
                constexpr const char* kNames[] = {"x", "y", "z"};
                if (ImGui::RadioButton(kNames[i], i == axis)) {
                    plane.normal = {0, 0, 0};
                    plane.normal[i] = -1;
                    axis = i;
                    changed = true;
                }
            }
            ImGui::SameLine();
            if (ImGui::Button("flip")) {
                for (double& c : plane.normal)
                    c = -c;
                changed = true;
            }
            const double lo = image.bounds_lo_mm[axis], hi = image.bounds_hi_mm[axis];
            changed |= ImGui::SliderScalar("at", ImGuiDataType_Double, &plane.point_mm[axis], &lo, &hi, "%.4g mm");
            changed |= choose("caps", look.look.section.caps,
                              {{CapStyle::None, "none"}, {CapStyle::Filled, "filled"}, {CapStyle::Hatched, "hatched"}});
        }
        if (image.instances.size() > 1) {
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
