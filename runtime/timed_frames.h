// The frames of a picture, one after the other on the threads that are asked for, and what each takes.
#pragma once

#include "runtime/frame_effects.h"
#include "runtime/tracer.h"

#include <cstdint>
#include <functional>

namespace trimray {

/// Calls trace(number, run_each) for each frame of `options`, from 0; run_each spreads its work over the threads.
/// Fills in `stats` each frame's time and, where that is one thread's, its processor time; and the first frame's work,
/// which trace returns.
void time_frames(const RenderOptions& options, RenderStats& stats,
                 const std::function<WorkCounts(uint32_t number, const RunEach& run_each)>& trace);

} // namespace trimray
