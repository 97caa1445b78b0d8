// Where a picture differs from the reference of its view, as a picture to lay over it.
#pragma once

#include "format/result.h"
#include "runtime/image_io.h"
#include "runtime/view/view_reference.h"

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace trimray {

/// What a colour of the mask stands for.
struct MaskColor {
    std::string meaning;
    std::array<uint8_t, 4> srgb{}; // straight alpha
};

struct ErrorMask {
    Picture overlay;     // of the frame's size; clear where it is right and certified
    double depth_px = 0; // hits farther than so many widths of a pixel from the right place are wrong
    uint64_t pixels = 0, wrong = 0, other_face = 0, open = 0; // PixelVerdict
    uint64_t uncertified = 0;                                 // by the picture itself, whatever the verdict
    uint64_t differing() const { return wrong + other_face; }
};

/// Below so many widths of a pixel single precision decides, not the dial (ACCURACY.md).
constexpr double kLeastDepthPx = 1e-3;

/// The frame of the reference's view, made with the promise of `error_px` (RenderOptions): hits farther than that from
/// the reference's are wrong, but none nearer than kLeastDepthPx. A pixel has the first colour of mask_colors() that
/// fits. Fails: Interrupted.
Result<ErrorMask> error_mask(ViewReference& reference, const Frame& frame, float error_px,
                             const std::function<bool()>& cancelled = {});

/// Wrong, another face, open, uncertified.
const std::vector<MaskColor>& mask_colors();

} // namespace trimray
