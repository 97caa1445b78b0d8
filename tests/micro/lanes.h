// The shared formulas in lanes, over whole arrays of packets, by the best instruction set of this machine: what the
// benchmarks of evaluation and of Newton's iteration time.
#pragma once

#include "format/pack_image.h"

#include <cstdint>
#include <span>

namespace trimray::micro {

constexpr int kPacket = 16; // rays

struct PacketUv {
    alignas(64) float u[kPacket], v[kPacket]; // uv_patch
};

/// Patch space; directions need not be unit.
struct PacketRays {
    alignas(64) float origin[3][kPacket], direction[3][kPacket];
};

/// The one of patches[patch] of an image.
struct LanePatch {
    const PackImage& image;
    uint32_t patch;
};

/// Name of the instruction set, as Highway gives it.
const char* lanes_name();

struct PacketPoints {
    alignas(64) float p[3][kPacket]; // patch units
};

/// The surface at `at`. Shapes: as many of one as of the other.
void surface_points(const LanePatch& patch, std::span<const PacketUv> at, std::span<PacketPoints> points);

// Those that are timed return a sum that depends on all answers, so that none can be left out.

/// Points and first derivatives.
float evaluate_points(const LanePatch& patch, std::span<const PacketUv> at);

/// One step of Newton's iteration for each ray, from the patch's middle, which is evaluated once for all.
float newton_steps(const LanePatch& patch, std::span<const PacketRays> rays);

struct Solved {
    uint64_t found = 0, steps = 0; // rays; a ray each
};

/// Plain Newton from the middle of a leaf of the patch, until a point lies within 4e-6 patch units of its ray: the
/// paper's.
Solved newton_plain(const LanePatch& patch, uint32_t leaf, std::span<const PacketRays> rays);

/// The search of a certified picture in the leaf: Newton's iteration with its proofs, without splits.
Solved newton_proved(const LanePatch& patch, uint32_t leaf, std::span<const PacketRays> rays);

} // namespace trimray::micro
