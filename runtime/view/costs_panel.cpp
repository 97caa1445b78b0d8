#include "runtime/view/panels.h"
#include "runtime/view/widgets.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace trimray {
namespace {

ImU32 color_of(const std::array<uint8_t, 4>& srgb)
{
    return IM_COL32(srgb[0], srgb[1], srgb[2], 255);
}

/// The study that is going on, and its end; or the button that begins it.
void draw_study(Viewer& viewer, StudyOrder::What what, const char* begin)
{
    ImGui::PushID(begin);
    if (const std::optional<ViewStudy::Progress> progress = viewer.study_progress();
        progress && progress->what == what) {
        ImGui::ProgressBar(float(progress->share), {14 * em(), 0}, progress->doing.c_str());
        ImGui::SameLine();
        if (ImGui::Button("stop"))
            viewer.cancel_study();
    } else if (ImGui::Button(begin))
        viewer.study(what);
    ImGui::PopID();
}

void say_of_which_view(Viewer& viewer, bool is_of_this_view, bool complete)
{
    if (!is_of_this_view)
        ImGui::TextDisabled("of an earlier view");
    else if (!complete && !viewer.study_progress())
        ImGui::TextDisabled("stopped before its end");
}

void draw_effects(Viewer& viewer)
{
    ImGui::TextDisabled("Effects: what the picture is made of");
    const std::optional<Studied<EffectCosts>>& studied = viewer.effect_costs();
    if (studied) {
        const EffectCosts& costs = studied->found;
        std::string of_the_pack;
        for (const EffectCost& effect : costs.effects)
            if (!effect.ms)
                of_the_pack += (of_the_pack.empty() ? "" : ", ") + effect.name;
        ImGui::PushTextWrapPos(26 * em());
        text("the model itself: " + of_the_pack);
        ImGui::PopTextWrapPos();
        if (ImGui::BeginTable("effects", 2, ImGuiTableFlags_SizingFixedFit | ImGuiTableFlags_RowBg)) {
            const auto row = [](const std::string& name, double ms, double error_ms, const std::string& why) {
                ImGui::TableNextRow();
                ImGui::TableSetColumnIndex(0);
                ImGui::Selectable(name.c_str(), false, ImGuiSelectableFlags_SpanAllColumns);
                if (!why.empty() && ImGui::IsItemHovered())
                    ImGui::SetTooltip("%s", why.c_str());
                ImGui::TableSetColumnIndex(1);
                const std::string words = fmt::format("{:.2f} \xc2\xb1 {:.2f} ms", ms, error_ms);
                ImGui::SetCursorPosX(ImGui::GetCursorPosX() +
                                     std::max(0.0f, 11 * em() - ImGui::CalcTextSize(words.c_str()).x));
                text(words);
            };
            for (const EffectCost& effect : costs.effects) {
                if (!effect.ms)
                    continue;
                std::string why = effect.why;
                for (const std::string& other : effect.takes_along)
                    why += fmt::format("\nwithout it there is no {}", other);
                const bool told_apart = std::abs(*effect.ms) > 2 * effect.error_ms;
                if (!told_apart)
                    ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
                row(effect.name, *effect.ms, effect.error_ms, why);
                if (!told_apart)
                    ImGui::PopStyleColor();
            }
            row("the whole picture", costs.picture_ms, costs.error_ms, "");
            ImGui::EndTable();
        }
        text(fmt::format("{}, {} rounds", costs.device, costs.rounds));
        say_of_which_view(viewer, viewer.is_of_this_view(*studied), studied->complete);
    }
    draw_study(viewer, StudyOrder::What::Effects, studied ? "time them again" : "time each effect");
}

std::array<double, 2> error_range(const std::vector<CurvePoint>& points)
{
    double lo = std::numeric_limits<double>::infinity(), hi = 0;
    for (const CurvePoint& point : points)
        if (const double error = point.errors.mean_error_px; error > 0) {
            lo = std::min(lo, error);
            hi = std::max(hi, error);
        }
    return hi > 0 ? std::array{lo, hi} : std::array{1e-6, 1.0};
}

struct DialColor {
    ImU32 color;
    const char* name;
};
constexpr DialColor kDials[] = {{IM_COL32(255, 170, 60, 255), "now"}, // by AccuracyDial
                                {IM_COL32(110, 170, 255, 255), "error"},
                                {IM_COL32(120, 210, 130, 255), "trims"},
                                {IM_COL32(230, 120, 190, 255), "closest hits"}};

/// Milliseconds to the right, errors upwards, both as powers of ten; those without an error along the lower side.
/// The settings of a point that is clicked become the view's.
void draw_curve(Viewer& viewer, const AccuracyCurve& curve)
{
    const ImVec2 size{26 * em(), 13 * em()};
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    const bool clicked = ImGui::InvisibleButton("curve", size);
    const bool hovered = ImGui::IsItemHovered();
    ImDrawList* list = ImGui::GetWindowDrawList();
    list->AddRectFilled(corner, {corner.x + size.x, corner.y + size.y}, IM_COL32(16, 18, 22, 255));
    if (curve.points.empty())
        return;
    double ms_lo = curve.points[0].ms, ms_hi = ms_lo;
    for (const CurvePoint& point : curve.points) {
        ms_lo = std::min(ms_lo, point.ms);
        ms_hi = std::max(ms_hi, point.ms);
    }
    ms_lo = std::max(ms_lo, 1e-3) / 1.2;
    ms_hi = std::max(ms_hi, ms_lo) * 1.2;
    auto [error_lo, error_hi] = error_range(curve.points);
    error_lo /= 2;
    error_hi *= 2;
    const float left = 3.6f * em(), below = 2.6f * em(), margin = 0.8f * em();
    const auto place = [&](double ms, double error) {
        const double x = std::log(ms / ms_lo) / std::log(ms_hi / ms_lo);
        const double y = error > 0 ? 0.08 + 0.92 * std::log(error / error_lo) / std::log(error_hi / error_lo) : 0;
        return ImVec2{corner.x + left + float(x) * (size.x - left - margin),
                      corner.y + size.y - below - float(y) * (size.y - below - margin)};
    };
    const ImU32 faint = IM_COL32(70, 76, 86, 255), words = IM_COL32(160, 166, 176, 255);
    const auto label = [&](ImVec2 at, const std::string& what) {
        list->AddText(ImGui::GetFont(), 0.8f * em(), at, words, what.c_str());
    };
    for (int decade = int(std::floor(std::log10(ms_lo))); decade <= int(std::ceil(std::log10(ms_hi))); ++decade)
        for (const double digit : {1.0, 2.0, 5.0}) {
            const double ms = digit * std::pow(10, decade);
            if (ms < ms_lo || ms > ms_hi)
                continue;
            const ImVec2 at = place(ms, 0);
            list->AddLine({at.x, corner.y + margin}, at, faint, hairline());
            label({at.x - 0.5f * em(), at.y + 0.2f * em()}, fmt::format("{:g}", ms));
        }
    for (int decade = int(std::ceil(std::log10(error_lo))); decade <= int(std::floor(std::log10(error_hi))); ++decade) {
        const ImVec2 at = place(ms_lo, std::pow(10, decade));
        list->AddLine(at, {corner.x + size.x - margin, at.y}, faint, hairline());
        label({corner.x + 0.2f * em(), at.y - 0.4f * em()}, fmt::format("1e{}", decade));
    }
    list->AddLine(place(ms_lo, 0), place(ms_hi, 0), faint, hairline());
    label({corner.x + 0.2f * em(), place(ms_lo, 0).y - 0.4f * em()}, "none");
    label({corner.x + left, corner.y + size.y - 1.1f * em()}, "ms a picture; upwards the mean error, px");

    std::vector<const CurvePoint*> front;
    for (const CurvePoint& point : curve.points)
        if (point.pareto)
            front.push_back(&point);
    std::sort(front.begin(), front.end(), [](const CurvePoint* a, const CurvePoint* b) { return a->ms < b->ms; });
    for (size_t i = 1; i < front.size(); ++i)
        list->AddLine(place(front[i - 1]->ms, front[i - 1]->errors.mean_error_px),
                      place(front[i]->ms, front[i]->errors.mean_error_px), IM_COL32(110, 180, 120, 160),
                      1.5f * hairline());
    const CurvePoint* nearest = nullptr;
    float nearest_px = 0.9f * em();
    const ImVec2 pointer = ImGui::GetIO().MousePos;
    for (const CurvePoint& point : curve.points) {
        const ImVec2 at = place(point.ms, point.errors.mean_error_px);
        const bool now = point.dial == AccuracyDial::Now;
        list->AddCircleFilled(at, (now ? 0.42f : 0.3f) * em(), kDials[size_t(point.dial)].color);
        const float apart = std::hypot(pointer.x - at.x, pointer.y - at.y);
        if (hovered && apart < nearest_px) {
            nearest_px = apart;
            nearest = &point;
        }
    }
    if (!nearest)
        return;
    const ViewErrors& errors = nearest->errors;
    ImGui::SetTooltip(
        "%s", fmt::format("{}\n{:.2f} \xc2\xb1 {:.2f} ms\n{} of {} pixels wrong, {} another face, {} open\n"
                          "{} not certified; mean error {:.2g} px, largest {:.2g} px{}",
                          nearest->name, nearest->ms, nearest->error_ms, errors.wrong, errors.pixels, errors.other_face,
                          errors.open, errors.uncertified, errors.mean_error_px, errors.depth_px.largest,
                          nearest->dial == AccuracyDial::Now ? "" : "\nclick: view with it")
                  .c_str());
    if (clicked && nearest->dial != AccuracyDial::Now && nearest->frames == 1) {
        viewer.state().error_px = nearest->error_px;
        viewer.state().trim = nearest->trim;
        viewer.state().closest = nearest->closest;
        viewer.changed();
    }
}

void draw_accuracy(Viewer& viewer)
{
    ImGui::TextDisabled("Accuracy: what it costs in this view");
    const std::optional<Studied<AccuracyCurve>>& studied = viewer.accuracy_curve();
    if (studied) {
        const AccuracyCurve& curve = studied->found;
        draw_curve(viewer, curve);
        for (const DialColor& dial : kDials) {
            if (&dial != kDials)
                ImGui::SameLine();
            ImGui::TextColored(ImGui::ColorConvertU32ToFloat4(dial.color), "%s", dial.name);
        }
        for (const SkippedPoint& skipped : curve.skipped)
            ImGui::TextDisabled("%s: %s", skipped.name.c_str(), skipped.why.c_str());
        ImGui::TextDisabled("%s", curve.in_double ? "held against the reference in double"
                                                  : "held against the best picture of the CPU tracer");
        say_of_which_view(viewer, viewer.is_of_this_view(*studied), studied->complete);
    }
    draw_study(viewer, StudyOrder::What::Accuracy, studied ? "draw the curve again" : "draw the curve");

    bool shown = viewer.shows_errors();
    if (ImGui::Checkbox("show where the picture is wrong", &shown))
        viewer.show_errors(shown);
    if (!shown)
        return;
    const ErrorMask* mask = viewer.errors();
    if (!mask) {
        const std::optional<ViewStudy::Progress> progress = viewer.study_progress();
        if (progress && progress->what == StudyOrder::What::Errors)
            ImGui::ProgressBar(float(progress->share), {14 * em(), 0}, progress->doing.c_str());
        else
            ImGui::TextDisabled("when the picture rests");
        return;
    }
    const uint64_t counts[] = {mask->wrong, mask->other_face, mask->open, mask->uncertified};
    const std::vector<MaskColor>& colors = mask_colors();
    for (size_t i = 0; i < std::min(colors.size(), std::size(counts)); ++i) {
        const ImVec2 at = ImGui::GetCursorScreenPos();
        ImGui::GetWindowDrawList()->AddRectFilled({at.x, at.y + 0.1f * em()}, {at.x + em(), at.y + 1.1f * em()},
                                                  color_of(colors[i].srgb));
        ImGui::Dummy({em(), em()});
        ImGui::SameLine();
        text(fmt::format("{} {}", counts[i], colors[i].meaning));
    }
    text(fmt::format("of {} pixels; wrong: farther off than {:g} px", mask->pixels, mask->depth_px));
}

} // namespace

void draw_costs_panel(Viewer& viewer, float scale)
{
    if (!viewer.model())
        return;
    const PictureRect& rect = viewer.picture_rect();
    ImGui::SetNextWindowPos({float(rect.x + rect.width) - 10 * scale, float(rect.y + rect.height) - 10 * scale}, 0,
                            {1, 1});
    ImGui::SetNextWindowSizeConstraints({0, 0}, {float(rect.width), float(rect.height) - 20 * scale});
    ImGui::SetNextWindowBgAlpha(0.92f);
    ImGui::Begin("costs", nullptr, kPanel | ImGuiWindowFlags_AlwaysAutoResize);
    draw_effects(viewer);
    ImGui::Spacing();
    draw_accuracy(viewer);
    ImGui::End();
}

} // namespace trimray
