// Measures pictures of the same views by many contenders: time in turns, work, memory, and errors against the reference
// in double.
#pragma once

#include "format/result.h"
#include "runtime/measure/error_pictures.h"
#include "runtime/measure/picture_errors.h"
#include "runtime/measure/settings.h"
#include "runtime/measure/turns.h"
#include "runtime/tracer.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace trimray {

/// What pictures with smoothed borders are held against: the default's with so many samples a pixel, squared.
constexpr uint32_t kSmoothSamples = 6;

struct AccuracyPoint {
    std::vector<double> picture_ms; // as TurnTimes
    double time_to_default = 0;     // median over the rounds of its time over the default's in the same round
    WorkCounts work;                // of one frame
    uint64_t bytes = 0;             // the contender's, and those of the picture (RenderStats)
    PictureErrors errors;           // of a smooth contender: PSNR and SSIM alone
    ErrorPictures pictures;         // empty where colours are equal, and of a smooth contender
};

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

/// Times are taken in turns (turns.h); errors are those of the first round's. `progress` is told what is being done.
/// Fails: as Tracer::render, bench_view. Domain: contenders[0] is the default.
Result<AccuracyView> measure_view(const std::string& name, const std::shared_ptr<const Scene>& scene,
                                  const std::vector<Contender>& contenders, const AccuracyOptions& options,
                                  const std::function<void(const std::string&)>& progress);

} // namespace trimray
