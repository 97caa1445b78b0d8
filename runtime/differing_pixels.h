// Compares two pictures of the same scene pixel by pixel.
#pragma once

#include "runtime/tracer.h"

#include <cstdint>

namespace trimray {

/// Pixels whose bits differ in any channel, map values aside. Shapes: both of the same size.
uint64_t differing_pixels(const Frame& a, const Frame& b);

} // namespace trimray
