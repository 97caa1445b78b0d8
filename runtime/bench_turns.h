// Turns, so that what slows the machine for a while falls on all alike, and the times that are taken in them.
#pragma once

#include "format/result.h"
#include "runtime/tracer.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace trimray {

/// Lets each of `count` take its turn once a round, in order and the next round backwards. Fails: as `turn`, at once.
Status take_turns(uint32_t rounds, size_t count, const std::function<Status(uint32_t round, size_t which)>& turn);

/// Milliseconds of each frame; on the CPU with one thread processor time.
const std::vector<double>& frame_times(const RenderStats& stats);

/// Times over those of a base in the same round, for the rounds that both have.
std::vector<double> time_ratios(const std::vector<double>& ms, const std::vector<double>& base_ms);

} // namespace trimray
