#include "runtime/bench_turns.h"

#include <algorithm>

namespace trimray {

Status take_turns(uint32_t rounds, size_t count, const std::function<Status(uint32_t, size_t)>& turn)
{
    for (uint32_t round = 0; round < rounds; ++round)
        for (size_t i = 0; i < count; ++i)
            if (const Status taken = turn(round, round % 2 == 0 ? i : count - 1 - i); !taken.ok())
                return taken;
    return Done{};
}

const std::vector<double>& frame_times(const RenderStats& stats)
{
    return stats.frame_cpu_ms.empty() ? stats.frame_ms : stats.frame_cpu_ms;
}

std::vector<double> time_ratios(const std::vector<double>& ms, const std::vector<double>& base_ms)
{
    std::vector<double> ratios(std::min(ms.size(), base_ms.size()));
    for (size_t round = 0; round < ratios.size(); ++round)
        ratios[round] = ms[round] / base_ms[round];
    return ratios;
}

} // namespace trimray
