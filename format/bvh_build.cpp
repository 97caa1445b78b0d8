#include "format/bvh_build.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <span>

namespace trimray {
namespace {

constexpr uint kWidth = 4;

/// A node or leaf while the tree is being built.
struct BuildNode {
    uint child_count = 0; // 0: a leaf
    uint box = 0;         // of a leaf
    BuildNode* child[kWidth] = {};
};

void* create_node(RTCThreadLocalAllocator allocator, unsigned int child_count, void*)
{
    auto* node = new (rtcThreadLocalAlloc(allocator, sizeof(BuildNode), alignof(BuildNode))) BuildNode;
    node->child_count = child_count;
    return node;
}
void set_children(void* node, void** children, unsigned int child_count, void*)
{
    for (unsigned int i = 0; i < child_count; ++i)
        static_cast<BuildNode*>(node)->child[i] = static_cast<BuildNode*>(children[i]);
}
void set_bounds(void*, const RTCBounds**, unsigned int, void*)
{
    // boxes are gathered bottom-up when the nodes are written
}
void* create_leaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* primitives, size_t, void*)
{
    auto* leaf = new (rtcThreadLocalAlloc(allocator, sizeof(BuildNode), alignof(BuildNode))) BuildNode;
    leaf->box = primitives->primID;
    return leaf;
}

BuildNode* build_with_embree(RTCBVH bvh, const std::vector<Box3f>& boxes)
{
    std::vector<RTCBuildPrimitive> primitives(boxes.size());
    for (size_t i = 0; i < boxes.size(); ++i) {
        const auto& [lo, hi] = boxes[i];
        primitives[i] = {lo[0], lo[1], lo[2], 0, hi[0], hi[1], hi[2], static_cast<uint>(i)};
    }
    RTCBuildArguments arguments = rtcDefaultBuildArguments();
    arguments.buildQuality = RTC_BUILD_QUALITY_HIGH;
    arguments.maxBranchingFactor = kWidth;
    arguments.maxDepth = kMaxBvhDepth - 1; // leaves count as a level there
    arguments.minLeafSize = 1;
    arguments.maxLeafSize = 1;
    arguments.bvh = bvh;
    arguments.primitives = primitives.data();
    arguments.primitiveCount = primitives.size();
    arguments.primitiveArrayCapacity = primitives.size();
    arguments.createNode = create_node;
    arguments.setNodeChildren = set_children;
    arguments.setNodeBounds = set_bounds;
    arguments.createLeaf = create_leaf;
    return static_cast<BuildNode*>(rtcBuildBVH(&arguments));
}

/// A balanced tree by the middle of the longest axis: for sets of one node, and where Embree's depth limit is met.
BuildNode* build_balanced(const std::vector<Box3f>& boxes, std::span<uint> items, std::vector<BuildNode>& storage)
{
    BuildNode* node = &storage.emplace_back(); // storage is reserved: addresses stay
    if (items.size() == 1) {
        node->box = items[0];
        return node;
    }
    Box3f all{{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (const uint item : items) {
        for (int c = 0; c < 3; ++c) {
            all.lo[c] = std::min(all.lo[c], boxes[item].lo[c]);
            all.hi[c] = std::max(all.hi[c], boxes[item].hi[c]);
        }
    }
    int axis = 0;
    for (int c = 1; c < 3; ++c)
        if (all.hi[c] - all.lo[c] > all.hi[axis] - all.lo[axis])
            axis = c;
    std::sort(items.begin(), items.end(), [&](uint a, uint b) {
        const float middle_a = boxes[a].lo[axis] + boxes[a].hi[axis], middle_b = boxes[b].lo[axis] + boxes[b].hi[axis];
        return middle_a != middle_b ? middle_a < middle_b : a < b;
    });
    node->child_count = static_cast<uint>(std::min<size_t>(kWidth, items.size()));
    for (uint i = 0; i < node->child_count; ++i) {
        const size_t first = items.size() * i / node->child_count, last = items.size() * (i + 1) / node->child_count;
        node->child[i] = build_balanced(boxes, items.subspan(first, last - first), storage);
    }
    return node;
}

Box3f joined(const Box3f& a, const Box3f& b)
{
    Box3f out = a;
    for (int c = 0; c < 3; ++c) {
        out.lo[c] = std::min(a.lo[c], b.lo[c]);
        out.hi[c] = std::max(a.hi[c], b.hi[c]);
    }
    return out;
}

/// Fills origin, exponents, lo and hi of a node so that each child's decoded box holds the child's box.
void quantise(const std::array<Box3f, kWidth>& children, uint count, BvhNode& node)
{
    constexpr int kLeastExponent = -60, kBias = 127; // thinner than 1e-18 of a part is flat
    Box3f all = children[0];
    for (uint i = 1; i < count; ++i)
        all = joined(all, children[i]);
    node.exponents = count << 24;
    for (int c = 0; c < 3; ++c) {
        const float origin = all.lo[c];
        node.origin[c] = origin;
        int exponent = kLeastExponent;
        const double extent = double(all.hi[c]) - origin;
        if (extent > 0)
            exponent = std::max(kLeastExponent, std::ilogb(extent / 255));
        for (bool fits = false; !fits; ++exponent) {
            const float step = std::ldexp(1.0f, exponent);
            fits = true;
            node.lo[c] = 0;
            node.hi[c] = 0;
            for (uint i = 0; i < count; ++i) {
                int lo = std::clamp(static_cast<int>((double(children[i].lo[c]) - origin) / step), 0, 255);
                while (lo > 0 && origin + step * float(lo) > children[i].lo[c])
                    --lo;
                int hi = std::min(static_cast<int>(std::min((double(children[i].hi[c]) - origin) / step, 256.0)), 256);
                while (hi < 256 && origin + step * float(hi) < children[i].hi[c])
                    ++hi;
                fits = fits && hi <= 255;
                node.lo[c] |= uint(lo & 255) << 8 * i;
                node.hi[c] |= uint(hi & 255) << 8 * i;
            }
            if (fits)
                node.exponents |= uint(exponent + kBias) << 8 * c;
        }
        for (uint i = count; i < kWidth; ++i)
            node.lo[c] |= 255u << 8 * i; // empty: lo > hi
    }
}

/// Writes the nodes below `from` in preorder and returns its box.
Box3f write_nodes(const std::vector<Box3f>& boxes, const BuildNode& from, Bvh& bvh, uint depth)
{
    assert(depth <= kMaxBvhDepth && "the builders keep the depth");
    const size_t index = bvh.nodes.size();
    bvh.nodes.emplace_back();
    BvhNode node{};
    std::array<Box3f, kWidth> children;
    for (uint i = 0; i < from.child_count; ++i) {
        const BuildNode& child = *from.child[i];
        if (child.child_count == 0) {
            node.child[i] = kBvhLeaf | child.box;
            bvh.order.push_back(child.box);
            children[i] = boxes[child.box];
        } else {
            node.child[i] = static_cast<uint>(bvh.nodes.size());
            children[i] = write_nodes(boxes, child, bvh, depth + 1);
        }
    }
    for (uint i = from.child_count; i < kWidth; ++i)
        node.child[i] = kBvhEmpty;
    quantise(children, from.child_count, node);
    bvh.nodes[index] = node;
    Box3f all = children[0];
    for (uint i = 1; i < from.child_count; ++i)
        all = joined(all, children[i]);
    return all;
}

} // namespace

Bvh build_bvh(RTCDevice device, const std::vector<Box3f>& boxes)
{
    Bvh out;
    if (boxes.empty())
        return out;
    out.order.reserve(boxes.size());
    const BuildNode* root = nullptr;
    RTCBVH bvh = nullptr;
    if (boxes.size() > kWidth) {
        bvh = rtcNewBVH(device);
        root = build_with_embree(bvh, boxes);
    }
    std::vector<BuildNode> storage;
    if (!root) {
        std::vector<uint> items(boxes.size());
        std::iota(items.begin(), items.end(), 0u);
        storage.reserve(2 * boxes.size());
        root = build_balanced(boxes, items, storage);
    }
    BuildNode single; // one box still gets one node
    if (root->child_count == 0) {
        single.child_count = 1;
        single.child[0] = const_cast<BuildNode*>(root);
        root = &single;
    }
    write_nodes(boxes, *root, out, 1);
    if (bvh)
        rtcReleaseBVH(bvh);
    return out;
}

} // namespace trimray
