#include "runtime/leaf_slopes.h"

#include "format/leaf_geometry.h"

#include <cmath>
#include <numbers>

namespace trimray {

LeafSlopes leaf_slopes(const PackImage& image)
{
    LeafSlopes slopes;
    for (const LeafRecord& leaf : image.leaves) {
        if ((image.patches[leaf.patch].shape & 0xffu) != kKindBezier)
            continue;
        const double least = decode_leaf_bend(leaf).least_slope();
        ++slopes.leaves;
        for (size_t i = 0; i < slopes.proved.size(); ++i)
            slopes.proved[i] += least <= std::tan(LeafSlopes::kDegrees[i] * std::numbers::pi / 180);
        slopes.flagged += std::isinf(least);
    }
    return slopes;
}

} // namespace trimray
