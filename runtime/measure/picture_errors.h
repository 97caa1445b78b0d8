// How far a picture is from the reference's of the same view, pixel by pixel: what shows something else, and how far
// off are the points and normals of what shows the same.
#pragma once

#include "runtime/closest_errors.h"
#include "runtime/spread.h"
#include "runtime/tracer.h"

#include <cstdint>

namespace trimray {

struct PictureErrors {
    ClosestErrors answers; // PSNR too
    double ssim = 1;
    uint64_t both_hit = 0; // pixels that hit in both pictures: of them are
    Spread depth_mm;       // distances between the hits along the ray
    Spread depth_px;       // ... in widths of a pixel there
    Spread normal_deg;     // angles between the normals, but for ties
    // Of pixels that hit in one picture alone: to the nearest pixel of the reference that has the same answer, less
    // one half: how far the outline is off
    Spread outline_px;
    uint64_t leaks = 0; // pixels that miss though they and the eight around them hit in the reference

    double wrong_per_million() const { return 1e6 * double(answers.wrong()) / double(answers.pixels); }
};

/// Domain: `frame` is of the reference's view and size, shaded.
PictureErrors picture_errors(ReferencePicture& reference, const Frame& frame);

} // namespace trimray
