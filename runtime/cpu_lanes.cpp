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

alignas(64) constexpr uint kLaneNumbers[kLanes] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};

void trace_block(const BlockJob& job, const Block& block, BlockScratch& scratch, Frame& frame, WorkCounts& work)
{
    if (!job.specialise || job.section || (job.materials && job.materials->transparent))
        BlockTracer<Effects::Spans>(job, scratch, frame, work).trace(block);
    else if (job.light || job.materials || job.map || job.environment)
        BlockTracer<Effects::Look>(job, scratch, frame, work).trace(block);
    else
        BlockTracer<Effects::None>(job, scratch, frame, work).trace(block);
}

HWY_ATTR void answer_trims(const CpuScene& scene, TrimMode trim, std::span<const TrimQueries> queries,
                           std::span<uint16_t> inside)
{
    const FetchSource source = fetch_source(scene.image, trim == TrimMode::Kd ? &*scene.kd_trims() : nullptr);
    uint64_t curve_tests = 0;
    for (size_t i = 0; i < queries.size(); ++i) {
        const TrimQueries& q = queries[i];
        const mask asked = (integer(q.asked) >> load(kLaneNumbers) & integer(1u)) != integer(0u);
        const real2 uv(load(q.u), load(q.v));
        const FaceRecord& face = scene.image.faces[q.face];
        inside[i] = static_cast<uint16_t>(lane_bits(inside_trims(source, trim, q.face, face, uv, asked, curve_tests)));
    }
}

} // namespace HWY_NAMESPACE
} // namespace trimray
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace trimray {

namespace {

/// What one target has.
struct Entries {
    TraceBlock trace_block = nullptr;
    AnswerTrims answer_trims = nullptr;
};

Entries find_entries(const std::string& instruction_set, std::string& found)
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
            return {&N_AVX3::trace_block, &N_AVX3::answer_trims};
#endif
#if HWY_TARGETS & HWY_AVX2
        case HWY_AVX2:
            return {&N_AVX2::trace_block, &N_AVX2::answer_trims};
#endif
#if HWY_TARGETS & HWY_SSE4
        case HWY_SSE4:
            return {&N_SSE4::trace_block, &N_SSE4::answer_trims};
#endif
        }
    }
    return {};
}

} // namespace

TraceBlock find_trace_block(const std::string& instruction_set, std::string& found)
{
    return find_entries(instruction_set, found).trace_block;
}

AnswerTrims find_answer_trims(const std::string& instruction_set)
{
    std::string found;
    return find_entries(instruction_set, found).answer_trims;
}

} // namespace trimray

#endif
