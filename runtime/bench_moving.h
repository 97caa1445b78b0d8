// Measures on one pack what a moving camera gains from the last picture's hits (RenderOptions::reuse_last).
#pragma once

#include "format/result.h"
#include "runtime/tracer.h"

#include <functional>
#include <memory>
#include <string>

namespace trimray {

/// Over all measured pictures.
struct MovingFigures {
    double frame_ms = 0;                                       // median
    double node_visits = 0, leaf_visits = 0, newton_steps = 0; // a ray
};

struct MovingReport {
    std::string device;
    Camera camera; // of the picture before the first measured one
    MovingFigures plain, reusing;
    double speedup = 0;            // median over the pictures of the time without reuse over that with it
    uint64_t differing_pixels = 0; // in any channel, of all pictures
};

struct MovingBenchOptions {
    uint32_t width = 640, height = 360;
    uint32_t pictures = 24;
    double degrees = 1; // a picture
    std::string device = "vulkan";
};

/// The camera frames the model from iso and turns about its target, around its up. Each picture is traced with reuse
/// and without, in turns, each time twice from the same hits, and the second is timed. `progress` is told what is being
/// done. Fails: as make_tracer and Tracer::render; UnsupportedFormat (a tracer that reuses nothing).
Result<MovingReport> bench_moving(const std::shared_ptr<const Scene>& scene, const MovingBenchOptions& options,
                                  const std::function<void(const std::string&)>& progress);

} // namespace trimray
