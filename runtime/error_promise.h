// What `--error-px E` promises, held against the reference: every pixel shows what the exact model shows somewhere
// within E pixels of that pixel's middle, along the ray as across it.
#pragma once

#include "format/closest_reference.h"
#include "runtime/camera.h"
#include "runtime/tracer.h"

#include <cstdint>
#include <limits>
#include <vector>

namespace trimray {

/// A pixel whose answer the reference does not show within E pixels.
struct BrokenPixel {
    uint32_t x = 0, y = 0;
    double traced_mm = 0, right_mm = 0, footprint_mm = 0; // distances from the eye, infinite for a miss; a pixel there
    int32_t traced_face = -1, right_face = -1;
    bool certified = false; // by the tracer
    bool sure = false;      // by the reference: it gave no search up there and touches nothing
    // The least of 2, 4, 8, ... E at which the reference shows it; infinite where it does not within kFarthestPx
    double shown_within_px = std::numeric_limits<double>::infinity();
};
constexpr double kFarthestPx = 4;

struct PromiseKept {
    uint64_t pixels = 0, hits = 0; // hits: the reference's
    uint64_t at_centre = 0;        // shown by the ray through the pixel's middle itself
    uint64_t within = 0;           // shown elsewhere within E
    std::vector<BrokenPixel> broken;

    /// Null: none is broken.
    const BrokenPixel* worst() const;
};

/// Holds `traced` to the promise of `error_px`. `right` is the reference's frame of the same camera and size. A pixel
/// is kept where one of the rays within `error_px` of its middle misses as it does, or hits as far from the eye to
/// error_px footprints, or where two that are neighbours hit its face before and behind it and so does, by halving,
/// a ray between them. Rays are cast around pixels that differ alone: 16, and 832 before one is called broken.
/// Domain: frames of equal size; error_px > 0.
PromiseKept hold_to_promise(const Frame& traced, const Frame& right, const Camera& camera,
                            const ClosestReference& closest, double error_px);

} // namespace trimray
