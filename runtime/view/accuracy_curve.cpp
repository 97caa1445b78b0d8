#include "runtime/view/accuracy_curve.h"

#include "runtime/bench_turns.h"
#include "runtime/median.h"
#include "runtime/trim_mode.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <utility>

namespace trimray {
namespace {

constexpr float kErrorsPx[] = {1, 0.5f, 0.2f, 0.1f, 0.05f, 0.02f, 0.01f, 1e-3f};
constexpr TrimMode kTrims[] = {TrimMode::Exact, TrimMode::Kd, TrimMode::Hybrid, TrimMode::Sdf};
constexpr uint32_t kStochasticFrames[] = {1, 4, 16};

TrimMode traced_trim(TrimMode asked)
{
    return asked == TrimMode::Auto ? TrimMode::Exact : asked; // as choose_trim
}

const char* trims_text(TrimMode trim)
{
    switch (trim) {
    case TrimMode::Sdf:
        return "trims by distance textures";
    case TrimMode::Hybrid:
        return "trims by textures and cells";
    case TrimMode::Kd:
        return "trims by kd-trees";
    case TrimMode::Reference:
        return "trims by counting in double";
    default:
        return "trims by cells";
    }
}

std::string frames_text(uint32_t frames)
{
    return fmt::format("stochastic, {} {}", frames, frames == 1 ? "frame" : "frames");
}

bool same_settings(const CurvePoint& a, const CurvePoint& b)
{
    return a.error_px == b.error_px && a.trim == b.trim && a.closest == b.closest && a.frames == b.frames;
}

double sum_ms(const RenderStats& stats)
{
    const std::vector<double>& ms = frame_times(stats);
    return std::accumulate(ms.begin(), ms.end(), 0.0);
}

} // namespace

std::vector<CurvePoint> accuracy_settings_of(const RenderOptions& options)
{
    CurvePoint now;
    now.name = "now";
    now.error_px = options.error_px;
    now.trim = traced_trim(options.trim);
    now.closest = options.closest;
    now.frames = options.closest == ClosestPolicy::Stochastic ? std::max(options.frames, 1u) : 1;
    std::vector<CurvePoint> points{now};
    const auto add = [&](AccuracyDial dial, std::string name, const auto& set) {
        CurvePoint point = now;
        point.dial = dial;
        point.name = std::move(name);
        set(point);
        if (!same_settings(point, now))
            points.push_back(std::move(point));
    };
    for (const float error_px : kErrorsPx)
        add(AccuracyDial::ErrorPx, fmt::format("error {:g} px", error_px),
            [&](CurvePoint& point) { point.error_px = error_px; });
    for (const TrimMode trim : kTrims)
        add(AccuracyDial::Trims, trims_text(trim), [&](CurvePoint& point) { point.trim = trim; });
    add(AccuracyDial::Closest, "certified", [](CurvePoint& point) {
        point.closest = ClosestPolicy::Certified;
        point.frames = 1;
    });
    for (const uint32_t frames : kStochasticFrames)
        add(AccuracyDial::Closest, frames_text(frames), [&](CurvePoint& point) {
            point.closest = ClosestPolicy::Stochastic;
            point.frames = frames;
        });
    return points;
}

RenderOptions with_settings(RenderOptions options, const CurvePoint& point)
{
    options.error_px = point.error_px;
    options.trim = point.trim;
    options.closest = point.closest;
    options.frames = point.frames;
    return options;
}

void mark_pareto(std::vector<CurvePoint>& points)
{
    const auto beats = [](const CurvePoint& a, const CurvePoint& b) {
        const double apart_ms = kTimesApart * std::hypot(a.error_ms, b.error_ms);
        const double a_error = a.errors.mean_error_px, b_error = b.errors.mean_error_px;
        return (a_error < b_error && a.ms <= b.ms + apart_ms) || (a_error == b_error && a.ms < b.ms - apart_ms);
    };
    for (CurvePoint& point : points)
        point.pareto =
            std::none_of(points.begin(), points.end(), [&](const CurvePoint& other) { return beats(other, point); });
}

Result<AccuracyCurve> measure_accuracy_curve(Tracer& tracer, const PackImage& image, ViewReference& reference,
                                             const RenderOptions& options, const TurnOptions& turns,
                                             const std::function<void(const AccuracyCurve&)>& came)
{
    assert(reference.width() == options.width && reference.height() == options.height);
    AccuracyCurve curve;
    curve.in_double = reference.in_double();
    std::vector<CurvePoint> settings;
    for (CurvePoint& point : accuracy_settings_of(options)) {
        const Result<TrimMode> possible = choose_trim(image, point.trim);
        if (possible.ok() || point.dial == AccuracyDial::Now) // of the view's own settings the tracer says why not
            settings.push_back(std::move(point));
        else
            curve.skipped.push_back({point.name, possible.error().detail});
    }
    std::vector<RenderOptions> pictures;
    for (const CurvePoint& point : settings)
        pictures.push_back(with_settings(options, point));
    const auto tell = [&] {
        mark_pareto(curve.points);
        if (came)
            came(curve);
    };
    const auto first = [&](size_t i, const Frame& frame, const RenderStats& stats) -> Status {
        Result<ViewErrors> errors = reference.errors(frame, options.cancelled);
        if (!errors.ok())
            return errors.error();
        curve.device = stats.device;
        CurvePoint& point = curve.points.emplace_back(settings[i]);
        point.errors = std::move(*errors);
        point.work = stats.work;
        point.ms = sum_ms(stats);
        tell();
        return Done{};
    };
    const auto paired = [&](const std::vector<PictureTimes>& times) {
        for (size_t i = 0; i < times.size(); ++i) {
            curve.points[i].ms = median(times[i].ms);
            curve.points[i].error_ms = median_error(times[i].ms);
            curve.points[i].rounds = uint32_t(times[i].ms.size());
        }
        tell();
    };
    TurnOptions one_sample = turns;
    one_sample.samples = 1;
    const Result<std::vector<PictureTimes>> times = time_pictures(tracer, pictures, one_sample, first, paired);
    if (!times.ok())
        return times.error();
    return curve;
}

} // namespace trimray
