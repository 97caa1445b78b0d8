// Measures pictures of the same views by many contenders: time in turns, work, memory, and errors against the reference
// in double.
#pragma once

#include "format/result.h"
#include "runtime/measure/error_pictures.h"
#include "runtime/measure/picture_errors.h"
#include "runtime/measure/settings.h"
#include "runtime/tracer.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace trimray {

/// What makes pictures: a tracer, what is asked of it, and what it reads.
struct Contender {
    std::string dial, name; // as AccuracySetting's; peers have the dial "peers"
    std::shared_ptr<Tracer> tracer;
    std::function<void(RenderOptions&)> ask;
    uint64_t bytes = 0; // of the arrays that it reads beside those that RenderStats counts
    // Whose part it has in the paper's tables (REPORT.md): "one-ray", "wide", "wide-10-frames", "wide-textures" or
    // "textures-50" (percent); empty: none
    std::string paper;
    uint32_t samples = 1; // a pixel, squared
    // Held against the smooth picture (kSmoothSamples), by its colours alone, not against the reference in double,
    // which has one sample a pixel
    bool smooth = false;
};

/// What pictures with smoothed borders are held against: the default's with so many samples a pixel, squared.
constexpr uint32_t kSmoothSamples = 6;

struct AccuracyPoint {
    // Of a whole picture, all its frames together; on the CPU with one thread processor time. One a round; what takes
    // more than kLongPicture_ms is timed once
    std::vector<double> picture_ms;
    double time_to_default = 0; // median over the rounds of its time over the default's in the same round
    WorkCounts work;            // of one frame
    uint64_t bytes = 0;         // the contender's, and those of the picture (RenderStats)
    PictureErrors errors;       // of a smooth contender: PSNR and SSIM alone
    ErrorPictures pictures;     // empty where colours are equal, and of a smooth contender
};
constexpr double kLongPicture_ms = 1000;

struct AccuracyView {
    std::string name;
    Camera camera;
    std::vector<AccuracyPoint> points; // by contender
};

struct AccuracyOptions {
    uint32_t width = 640, height = 360;
    uint32_t rounds = 9;
    uint32_t threads = 1;
    std::string device = "cpu"; // as make_tracer
    std::vector<std::string> views{"iso", "top", "close-up"};
    double magnification = 8; // of the close-up
    bool quick = false;
};

/// Bytes of a scene's arrays that our tracer reads with these trims, but for those that RenderStats counts.
uint64_t bytes_read(const Scene& scene, TrimMode trim);

/// The pack's own contenders, the default first: one for each of accuracy_settings(). Those that cut leaves or make
/// textures have copies of the pack. `note`: which device was taken and why, as make_tracer. Fails: as make_tracer,
/// derive_kd.
Result<std::vector<Contender>> make_contenders(const std::shared_ptr<const Scene>& scene,
                                               const AccuracyOptions& options, std::string& note);

/// A round makes every picture once, in order and the next round backwards, so that a slow drift of the machine falls
/// on all alike; each is made twice in a row and timed the second time, with the caches as a viewer has them. Errors
/// are those of the first round's. `progress` is told what is being done. Fails: as Tracer::render, bench_view. Domain:
/// contenders[0] is the default.
Result<AccuracyView> measure_view(const std::string& name, const std::shared_ptr<const Scene>& scene,
                                  const std::vector<Contender>& contenders, const AccuracyOptions& options,
                                  const std::function<void(const std::string&)>& progress);

} // namespace trimray
