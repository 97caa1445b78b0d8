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
    Box3f bounds{};       // of all boxes below
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

/// Gathers the boxes from the leaves up.
void join_boxes(const std::vector<Box3f>& boxes, BuildNode& node)
{
    if (node.child_count == 0) {
        node.bounds = boxes[node.box];
        return;
    }
    for (uint i = 0; i < node.child_count; ++i) {
        join_boxes(boxes, *node.child[i]);
        node.bounds = i == 0 ? node.child[0]->bounds : joined(node.bounds, node.child[i]->bounds);
    }
}

/// Fills exponents, lo and hi of a node, whose origin is at or below all children, so that each child's decoded box
/// holds the child's box.
void quantise(const BuildNode& from, BvhNode& node)
{
    const uint count = from.child_count;
    std::array<Box3f, kWidth> children;
    for (uint i = 0; i < count; ++i)
        children[i] = from.child[i]->bounds;
    constexpr int kLeastExponent = -60, kBias = 127; // thinner than 1e-18 of a part is flat
    const Box3f& all = from.bounds;
    node.exponents = count << 24;
    for (int c = 0; c < 3; ++c) {
        const float origin = node.origin[c];
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

/// Writes the nodes below `from` in preorder. A node's origin is its box's corner as the parent's quantised box has it:
/// it holds no news, so it costs nothing in a file (SPEC.md, filter 2).
void write_nodes(const BuildNode& from, const std::array<float, 3>& origin, Bvh& bvh, uint depth)
{
    assert(depth <= kMaxBvhDepth && "the builders keep the depth");
    const size_t index = bvh.nodes.size();
    BvhNode node{};
    std::copy(origin.begin(), origin.end(), node.origin);
    quantise(from, node);
    bvh.nodes.push_back(node);
    for (uint i = 0; i < kWidth; ++i) {
        uint word = kBvhEmpty;
        if (i < from.child_count && from.child[i]->child_count == 0) {
            word = kBvhLeaf | from.child[i]->box;
            bvh.order.push_back(from.child[i]->box);
        } else if (i < from.child_count) {
            word = static_cast<uint>(bvh.nodes.size());
            std::array<float, 3> corner;
            for (int c = 0; c < 3; ++c) {
                const float step = std::ldexp(1.0f, int(node.exponents >> 8 * c & 0xffu) - 127);
                corner[c] = node.origin[c] + step * float(node.lo[c] >> 8 * i & 0xffu);
            }
            write_nodes(*from.child[i], corner, bvh, depth + 1);
        }
        bvh.nodes[index].child[i] = word;
    }
}

} // namespace

Bvh build_bvh(RTCDevice device, const std::vector<Box3f>& boxes)
{
    Bvh out;
    if (boxes.empty())
        return out;
    out.order.reserve(boxes.size());
    BuildNode* root = nullptr;
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
        single.child[0] = root;
        root = &single;
    }
    join_boxes(boxes, *root);
    write_nodes(*root, root->bounds.lo, out, 1);
    if (bvh)
        rtcReleaseBVH(bvh);
    return out;
}

} // namespace trimray
