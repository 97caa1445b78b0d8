#include "runtime/view/panels.h"
#include "runtime/view/widgets.h"

#include <fmt/format.h>

#include <algorithm>

namespace trimray {

void draw_times_panel(Viewer& viewer, float scale)
{
    const ShownPicture* shown = viewer.shown();
    if (!shown)
        return;
    const PictureRect& rect = viewer.picture_rect();
    ImGui::SetNextWindowPos({float(rect.x) + 10 * scale, float(rect.y) + 10 * scale});
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

} // namespace trimray
