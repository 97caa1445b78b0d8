// Pictures of one view timed in turns (bench_turns.h) by many contenders.
#pragma once

#include "format/result.h"
#include "runtime/bench_turns.h"
#include "runtime/tracer.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace trimray {

/// What makes pictures: a tracer, what is asked of it, and what it reads.
struct Contender {
    std::string dial, name; // as AccuracySetting's; peers have the dial "peers"
    std::shared_ptr<Tracer> tracer;
    std::function<void(RenderOptions&)> ask;
    uint64_t bytes = 0; // of the arrays that it reads beside those that RenderStats counts
    // Whose part it has in the paper's tables (REPORT.md): "one-ray", "wide", "wide-10-frames", "wide-textures" or
    // "textures-50" (percent); empty: none
    std::string paper{};
    uint32_t samples = 1; // a pixel, squared
    // Held against the smooth picture (kSmoothSamples), by its colours alone, not against the reference in double,
    // which has one sample a pixel
    bool smooth = false;
};

struct Made {
    Frame frame;
    RenderStats stats;
};

/// Fails: as Tracer::render, with the contender's name.
Result<Made> make_picture(const Contender& contender, RenderOptions render);

/// Milliseconds of a whole picture, all its frames together; on the CPU with one thread processor time. By contender,
/// one a round; what takes more than kLongPicture_ms is timed once.
using TurnTimes = std::vector<std::vector<double>>;
constexpr double kLongPicture_ms = 1000;

/// A round makes every picture once, in order and the next round backwards; each is made twice in a row and timed the
/// second time, with the caches as a viewer has them. `first` is told what each contender makes first; `progress`, what
/// is being done. Fails: as make_picture, `first`.
Result<TurnTimes> time_in_turns(const std::vector<Contender>& contenders, const RenderOptions& render, uint32_t rounds,
                                const std::function<Status(size_t contender, const Made& made)>& first,
                                const std::function<void(const std::string&)>& progress);

} // namespace trimray
