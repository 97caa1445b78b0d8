// The vector part of the CPU tracer: traces a block of pixels in packets of 16 rays, compiled once per instruction set.
#pragma once

#include "format/trim_reference.h"
#include "runtime/border_cells.h"
#include "runtime/cpu_view.h"
#include "runtime/edge_lines.h"
#include "runtime/frame_effects.h"
#include "runtime/light_view.h"
#include "runtime/materials.h"
#include "runtime/section_view.h"
#include "runtime/stochastic_frames.h"
#include "runtime/tracer.h"
#include "shaders/frame_layout.h"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace trimray {

/// Pixels [x0, x1) x [y0, y1) of the picture, at most kBlockSide a side.
struct Block {
    uint32_t x0, y0, x1, y1;
};

constexpr uint32_t kBlockSide = kEdgeBlockSide; // pixels: candidates are collected once for so many
constexpr uint32_t kTileSide = 16;

/// The pixels of a row of tiles, or of a whole block, on their way to the frame: whole rows go there past the caches.
struct Strip {
    alignas(64) float rgba[kBlockSide][kBlockSide * 4];
    alignas(64) float normal[kBlockSide][kBlockSide * 3];
    alignas(64) float uv[kBlockSide][kBlockSide * 2];
    alignas(64) float depth[kBlockSide][kBlockSide];
    alignas(64) int32_t face[kBlockSide][kBlockSide];
    alignas(64) int32_t instance[kBlockSide][kBlockSide];
    alignas(64) uint8_t certified[kBlockSide][kBlockSide];
    std::vector<float> map_value; // kBlockSide a row, where a map measures; otherwise empty
};

/// A patch as the rays of a view see it.
struct EdgeView {
    uint32_t patch = ~0u, instance = ~0u;
    PatchView view{};
};

/// A LeafPlane (shaders/shared/leaf_proof.h), whose type is each instruction set's own.
struct LeafMiddle {
    float values[32];
};

/// Planes of leaves that rays from elsewhere met, by the leaf's number modulo kCount.
struct FreeMiddles {
    static constexpr size_t kCount = 256;
    std::vector<LeafMiddle> middle;
    std::vector<uint32_t> leaf; // whose; ~0: none
};

/// Where 16 candidates are on the picture. Places without one have an x0 that no pixel meets.
struct RectGroup {
    float x0[16], x1[16], y0[16], y1[16];
};
struct CandidateGroup {
    RectGroup rect;
    struct Strips {
        float nx[16], ny[16], lo[16], hi[16]; // PixelStrip, wider: a packet meets it where its middle lies in it
    } strip[2];
    float near_mm[16];
    uint32_t index[16]; // of the block's candidates
};

/// What candidates are sorted by, and which of them it is.
struct CandidateKey {
    float near_mm;
    uint32_t instance, leaf, at;
};

/// What a block's tracing reads and writes; one a thread, reused.
struct BlockScratch {
    std::vector<uint32_t> stack; // of nodes
    std::vector<Candidate> unsorted, candidates;
    std::vector<CandidateKey> keys;
    std::vector<PatchView> patch_views; // by candidate
    std::vector<uint8_t> has_view;
    std::vector<LeafMiddle> leaf_middles; // by candidate
    std::vector<uint8_t> has_middle;
    std::vector<RectGroup> rects;            // of the candidates, in their order
    std::vector<CandidateGroup> tile_groups; // a tile's candidates, in their order
    Strip strip;
    std::vector<TrimQueries> trim_queries; // of all blocks so far, where the job records them
    FreeMiddles free_middles;              // where a picture needs such rays
    std::vector<EdgeView> edge_views;
    BlockMarks edge_marks;
};

/// Borders are asked for: how far, among what, and where to note them.
struct EdgeJob {
    EdgeQuery query;
    const BorderCells& cells;
    EdgeMap& map;
    const RenderOptions& options;  // what lines look like
    const BlockLineDrawer* drawer; // null: lines are drawn over the frame, not over each block
};

/// One frame of ClosestPolicy::Stochastic.
struct StochasticJob {
    std::array<float, 2> start; // start_of_frame
    KeptHits* kept;             // null: there is one frame alone
};

/// A map is drawn on surfaces.
struct MapJob {
    uint map; // kMap
    MapView view;
    bool measures; // Frame::map_value is wanted
};

struct BlockJob {
    const CpuScene& scene;
    const View& view;
    uint32_t width, height;
    TrimMode trim; // not auto
    bool shade;
    float error_px;
    const KdTrims* kd = nullptr;              // TrimMode::Kd has them
    const TrimReference* reference = nullptr; // TrimMode::Reference has one
    bool record_trim_queries = false;
    const EdgeJob* edges = nullptr;            // null: nobody asks for borders
    const StochasticJob* stochastic = nullptr; // null: ClosestPolicy::Certified
    const FrameLights* light = nullptr;        // null: the light at the eye alone
    const SectionView* section = nullptr;      // null: nothing is cut away
    const MaterialTable* materials = nullptr;  // null: what the pack says
    const Environment* environment = nullptr;  // null: nothing is behind the model
    const PlaceView* places = nullptr;         // where there is light or a section
    std::span<const WorldToPart> to_part = {}; // by instance, where rays begin elsewhere than at the eye
    const MapJob* map = nullptr;               // null: surfaces have their own colours
    bool specialise = true;                    // false: by the instance that can do everything
};

/// Traces the block into `frame`, whose arrays have their size.
using TraceBlock = void (*)(const BlockJob& job, const Block& block, BlockScratch& scratch, Frame& frame,
                            WorkCounts& work);

/// The fastest version that this machine runs, or the one named: "avx512", "avx2", "sse4". Null: unknown or not here.
TraceBlock find_trace_block(const std::string& instruction_set, std::string& found);

/// Answers queries[i] in the mode `trim` (not auto, not reference), as tracing does, into inside[i]; bits of lanes that
/// do not ask mean nothing. Shapes: as many of one as of the other. Domain: a mode that CpuTracer would not refuse.
using AnswerTrims = void (*)(const CpuScene& scene, TrimMode trim, std::span<const TrimQueries> queries,
                             std::span<uint16_t> inside);
AnswerTrims find_answer_trims(const std::string& instruction_set);

} // namespace trimray
