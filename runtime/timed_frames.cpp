#include "runtime/timed_frames.h"

#include "runtime/thread_clock.h"

#include <algorithm>
#include <chrono>

#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace trimray {

void time_frames(const RenderOptions& options, RenderStats& stats,
                 const std::function<WorkCounts(uint32_t number, const RunEach& run_each)>& trace)
{
    const int threads = options.threads > 0 ? int(std::min(options.threads, 1024u)) : tbb::info::default_concurrency();
    tbb::task_arena arena(threads);
    const RunEach run_each = [&](uint32_t count, const std::function<void(uint32_t)>& body) {
        if (threads == 1)
            for (uint32_t i = 0; i < count; ++i)
                body(i);
        else
            arena.execute([&] { tbb::parallel_for(0u, count, body); });
    };
    stats.frame_ms.clear();
    stats.frame_cpu_ms.clear();
    for (uint32_t i = 0; i < std::max(options.frames, 1u); ++i) {
        const auto start = std::chrono::steady_clock::now();
        const double cpu_start = thread_cpu_seconds();
        const WorkCounts work = trace(i, run_each);
        const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - start;
        stats.frame_ms.push_back(spent.count());
        if (threads == 1)
            stats.frame_cpu_ms.push_back(1e3 * (thread_cpu_seconds() - cpu_start));
        if (i == 0)
            stats.work = work;
    }
}

} // namespace trimray
