// What accuracy costs in the view at hand: time and error of the same picture by other values of the error dial, the
// trim modes and the policies for closest hits, each changed alone from the view's own settings.
//
// Time: the median over rounds in turns (picture_turns.h) of tracing and shading the view as it is, with all its
// effects; wall time, on the CPU with one thread processor time. Of several frames of stochastic starts their sum.
// Error: of the pixels' hits and faces, not colours, at one sample a pixel, against ViewReference: in double, which no
// setting changes, or, where the view is cut by planes, against the best picture of the CPU tracer.
#pragma once

#include "format/pack_image.h"
#include "format/result.h"
#include "runtime/tracer.h"
#include "runtime/view/picture_turns.h"
#include "runtime/view/view_reference.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace trimray {

enum class AccuracyDial { Now, ErrorPx, Trims, Closest }; // Now: the view's own settings, a value of every dial

/// Settings of a picture, and what they give.
struct CurvePoint {
    AccuracyDial dial = AccuracyDial::Now;
    std::string name; // "error 0.1 px", "trims by kd-trees", "stochastic, 4 frames"; "now"
    float error_px = 0;
    TrimMode trim = TrimMode::Exact; // not auto
    ClosestPolicy closest = ClosestPolicy::Certified;
    uint32_t frames = 1;

    double ms = 0, error_ms = 0; // before the first round those of one picture, which prepared things too, and 0
    uint32_t rounds = 0;
    WorkCounts work; // of the first frame
    ViewErrors errors;
    bool pareto = false; // see mark_pareto
};

/// A setting that this pack or tracer has not.
struct SkippedPoint {
    std::string name, why;
};

struct AccuracyCurve {
    std::string device;
    bool in_double = false;         // what errors are against: ViewReference::in_double
    std::vector<CurvePoint> points; // `now` first, then dial by dial; before the end those that have been made once
    std::vector<SkippedPoint> skipped;
};

/// The settings that are measured, of a view with these: without times and errors. A value that is the view's own is
/// left out, and all that follow from auto are exact's.
std::vector<CurvePoint> accuracy_settings_of(const RenderOptions& options);

/// `options` with a point's settings.
RenderOptions with_settings(RenderOptions options, const CurvePoint& point);

/// Marks the points of the Pareto front: no other has a smaller error (ViewErrors::mean_error_px) and takes no longer,
/// or has the same error and takes less. Times are told apart where they differ by more than kTimesApart of their
/// standard errors.
void mark_pareto(std::vector<CurvePoint>& points);
constexpr double kTimesApart = 2;

/// `reference` is of the view of `options`. `came` is told what there is after each point's first picture and each pair
/// of rounds; it may be empty. `tracer` and `reference` must be nobody else's meanwhile. turns.samples is not used.
/// Fails: Interrupted (options.cancelled), as Tracer::render.
Result<AccuracyCurve> measure_accuracy_curve(Tracer& tracer, const PackImage& image, ViewReference& reference,
                                             const RenderOptions& options, const TurnOptions& turns,
                                             const std::function<void(const AccuracyCurve& so_far)>& came = {});

} // namespace trimray
