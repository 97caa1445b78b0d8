#include "runtime/measure/turns.h"

#include "runtime/command_trace.h"

#include <fmt/format.h>

#include <numeric>
#include <utility>

namespace trimray {
namespace {

double picture_ms(const RenderStats& stats)
{
    const std::vector<double>& ms = frame_times(stats);
    return std::accumulate(ms.begin(), ms.end(), 0.0);
}

} // namespace

Result<Made> make_picture(const Contender& contender, RenderOptions render)
{
    contender.ask(render);
    Made made;
    Result<Frame> frame = trace_picture(*contender.tracer, render, contender.samples, made.stats);
    if (!frame.ok())
        return Error{frame.error().code, frame.error().where, contender.name + ": " + frame.error().detail};
    made.frame = std::move(*frame);
    return made;
}

Result<TurnTimes> time_in_turns(const std::vector<Contender>& contenders, const RenderOptions& render, uint32_t rounds,
                                const std::function<Status(size_t, const Made&)>& first,
                                const std::function<void(const std::string&)>& progress)
{
    TurnTimes times(contenders.size());
    const Status timed = take_turns(rounds, contenders.size(), [&](uint32_t round, size_t i) -> Status {
        if (round > 0 && times[i].front() > kLongPicture_ms)
            return Done{};
        progress(fmt::format("round {} of {}: {}", round + 1, rounds, contenders[i].name));
        Result<Made> made = make_picture(contenders[i], render);
        if (!made.ok())
            return made.error();
        if (round == 0)
            if (const Status taken = first(i, *made); !taken.ok())
                return taken;
        if (picture_ms(made->stats) <= kLongPicture_ms) {
            made = make_picture(contenders[i], render);
            if (!made.ok())
                return made.error();
        }
        times[i].push_back(picture_ms(made->stats));
        return Done{};
    });
    if (!timed.ok())
        return timed.error();
    return times;
}

} // namespace trimray
