// A 4-wide tree with quantised boxes over a set of boxes. The splits are Embree's (binned SAH, largest child first).
#pragma once

#include "format/pack_layout.h"

#include <embree3/rtcore.h>

#include <array>
#include <vector>

namespace trimray {

struct Box3f {
    std::array<float, 3> lo, hi;
};

struct Bvh {
    std::vector<BvhNode> nodes; // root first, parents before children; leaf slots hold kBvhLeaf | index of the box
    std::vector<uint> order;    // indices of the boxes as a walk from the root meets them
};

/// Returns the tree over `boxes`; no nodes for no boxes. Deterministic on any number of threads. A node's children's
/// decoded boxes hold everything below them, with origin and step evaluated in single precision.
/// Domain: finite boxes, lo <= hi, fewer than 2^31.
Bvh build_bvh(RTCDevice device, const std::vector<Box3f>& boxes);

} // namespace trimray
