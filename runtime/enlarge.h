// Pictures traced at a part of their size and enlarged: less effort, the same view.
#pragma once

#include "runtime/tracer.h"

#include <cstdint>

namespace trimray {

/// What to trace for a picture at 1/shrink of its width and height, rounded up, so that enlarge() gives the picture of
/// `options` again: the camera sees just the pixels of the larger one, lines are as much thinner.
RenderOptions shrunk(RenderOptions options, uint32_t shrink);

/// A frame of shrunk() options at width x height: colours between those of the four nearest traced pixels, in linear
/// light, weighted by alpha; every other AOV is that of the nearest traced pixel. On `threads` threads, 0: all cores.
Frame enlarge(const Frame& frame, uint32_t width, uint32_t height, uint32_t shrink, uint32_t threads);

} // namespace trimray
