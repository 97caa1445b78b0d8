// Measures the policies for closest hits on one pack: the paper's stochastic frames with one leaf a patch and with the
// pack's leaves, and the one certified frame, against the reference.
#pragma once

#include "format/result.h"
#include "runtime/closest_errors.h"
#include "runtime/tracer.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace trimray {

struct ClosestFigures {
    ClosestPolicy policy = ClosestPolicy::Certified;
    bool one_leaf = false;   // a patch; else the pack's leaves
    uint32_t frames = 1;     // that the picture is made of
    double frame_ms = 0;     // of each of them, median; on one thread its processor time
    double newton_steps = 0; // a ray, in the first frame
    ClosestErrors errors;
};

struct ClosestView {
    std::string name;
    Camera camera;
    double certified_cost = 0;           // median over the rounds of its time over that of the first stochastic frame,
                                         // both with the pack's leaves
    std::vector<ClosestFigures> figures; // stochastic with one leaf a patch, with the pack's leaves; certified
};

struct ClosestReport {
    std::string device;
    uint64_t patches = 0, leaves = 0; // Bezier patches, and the pack's leaves of them
    std::vector<ClosestView> views;
};

struct ClosestBenchOptions {
    uint32_t width = 640, height = 360;
    uint32_t rounds = 9;
    uint32_t threads = 1;
    std::string instruction_set;                   // empty: the best
    std::vector<uint32_t> frames{1, 2, 5, 10, 20}; // ascending
    std::vector<std::string> views{"iso", "front", "top"};
};

/// First frames and the certified one take turns (bench_turns.h); each time two are traced and the second is timed.
/// Later stochastic frames are timed as they are made, the longest picture's. `progress` is told what is being done.
/// Fails: as Tracer::render; Usage (a view's name).
Result<ClosestReport> bench_closest(const std::shared_ptr<const Scene>& scene, const ClosestBenchOptions& options,
                                    const std::function<void(const std::string&)>& progress);

} // namespace trimray
