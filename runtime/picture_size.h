// How large a picture is.
#pragma once

#include <cstdint>

namespace trimray {

/// Pixels.
struct PictureSize {
    uint32_t width = 1, height = 1;
};

} // namespace trimray
