#include "runtime/view/picture_turns.h"

#include "runtime/bench_turns.h"
#include "runtime/command_trace.h"

#include <chrono>
#include <numeric>

namespace trimray {
namespace {

using Clock = std::chrono::steady_clock;

struct Made {
    Frame frame;
    RenderStats stats;
    double ms() const
    {
        const std::vector<double>& frames = frame_times(stats);
        return std::accumulate(frames.begin(), frames.end(), 0.0);
    }
};

Result<Made> make(Tracer& tracer, const RenderOptions& options, uint32_t samples)
{
    if (options.is_cancelled())
        return given_up();
    RenderOptions traced = at_samples(options, samples);
    traced.reuse_last = false;
    Made made;
    Result<Frame> frame = tracer.render(traced, made.stats);
    if (!frame.ok())
        return frame.error();
    made.frame = std::move(*frame);
    return made;
}

} // namespace

Result<std::vector<PictureTimes>>
time_pictures(Tracer& tracer, std::span<const RenderOptions> pictures, const TurnOptions& options,
              const std::function<Status(size_t, const Frame&, const RenderStats&)>& first,
              const std::function<void(const std::vector<PictureTimes>&)>& paired)
{
    const uint32_t pairs = (options.rounds + 1) / 2;
    const double turns = double(pictures.size()) * (2.0 * pairs + 1);
    double done = 0;
    const auto tell = [&] {
        done += 1;
        if (options.progress)
            options.progress(done / turns);
    };
    std::vector<PictureTimes> times(pictures.size());
    std::vector<uint8_t> warms(pictures.size(), 0);
    const auto start = Clock::now();
    for (size_t i = 0; i < pictures.size(); ++i) {
        const Result<Made> made = make(tracer, pictures[i], options.samples);
        if (!made.ok())
            return made.error();
        times[i].work = made->stats.work;
        warms[i] = made->ms() <= kNoWarmingMs;
        if (first)
            if (const Status taken = first(i, made->frame, made->stats); !taken.ok())
                return taken.error();
        tell();
    }
    const auto turn = [&](uint32_t, size_t i) -> Status {
        if (warms[i])
            if (const Result<Made> made = make(tracer, pictures[i], options.samples); !made.ok())
                return made.error();
        const Result<Made> made = make(tracer, pictures[i], options.samples);
        if (!made.ok())
            return made.error();
        times[i].ms.push_back(made->ms());
        tell();
        return Done{};
    };
    for (uint32_t pair = 0; pair < pairs; ++pair) {
        if (pair > 0 && std::chrono::duration<double>(Clock::now() - start).count() > options.seconds)
            break;
        if (const Status taken = take_turns(2, pictures.size(), turn); !taken.ok())
            return taken.error();
        if (paired)
            paired(times);
    }
    if (options.progress && done < turns) // time was short
        options.progress(1);
    return times;
}

} // namespace trimray
