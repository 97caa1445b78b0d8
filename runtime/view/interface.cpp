#include "runtime/view/interface.h"

#include "runtime/view/panels.h"
#include "runtime/view/widgets.h"

#include <fmt/format.h>
#include <imgui_internal.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

namespace trimray {
namespace {
namespace fs = std::filesystem;

ImVec2 corner_of(const PictureRect& rect)
{
    return {float(rect.x), float(rect.y)};
}

/// What is selected, as a picture to lay over the one that is shown: placements tinted, their outline bright, the face
/// itself brighter. `rim_px`: how thick the outline is.
Picture selection_overlay(const Frame& frame, const Selection& selected, uint32_t rim_px)
{
    Picture overlay{frame.width, frame.height, std::vector<uint8_t>(size_t(frame.width) * frame.height * 4)};
    std::vector<uint8_t> is_inside(size_t(frame.width) * frame.height);
    for (size_t at = 0; at < is_inside.size(); ++at)
        is_inside[at] = frame.instance[at] >= 0 && selected.has(uint32_t(frame.instance[at]));
    const auto inside = [&](uint32_t x, uint32_t y) { return is_inside[size_t(y) * frame.width + x] != 0; };
    for (uint32_t y = 0; y < frame.height; ++y)
        for (uint32_t x = 0; x < frame.width; ++x) {
            if (!inside(x, y))
                continue;
            const size_t at = size_t(y) * frame.width + x;
            bool rim = false;
            for (uint32_t d = 1; d <= rim_px; ++d)
                rim |= (x >= d && !inside(x - d, y)) || (x + d < frame.width && !inside(x + d, y)) ||
                       (y >= d && !inside(x, y - d)) || (y + d < frame.height && !inside(x, y + d));
            const bool face = selected.face && frame.face[at] == int32_t(*selected.face);
            uint8_t* const pixel = &overlay.rgba[4 * at];
            pixel[0] = 255;
            pixel[1] = rim ? 170 : 140;
            pixel[2] = rim ? 40 : 20;
            pixel[3] = rim ? 255 : face ? 120 : 40;
        }
    return overlay;
}

/// Whether there is nothing to see: then files are asked for.
bool invites(const Viewer& viewer)
{
    return !viewer.model() && !viewer.loader().busy();
}

} // namespace

void Interface::draw(Viewer& viewer, int width, int height)
{
    const ImGuiIO& io = ImGui::GetIO();
    const ViewerPanels& panels = viewer.panels;
    const float top = panels.menu ? draw_menu_bar(viewer) : 0;
    const float bottom = panels.status ? status_line_height(scale_) : 0;
    const float middle = std::max(float(height) - top - bottom, 1.0f);
    const float left = panels.tree ? tree_.draw(viewer, top, middle, 0.6f * float(width), scale_) : 0;
    viewer.set_picture_rect({int(left), int(top), width - int(left), int(middle)});
    draw_picture(viewer);
    draw_section_handles(viewer, scale_);
    if (panels.look)
        draw_look_panel(viewer, scale_);
    if (panels.measure)
        draw_measure_panel(viewer, scale_);
    if (panels.status)
        draw_status_line(viewer, width, height, scale_);
    draw_view_cube(viewer, scale_);
    draw_legend_panel(viewer, scale_);
    if (panels.costs)
        draw_costs_panel(viewer, scale_);
    if (panels.times && !panels.look)
        draw_times_panel(viewer, scale_);
    draw_toasts(viewer);
    draw_open(viewer);
    draw_progress(viewer);
    if (panels.cheat_sheet)
        draw_cheat_sheet(viewer, width, height, scale_);
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
    if (!viewer.selection().empty() && selection_.texture() != 0)
        list->AddImage(texture_of(selection_), corner_of(rect), end);
    if (const ErrorMask* errors = viewer.errors()) {
        if (errors != drawn_errors_ || viewer.shown_count() != drawn_errors_count_)
            errors_.set(errors->overlay, false);
        drawn_errors_ = errors;
        drawn_errors_count_ = viewer.shown_count();
        list->AddImage(texture_of(errors_), corner_of(rect), end);
    }
}

void Interface::draw_early(Viewer& viewer)
{
    const PictureRect& rect = viewer.picture_rect();
    const Status drawn =
        proxy_.draw(viewer.early(), viewer.placed(), viewer.state(), {uint32_t(rect.width), uint32_t(rect.height)});
    if (!drawn.ok()) {
        viewer.tell(drawn.error());
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
    if (!viewer.selection().empty() && hits)
        selection_.set(selection_overlay(hits->frame, viewer.selection(), uint32_t(hairline())), true);
}

void Interface::draw_toasts(Viewer& viewer)
{
    const bool told = viewer.failure() && invites(viewer); // by the panel that invites
    const std::string failure = told ? words_of(*viewer.failure()) : "";
    if (std::all_of(viewer.toasts().begin(), viewer.toasts().end(),
                    [&failure](const Toast& toast) { return toast.text == failure; }))
        return;
    const PictureRect& rect = viewer.picture_rect();
    ImGui::SetNextWindowPos({float(rect.x) + 10 * scale_, float(rect.y + rect.height) - 10 * scale_}, 0, {0, 1});
    ImGui::SetNextWindowBgAlpha(0.8f);
    ImGui::Begin("messages", nullptr, kBare | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoInputs);
    ImGui::BringWindowToDisplayFront(ImGui::GetCurrentWindow()); // over a panel that was opened after them
    ImGui::PushTextWrapPos(float(rect.width) - 40 * scale_);
    for (const Toast& toast : viewer.toasts()) {
        if (toast.text == failure)
            continue;
        if (toast.is_error)
            ImGui::PushStyleColor(ImGuiCol_Text, ImVec4(1, 0.55f, 0.45f, 1));
        text(toast.text);
        if (toast.is_error)
            ImGui::PopStyleColor();
    }
    ImGui::PopTextWrapPos();
    ImGui::End();
}

void Interface::draw_open(Viewer& viewer)
{
    if (invites(viewer) || viewer.panels.open)
        open_.draw(viewer, invites(viewer), scale_);
    else
        open_.forget();
}

void Interface::draw_progress(Viewer& viewer)
{
    const std::optional<std::array<size_t, 2>> series = viewer.series_progress();
    if (!viewer.loader().busy() && !series)
        return;
    const PictureRect& rect = viewer.picture_rect();
    ImGui::SetNextWindowPos({float(rect.x) + 0.5f * float(rect.width), float(rect.y + rect.height) - 3 * em()}, 0,
                            {0.5f, 1});
    ImGui::SetNextWindowBgAlpha(0.9f);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {16 * scale_, 12 * scale_});
    ImGui::Begin("progress", nullptr, kBare | ImGuiWindowFlags_AlwaysAutoResize);
    if (viewer.loader().busy()) {
        const LoadProgress progress = viewer.loader().progress();
        text(fs::path(viewer.files()[viewer.file_index()]).filename().string());
        const std::string doing =
            progress.share >= 0 ? fmt::format("{}, {:.0f} %", progress.doing, 100 * progress.share) : progress.doing;
        ImGui::ProgressBar(progress.share >= 0 ? float(progress.share) : 0, {22 * em(), 0}, doing.c_str());
    } else {
        text("saving pictures of a turn");
        ImGui::ProgressBar(float((*series)[0]) / float((*series)[1]), {22 * em(), 0},
                           fmt::format("{} of {}", (*series)[0], (*series)[1]).c_str());
    }
    ImGui::SameLine();
    if (ImGui::Button("Cancel"))
        viewer.loader().busy() ? viewer.cancel_load() : viewer.act(Action::Quit);
    ImGui::End();
    ImGui::PopStyleVar();
}

} // namespace trimray
