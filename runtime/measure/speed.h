// How fast a model's default picture is made on the CPU, beside baselines in the same run, which cancel how fast the
// machine is; and the exact counts of its work and bytes: what a change of the program is judged by.
#pragma once

#include "format/result.h"
#include "runtime/measure/speed_table.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace trimray {

struct SpeedOptions {
    uint32_t width = 640, height = 360;
    uint32_t rounds = 9; // 0: each picture is made once, untimed, and there are no baselines
    uint32_t threads = 1;
    std::string instruction_set; // as make_cpu_tracer
    std::vector<std::string> views{"iso", "top", "close-up"};
    double magnification = 8; // of the close-up
    bool errors = false;      // count the pixels that differ from the reference's
};

struct SpeedModel {
    SpeedTable lines;               // one a view
    std::vector<std::string> notes; // what is not in the pack or a baseline, and why
};

/// `model`: a pack, or a CAD file, which is converted. Baselines are the paper's shape of tracer (one ray at a time,
/// one leaf a patch of the same pack, kd-trees), and, of a CAD file, its triangles at kSpeedDeflection traced by
/// Embree; triangles that cannot be made are noted. Times are taken in turns (turns.h). Fails: as run_converter,
/// load_scene, bench_view, make_cpu_tracer, derive_kd.
Result<SpeedModel> measure_speed(const std::string& model, const SpeedOptions& options,
                                 const std::function<void(const std::string&)>& progress);
constexpr double kSpeedDeflection = 1e-4; // of the model's diagonal

} // namespace trimray
