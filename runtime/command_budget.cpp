#include "runtime/command_budget.h"

#include "runtime/command_trace.h"
#include "runtime/enlarge.h"
#include "runtime/image_io.h"
#include "runtime/median.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace trimray {
namespace {

// Probes are of 1/8 of the width and height, but of so many pixels at least: less is mostly overhead
constexpr uint32_t kProbeShrink = 8;
constexpr double kLeastProbePixels = 4096;
constexpr uint32_t kProbeFrames = 3; // the first warms up

double pixels_of(const RenderOptions& options)
{
    return double(options.width) * options.height;
}

} // namespace

Json to_json(const BudgetReport& report)
{
    Json gave_up = Json::array();
    for (const GivenUp& one : report.gave_up)
        gave_up.push_back({{"what", one.what}, {"from", one.from}, {"to", one.to}});
    return {{"ms", report.budget_ms},
            {"measured_ms", report.measured_ms},
            {"fits", report.fits},
            {"gave_up", std::move(gave_up)}};
}

std::string to_text(const BudgetReport& report)
{
    std::string list;
    for (const GivenUp& one : report.gave_up)
        list += fmt::format("{}{} {} -> {}", list.empty() ? "" : ", ", one.what, one.from, one.to);
    return fmt::format("--time-budget {:g}: {:.{}f} ms a frame{}; gave up {}", report.budget_ms, report.measured_ms,
                       report.measured_ms < 10 ? 2 : 0, report.fits ? "" : ", over the budget with the least there is",
                       list.empty() ? "nothing" : list);
}

BudgetedPictures::BudgetedPictures(Tracer& tracer, const RenderOptions& options, uint32_t samples, bool colors_alone,
                                   double budget_ms)
    : tracer_(tracer), colors_alone_(colors_alone), ladder_(effort_ladder(options, samples)), budget_ms_(budget_ms),
      search_(ladder_.size(), budget_ms)
{
}

/// `traced`: of what size and effects; it is enlarged to the size of `options`.
Result<BudgetedPictures::Made> BudgetedPictures::make(const RenderOptions& traced, const Effort& effort,
                                                      const RenderOptions& options) const
{
    Made made;
    Result<Frame> frame = tracer_.render(at_samples(traced, effort.samples), made.stats);
    if (!frame.ok())
        return frame.error();
    const auto start = std::chrono::steady_clock::now();
    if (effort.samples > 1)
        *frame = average_samples(*frame, effort.samples);
    if (effort.shrink > 1) {
        if (colors_alone_) {
            Frame colors;
            colors.width = frame->width;
            colors.height = frame->height;
            colors.rgba = std::move(frame->rgba);
            *frame = std::move(colors);
        }
        *frame = enlarge(*frame, options.width, options.height, effort.shrink, options.threads);
    }
    const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - start;
    made.frame = std::move(*frame);
    made.finishing_ms = spent.count();
    return made;
}

Result<double> BudgetedPictures::probe_ms(const RenderOptions& options, const Effort& effort) const
{
    RenderOptions asked = with_effort(options, effort);
    const RenderOptions whole = shrunk(asked, effort.shrink);
    asked.frames = kProbeFrames;
    const auto fewer = uint32_t(std::sqrt(pixels_of(whole) / kLeastProbePixels));
    const RenderOptions share = shrunk(asked, effort.shrink * std::clamp(fewer, 1u, kProbeShrink));
    const Result<Made> made = make(share, {.samples = effort.samples}, share);
    if (!made.ok())
        return made.error();
    const std::vector<double>& times = made->stats.frame_ms;
    return (*std::min_element(times.begin() + 1, times.end()) + made->finishing_ms) * pixels_of(whole) /
           pixels_of(share);
}

Result<Frame> BudgetedPictures::trace(const RenderOptions& options, RenderStats& stats, BudgetReport& report)
{
    search_.begin_picture();
    Frame best;
    while (true) {
        const Result<std::optional<size_t>> rung =
            search_.next([&](size_t i) { return probe_ms(options, ladder_[i]); });
        if (!rung.ok())
            return rung.error();
        if (!*rung)
            break;
        const Effort& effort = ladder_[**rung];
        Result<Made> made = make(shrunk(with_effort(options, effort), effort.shrink), effort, options);
        if (!made.ok())
            return made.error();
        if (!search_.measured(**rung, median(made->stats.frame_ms) + made->finishing_ms))
            continue;
        best = std::move(made->frame);
        stats = std::move(made->stats);
        report.made = effort;
        report.gave_up = given_up(ladder_.front(), effort);
    }
    report.budget_ms = budget_ms_;
    report.measured_ms = search_.best_ms();
    report.fits = search_.best_fits();
    return best;
}

} // namespace trimray
