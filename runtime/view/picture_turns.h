// Several pictures by one tracer timed in turns (bench_turns.h), while somebody waits: it can be given up, tells how
// far it is, and ends in time.
#pragma once

#include "format/result.h"
#include "runtime/tracer.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace trimray {

struct TurnOptions {
    uint32_t samples = 1; // N x N a pixel
    uint32_t rounds = 6;  // at most; an odd number is rounded up, for rounds go in pairs, there and back
    double seconds = 10;  // after so many no pair of rounds begins; the first pair is made whatever it takes
    std::function<void(double share)> progress{}; // told the share of the rounds that is done, from this thread
};

struct PictureTimes {
    std::vector<double> ms; // one a round; on the CPU with one thread processor time
    WorkCounts work;        // of one picture
};

/// Makes every picture once untimed, which prepares what it needs, then in rounds. A picture is made twice in a row in
/// a round and timed the second time, unless it takes longer than kNoWarmingMs. `first` is told each picture that is
/// made untimed, `paired` what has been measured after each pair of rounds; either may be empty. Each picture has
/// RenderOptions::frames frames, and their sum is its time; reuse_last is not used, for the same picture again would
/// cost next to nothing.
/// Fails: Interrupted where any picture's RenderOptions::cancelled says so; as Tracer::render and `first`.
Result<std::vector<PictureTimes>>
time_pictures(Tracer& tracer, std::span<const RenderOptions> pictures, const TurnOptions& options,
              const std::function<Status(size_t which, const Frame& frame, const RenderStats& stats)>& first,
              const std::function<void(const std::vector<PictureTimes>& so_far)>& paired);
constexpr double kNoWarmingMs = 250; // what a picture fetches into the caches anew takes a hundredth of it

} // namespace trimray
