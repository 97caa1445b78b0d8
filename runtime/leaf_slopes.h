// How steep a ray must be to be proved to meet a leaf once, over a pack's leaves: what its effect plan and `trimray
// info` say about them.
#pragma once

#include "format/pack_image.h"

#include <array>
#include <cstddef>

namespace trimray {

/// Bezier leaves by LeafBend::least_slope.
struct LeafSlopes {
    static constexpr std::array<int, 4> kDegrees = {5, 10, 20, 45}; // of a ray against the leaf's middle plane

    size_t leaves = 0;
    std::array<size_t, kDegrees.size()> proved{}; // for every ray steeper than kDegrees[i]
    size_t flagged = 0;                           // for no ray
};

LeafSlopes leaf_slopes(const PackImage& image);

} // namespace trimray
