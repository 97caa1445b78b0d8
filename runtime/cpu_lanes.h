// The vector part of the CPU tracer: traces a block of pixels in packets of 16 rays, compiled once per instruction set.
#pragma once

#include "runtime/cpu_view.h"
#include "runtime/tracer.h"

#include <cstdint>
#include <string>
#include <vector>

namespace trimray {

/// Pixels [x0, x1) x [y0, y1) of the picture.
struct Block {
    uint32_t x0, y0, x1, y1;
};

/// What a block's tracing reads and writes; one a thread, reused.
struct BlockScratch {
    CandidateScratch walk;
    std::vector<Candidate> candidates;
    std::vector<PatchView> patch_views; // by candidate
    std::vector<uint8_t> has_view;
    // a tile's candidates, each array padded to whole packets
    std::vector<float> x0, x1, y0, y1, near_mm;
    std::vector<uint32_t> index;
};

struct BlockJob {
    const CpuScene& scene;
    const View& view;
    uint32_t width, height;
    bool use_sdf;
    bool shade;
    float error_px;
};

/// Traces the block into `frame`, whose arrays have their size.
using TraceBlock = void (*)(const BlockJob& job, const Block& block, BlockScratch& scratch, Frame& frame,
                            WorkCounts& work);

/// The fastest version that this machine runs, or the one named: "avx512", "avx2", "sse4". Null: unknown or not here.
TraceBlock find_trace_block(const std::string& instruction_set, std::string& found);

} // namespace trimray
