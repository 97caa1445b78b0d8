// Compiled once for each target by foreach_target.h; the targets' own code is in cpu_packet.h and the shared formulas.
// GCC's flags make SSE4 the least of them (CMakeLists.txt).
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/cpu_lanes.cpp"
#include <hwy/foreach_target.h>

#include "runtime/cpu_lanes.h"
#include "runtime/cpu_packet.h"

HWY_BEFORE_NAMESPACE();
namespace trimray {
namespace HWY_NAMESPACE {

void trace_block(const BlockJob& job, const Block& block, BlockScratch& scratch, Frame& frame, WorkCounts& work)
{
    BlockTracer(job, scratch, frame, work).trace(block);
}

} // namespace HWY_NAMESPACE
} // namespace trimray
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace trimray {

HWY_EXPORT(trace_block);

TraceBlock find_trace_block(const std::string& instruction_set, std::string& found)
{
    struct Named {
        const char* name;
        int64_t target;
    };
    const Named kTargets[] = {{"avx512", HWY_AVX3}, {"avx2", HWY_AVX2}, {"sse4", HWY_SSE4}};
    for (const Named& named : kTargets) {
        if (!instruction_set.empty() && instruction_set != named.name)
            continue;
        if ((hwy::SupportedTargets() & HWY_TARGETS & named.target) == 0)
            continue;
        found = named.name;
        switch (named.target) {
#if HWY_TARGETS & HWY_AVX3
        case HWY_AVX3:
            return &N_AVX3::trace_block;
#endif
#if HWY_TARGETS & HWY_AVX2
        case HWY_AVX2:
            return &N_AVX2::trace_block;
#endif
#if HWY_TARGETS & HWY_SSE4
        case HWY_SSE4:
            return &N_SSE4::trace_block;
#endif
        }
    }
    return nullptr;
}

} // namespace trimray

#endif
