// The paper's own method for closest hits (Kunts et al., section 1), beside which ours is measured: one start a leaf
// and frame, the same place in every leaf; each pixel keeps the nearest hit of all frames.
#pragma once

#include "runtime/tracer.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace trimray {

/// Whether pixels keep hits from frame to frame.
inline bool keeps_hits(const RenderOptions& options)
{
    return options.closest == ClosestPolicy::Stochastic && options.frames > 1;
}

constexpr float kNothingKept = 1e30f; // a kept hit's place where there is none: kHuge of shaders/shared/language.h

/// (u^, v^) of a frame, counted from 0: the middle in the first (eq. 1), drawn uniformly from [0, 1)^2 in later ones
/// (eq. 3). The same on every machine.
inline std::array<float, 2> start_of_frame(uint32_t frame)
{
    if (frame == 0)
        return {0.5f, 0.5f};
    const auto uniform = [](uint32_t n) { // MurmurHash3's finaliser
        n = (n ^ n >> 16) * 0x85ebca6bu;
        n = (n ^ n >> 13) * 0xc2b2ae35u;
        return static_cast<float>((n ^ n >> 16) >> 8) * 0x1p-24f;
    };
    return {uniform(2 * frame), uniform(2 * frame + 1)};
}

/// The nearest hits so far of a packet of 4 x 4 pixels, lane by lane. Fields: PacketHit (runtime/cpu_write.h).
struct KeptPacket {
    alignas(64) float best[16];
    alignas(64) float u_face[16], v_face[16];
    alignas(64) float normal[3][16];
    alignas(64) uint32_t leaf[16], instance[16];
};

/// Those of a picture that the CPU tracer makes in several frames.
struct KeptHits {
    uint32_t columns = 0; // packets a row
    std::vector<KeptPacket> packets;

    KeptPacket& of_packet(uint32_t x, uint32_t y) { return packets[size_t{y / 4} * columns + x / 4]; }
};

/// Before the first frame.
inline KeptHits no_hits(uint32_t width, uint32_t height)
{
    KeptPacket none{};
    std::fill_n(none.best, 16, kNothingKept);
    std::fill_n(none.leaf, 16, ~0u);
    std::fill_n(none.instance, 16, ~0u);
    const uint32_t columns = (width + 3) / 4, rows = (height + 3) / 4;
    return {columns, std::vector<KeptPacket>(size_t{columns} * rows, none)};
}

} // namespace trimray
