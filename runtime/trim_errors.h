// How far a picture is from the reference's, where only the trim decisions differ: in decibels, in rays that met
// something else, and in pixels between a wrong decision and the border that it is about.
#pragma once

#include "format/trim_reference.h"
#include "runtime/camera.h"
#include "runtime/psnr.h"
#include "runtime/tracer.h"

#include <array>
#include <cstdint>

namespace trimray {

struct TrimErrors {
    double psnr_db = 0; // over white
    uint64_t rays = 0;
    uint64_t wrong_rays = 0;            // another face, another placement, or another sheet of the same face
    double largest_border_error_px = 0; // of a wrong ray's decision from the border of its face, in the picture
};

/// Compares a frame with TrimMode::Reference's of the same camera, size and pack.
TrimErrors trim_errors(const PackImage& image, const TrimReference& reference, const CameraRays& rays,
                       const Frame& frame, const Frame& reference_frame);

/// Pixel coordinates (x to the right, y downwards, from the picture's upper left corner) of the point of a face at
/// (u, v) in uv_face, and how they change with u and v. Domain: a point in front of the camera, on a face of one of the
/// instance's part; rays of a camera.
struct PixelOfFace {
    std::array<double, 2> at;
    UvMap change;
};
PixelOfFace pixel_of_face(const PackImage& image, const CameraRays& rays, uint instance, uint face, double u, double v);

} // namespace trimray
