// What a picture's errors look like: where it is worst, beside the reference's picture of the same place, and a map of
// all of them.
#pragma once

#include "format/result.h"
#include "runtime/closest_errors.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace trimray {

/// Where colours differ most: the sum of their squared differences (sRGB bytes) over these pixels; 0: nowhere.
struct WorstPlace {
    uint32_t x = 0, y = 0, width = 0, height = 0;
    uint64_t difference = 0;
};

/// The rectangle of at most side x side pixels, the first of equal ones by rows. Domain: pictures of one size.
WorstPlace worst_place(const Picture& picture, const Picture& right, uint32_t side);

/// Steps of the map of errors: how far a hit is off in depth, in widths of a pixel there. A pixel has the colour of the
/// last step that it reaches, and the first's below all.
struct ErrorStep {
    double depth_px;
    std::array<uint8_t, 3> srgb;
};
const std::vector<ErrorStep>& error_steps();
/// Of pixels that hit where the reference misses, or the other way; those that both miss are clear.
constexpr std::array<uint8_t, 3> kWrongAnswer{213, 94, 0};

/// At most `widest` pixels wide: each the worst of a square of the picture's.
Picture error_map(const ReferencePicture& reference, const Frame& frame, uint32_t widest);

struct ErrorPictures {
    WorstPlace place;
    std::vector<std::byte> seen, right, map; // PNG: both pictures of the place, and the map of the whole
};

/// Pictures of a frame of the reference's view and size, shaded; `ties` as ClosestErrors has them. Nothing where the
/// colours are equal. Fails: as encode_png.
Result<ErrorPictures> error_pictures(const ReferencePicture& reference, const Frame& frame,
                                     const std::vector<size_t>& ties);

} // namespace trimray
