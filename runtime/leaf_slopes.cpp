#include "runtime/leaf_slopes.h"

#include "format/leaf_geometry.h"

#include <cmath>
#include <numbers>

namespace trimray {

LeafSlopes leaf_slopes(const PackImage& image)
{
    LeafSlopes slopes;
    std::array<double, LeafSlopes::kDegrees.size()> tangents;
    for (size_t i = 0; i < tangents.size(); ++i)
        tangents[i] = std::tan(LeafSlopes::kDegrees[i] * std::numbers::pi / 180);
    for (const LeafRecord& leaf : image.leaves) {
        if ((image.patches[leaf.patch].shape & 0xffu) != kKindBezier)
            continue;
        const double least = decode_leaf_bend(leaf).least_slope();
        ++slopes.leaves;
        for (size_t i = 0; i < slopes.proved.size(); ++i)
            slopes.proved[i] += least <= tangents[i];
        slopes.flagged += std::isinf(least);
    }
    return slopes;
}

} // namespace trimray
