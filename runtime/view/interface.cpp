#include "runtime/view/interface.h"

#include "runtime/camera_frame.h"
#include "runtime/command_trace.h"
#include "runtime/effect_plan.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

namespace trimray {
namespace {
namespace fs = std::filesystem;

constexpr ImGuiWindowFlags kBare = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav |
                                   ImGuiWindowFlags_NoFocusOnAppearing;
constexpr ImGuiWindowFlags kPanel = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                                    ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings |
                                    ImGuiWindowFlags_NoNav;

void text(const std::string& words)
{
    ImGui::TextUnformatted(words.data(), words.data() + words.size());
}

ImVec2 corner_of(const PictureRect& rect)
{
    return {float(rect.x), float(rect.y)};
}

ImTextureID texture_of(const GlPicture& picture)
{
    return reinterpret_cast<ImTextureID>(static_cast<uintptr_t>(picture.texture()));
}

/// What is selected, as a picture to lay over the one that is shown: the placement tinted, its outline bright, the face
/// itself brighter.
Picture selection_overlay(const Frame& frame, const PickedPoint& selected)
{
    Picture overlay{frame.width, frame.height, std::vector<uint8_t>(size_t(frame.width) * frame.height * 4)};
    const auto inside = [&](uint32_t x, uint32_t y) {
        return frame.instance[size_t(y) * frame.width + x] == selected.instance;
    };
    for (uint32_t y = 0; y < frame.height; ++y)
        for (uint32_t x = 0; x < frame.width; ++x) {
            const size_t at = size_t(y) * frame.width + x;
            if (!inside(x, y))
                continue;
            const bool rim = (x > 0 && !inside(x - 1, y)) || (x + 1 < frame.width && !inside(x + 1, y)) ||
                             (y > 0 && !inside(x, y - 1)) || (y + 1 < frame.height && !inside(x, y + 1));
            const bool face = frame.face[at] == selected.face;
            uint8_t* const pixel = &overlay.rgba[4 * at];
            pixel[0] = 255;
            pixel[1] = rim ? 170 : 140;
            pixel[2] = rim ? 40 : 20;
            pixel[3] = rim ? 255 : face ? 120 : 40;
        }
    return overlay;
}

} // namespace

float Interface::em() const
{
    return ImGui::GetFontSize();
}

void Interface::draw(Viewer& viewer, int width, int height)
{
    const ImGuiIO& io = ImGui::GetIO();
    const ViewerPanels& panels = viewer.panels;
    const int status = panels.status ? int(std::lround(ImGui::GetFrameHeight() + 4 * scale_)) : 0;
    viewer.set_picture_rect({0, 0, width, height - status});
    draw_picture(viewer);
    if (panels.look)
        draw_look(viewer);
    if (panels.measure)
        draw_measure(viewer);
    if (status > 0)
        draw_status(viewer, width, height);
    draw_view_cube(viewer);
    if (panels.times && !panels.look)
        draw_times(viewer);
    draw_toasts(viewer);
    draw_loading(viewer);
    if (panels.cheat_sheet)
        draw_cheat_sheet(viewer, width, height);
    wants_pointer_ = io.WantCaptureMouse;
    wants_keys_ = io.WantTextInput;
}

void Interface::draw_picture(Viewer& viewer)
{
    if (viewer.early())
        return draw_early(viewer);
    proxy_.clear();
    const ShownPicture* shown = viewer.shown();
    if (!shown)
        return;
    if (uploaded_ != viewer.shown_count()) {
        picture_.set(shown->colours,
                     shown->colours.width != shown->full_width || shown->colours.height != shown->full_height);
        uploaded_ = viewer.shown_count();
        draw_selection(viewer);
    }
    const PictureRect& rect = viewer.picture_rect();
    const ImVec2 end{float(rect.x + rect.width), float(rect.y + rect.height)};
    ImDrawList* list = ImGui::GetBackgroundDrawList();
    list->AddImage(texture_of(picture_), corner_of(rect), end);
    if (viewer.selection() && selection_.texture() != 0)
        list->AddImage(texture_of(selection_), corner_of(rect), end);
}

void Interface::draw_early(Viewer& viewer)
{
    const PictureRect& rect = viewer.picture_rect();
    const Status drawn =
        proxy_.draw(viewer.early(), viewer.placed(), viewer.state(), {uint32_t(rect.width), uint32_t(rect.height)});
    if (!drawn.ok()) {
        viewer.tell(fmt::format("{}: {}", drawn.error().where, drawn.error().detail), true);
        return;
    }
    if (!proxy_.is_drawn())
        return;
    ImGui::GetBackgroundDrawList()->AddImage(reinterpret_cast<ImTextureID>(static_cast<uintptr_t>(proxy_.texture())),
                                             corner_of(rect), {float(rect.x + rect.width), float(rect.y + rect.height)},
                                             {0, 1}, {1, 0});
}

void Interface::draw_selection(Viewer& viewer)
{
    const ShownPicture* hits = viewer.hits();
    if (viewer.selection() && hits)
        selection_.set(selection_overlay(hits->frame, *viewer.selection()), true);
}

void Interface::draw_status(Viewer& viewer, int width, int height)
{
    const float tall = ImGui::GetFrameHeight() + 4 * scale_;
    ImGui::SetNextWindowPos({0, float(height) - tall});
    ImGui::SetNextWindowSize({float(width), tall});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {8 * scale_, 4 * scale_});
    ImGui::Begin("status", nullptr, kBare);
    std::string line;
    const LoadedModel* model = viewer.model();
    if (model) {
        line = fs::path(model->file).filename().string();
        if (viewer.files().size() > 1)
            line += fmt::format(" ({} of {})", viewer.file_index() + 1, viewer.files().size());
    }
    const std::optional<PickedPoint> point = viewer.hovered();
    if (const std::optional<SurfaceFacts>& facts = viewer.measured().last; model && !point && facts) {
        line += fmt::format(
            "   {}{}face {} ({}{})   uv {:.9g} {:.9g}   at {:.9g}, {:.9g}, {:.9g} mm   normal {:.4f} {:.4f} {:.4f}",
            facts->part_name, facts->part_name.empty() ? "" : ", ", facts->face, facts->kind_name,
            facts->radius_mm ? ", radius " + length_text(*facts->radius_mm, unit_) : "", facts->uv_file[0],
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
    ImGui::SameLine(float(width) - ImGui::CalcTextSize(keys.c_str()).x - 10 * scale_);
    ImGui::TextDisabled("%s", keys.c_str());
    ImGui::End();
    ImGui::PopStyleVar();
}

void Interface::draw_toasts(Viewer& viewer)
{
    if (viewer.toasts().empty())
        return;
    const PictureRect& rect = viewer.picture_rect();
    ImGui::SetNextWindowPos({float(rect.x) + 10 * scale_, float(rect.y + rect.height) - 10 * scale_}, 0, {0, 1});
    ImGui::SetNextWindowBgAlpha(0.8f);
    ImGui::Begin("messages", nullptr, kBare | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoInputs);
    ImGui::PushTextWrapPos(float(rect.width) - 40 * scale_);
    for (const Toast& toast : viewer.toasts()) {
        if (toast.is_error)
            ImGui::PushStyleColor(ImGuiCol_Text, ImVec4(1, 0.55f, 0.45f, 1));
        text(toast.text);
        if (toast.is_error)
            ImGui::PopStyleColor();
    }
    ImGui::PopTextWrapPos();
    ImGui::End();
}

void Interface::draw_loading(Viewer& viewer)
{
    const bool busy = viewer.loader().busy();
    const bool invites = !busy && !viewer.model();
    if (!busy && !invites)
        return;
    const PictureRect& rect = viewer.picture_rect();
    const float down = viewer.early() ? 0.97f : 0.5f; // out of the picture's way
    ImGui::SetNextWindowPos({float(rect.x) + 0.5f * float(rect.width), float(rect.y) + down * float(rect.height)}, 0,
                            {0.5f, down});
    ImGui::SetNextWindowBgAlpha(0.9f);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {16 * scale_, 12 * scale_});
    ImGui::Begin("loading", nullptr, kBare | ImGuiWindowFlags_AlwaysAutoResize);
    ImGui::PushTextWrapPos(30 * em());
    if (busy) {
        const LoadProgress progress = viewer.loader().progress();
        text(fs::path(viewer.files()[viewer.file_index()]).filename().string());
        const std::string doing =
            progress.share >= 0 ? fmt::format("{}, {:.0f} %", progress.doing, 100 * progress.share) : progress.doing;
        ImGui::ProgressBar(progress.share >= 0 ? float(progress.share) : 0, {22 * em(), 0}, doing.c_str());
        ImGui::SameLine();
        if (ImGui::Button("Cancel"))
            viewer.cancel_load();
    } else if (viewer.failure()) {
        text(viewer.failure()->where);
        text(viewer.failure()->detail);
        ImGui::TextDisabled("Drop another file here.");
    } else
        text("Drop a pack (.tray), a STEP or an IGES file here.");
    ImGui::PopTextWrapPos();
    ImGui::End();
    ImGui::PopStyleVar();
}

void Interface::draw_cheat_sheet(Viewer& viewer, int width, int height)
{
    ImGui::SetNextWindowPos({0.5f * float(width), 0.5f * float(height)}, 0, {0.5f, 0.5f});
    ImGui::SetNextWindowSizeConstraints({0, 0}, {0.96f * float(width), 0.96f * float(height)});
    ImGui::SetNextWindowBgAlpha(0.94f);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {16 * scale_, 12 * scale_});
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

void Interface::draw_times(Viewer& viewer)
{
    const ShownPicture* shown = viewer.shown();
    if (!shown)
        return;
    const PictureRect& rect = viewer.picture_rect();
    ImGui::SetNextWindowPos({float(rect.x) + 10 * scale_, float(rect.y) + 10 * scale_});
    ImGui::SetNextWindowBgAlpha(0.75f);
    ImGui::Begin("times", nullptr, kBare | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoInputs);
    const RenderStats& stats = shown->stats;
    const double rays = double(std::max<uint64_t>(stats.work.rays, 1));
    text(stats.device);
    text(fmt::format("{} x {}, {} a pixel{}", shown->traced.width, shown->traced.height,
                     shown->samples * shown->samples, shown->complete ? "" : ", goes on"));
    text(fmt::format("{:.1f} ms traced, {:.1f} ms in all", stats.frame_ms.empty() ? 0 : stats.frame_ms.back(),
                     shown->ms));
    text(fmt::format("a ray: {:.2f} leaves, {:.2f} Newton steps, {:.2f} curves", double(stats.work.leaf_visits) / rays,
                     double(stats.work.newton_steps) / rays, double(stats.work.curve_tests) / rays));
    text(fmt::format("{} pixels not certified", stats.work.uncertified_pixels));
    ImGui::End();
}

// ---- the cube of views ---------------------------------------------------------------------------------------------

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

void Interface::draw_view_cube(Viewer& viewer)
{
    if (!viewer.model() && !viewer.early())
        return;
    using namespace camera_math;
    const PictureRect& rect = viewer.picture_rect();
    const float size = 6.5f * em();
    ImGui::SetNextWindowPos({float(rect.x + rect.width) - size - 8 * scale_, float(rect.y) + 8 * scale_});
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
        list->AddQuad(quad[0], quad[1], quad[2], quad[3], IM_COL32(20, 24, 30, 255), scale_);
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
        list->AddLine(a, b, axis.color, 2 * scale_);
        list->AddText(ImGui::GetFont(), 0.85f * em(), {b.x + 2 * scale_, b.y - 0.5f * em()}, axis.color, axis.name);
    }
    ImGui::End();
    ImGui::PopStyleVar();
}

namespace {

/// A choice among words; true: it was changed.
template <class T, size_t N>
bool choose(const char* label, T& value, const std::pair<T, const char*> (&choices)[N])
{
    bool changed = false;
    const auto now =
        std::find_if(std::begin(choices), std::end(choices), [&](const auto& c) { return c.first == value; });
    if (!ImGui::BeginCombo(label, now == std::end(choices) ? "?" : now->second))
        return false;
    for (const auto& [choice, name] : choices)
        if (ImGui::Selectable(name, choice == value)) {
            changed = choice != value;
            value = choice;
        }
    ImGui::EndCombo();
    return changed;
}

} // namespace

void Interface::draw_look(Viewer& viewer)
{
    const PictureRect& rect = viewer.picture_rect();
    ImGui::SetNextWindowPos({float(rect.x) + 10 * scale_, float(rect.y) + 10 * scale_});
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

void Interface::draw_measure(Viewer& viewer)
{
    const PictureRect& rect = viewer.picture_rect();
    ImGui::SetNextWindowPos({float(rect.x + rect.width) - 10 * scale_, float(rect.y) + 8 * em()}, 0, {1, 0});
    ImGui::SetNextWindowBgAlpha(0.92f);
    ImGui::Begin("measure", nullptr, kPanel | ImGuiWindowFlags_AlwaysAutoResize);
    ImGui::PushItemWidth(7 * em());
    choose("unit", unit_,
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
            text(fmt::format("{}: {}", name_of(dimension.kind), to_text(dimension, unit_)));
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
