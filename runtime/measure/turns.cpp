#include "runtime/measure/turns.h"

#include "runtime/command_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

namespace trimray {
namespace {

double picture_ms(const RenderStats& stats)
{
    const std::vector<double>& ms = stats.frame_cpu_ms.empty() ? stats.frame_ms : stats.frame_cpu_ms;
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
    const size_t count = contenders.size();
    TurnTimes times(count);
    for (uint32_t round = 0; round < rounds; ++round)
        for (size_t turn = 0; turn < count; ++turn) {
            const size_t i = round % 2 == 0 ? turn : count - 1 - turn;
            if (round > 0 && times[i].front() > kLongPicture_ms)
                continue;
            progress(fmt::format("round {} of {}: {}", round + 1, rounds, contenders[i].name));
            Result<Made> made = make_picture(contenders[i], render);
            if (!made.ok())
                return made.error();
            if (round == 0)
                if (const Status taken = first(i, *made); !taken.ok())
                    return taken.error();
            if (picture_ms(made->stats) <= kLongPicture_ms) {
                made = make_picture(contenders[i], render);
                if (!made.ok())
                    return made.error();
            }
            times[i].push_back(picture_ms(made->stats));
        }
    return times;
}

std::vector<double> time_ratios(const std::vector<double>& ms, const std::vector<double>& base_ms)
{
    std::vector<double> ratios(std::min(ms.size(), base_ms.size()));
    for (size_t round = 0; round < ratios.size(); ++round)
        ratios[round] = ms[round] / base_ms[round];
    return ratios;
}

} // namespace trimray
