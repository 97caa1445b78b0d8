// Leaves -> trees: one over each part's leaves in part units, one over the instances in world units.
#include "format/bvh_build.h"
#include "format/derive.h"
#include "format/leaf_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

namespace trimray {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
// Boxes grow by this many units (|p| <= 1): a tracer's ray and box arithmetic is off by a few eps of 1.
constexpr double kBoxMargin = 1.0 / (1 << 21);

struct Box3d {
    Point3 lo{kInf, kInf, kInf}, hi{-kInf, -kInf, -kInf};

    void add(const Point3& p)
    {
        for (int c = 0; c < 3; ++c) {
            lo[c] = std::min(lo[c], p[c]);
            hi[c] = std::max(hi[c], p[c]);
        }
    }
    bool empty() const { return !(lo[0] <= hi[0]); }
};

/// The leaf's box in part units.
Box3d leaf_bounds(const LeafRecord& leaf, const PatchRecord& patch)
{
    const OrientedBox oriented = decode_leaf_box(leaf);
    Box3d box;
    for (int c = 0; c < 3; ++c) {
        // p_c = origin_c + scale * sum_k axis_k[c] q_k
        const Point3 row{patch.axis_x[c], patch.axis_y[c], patch.axis_z[c]};
        const double center = dot3(row, oriented.center);
        double reach = 0;
        for (int i = 0; i < 3; ++i)
            reach += oriented.half[i] * std::abs(dot3(row, oriented.axis[i]));
        const double origin = double(patch.origin_hi[c]) + double(patch.origin_lo[c]);
        box.lo[c] = origin + patch.scale * (center - reach) - kBoxMargin;
        box.hi[c] = origin + patch.scale * (center + reach) + kBoxMargin;
    }
    return box;
}

/// To single precision, outwards. A number no valid pack holds ends as a large one, so that the builder stays defined.
Box3f rounded_outwards(const Box3d& box)
{
    constexpr float kFarthest = 1e9f;
    Box3f out;
    for (int c = 0; c < 3; ++c) {
        const float lo = std::nextafterf(static_cast<float>(box.lo[c]), -INFINITY);
        const float hi = std::nextafterf(static_cast<float>(box.hi[c]), INFINITY);
        out.lo[c] = lo > -kFarthest && lo < kFarthest ? lo : -kFarthest;
        out.hi[c] = hi > -kFarthest && hi < kFarthest ? hi : kFarthest;
    }
    return out;
}

/// Builds the part's tree and puts its leaves in the tree's order.
std::vector<BvhNode> build_part(PackImage& image, const PartRecord& part, RTCDevice device)
{
    LeafRecord* leaves = image.leaves.data() + part.first_leaf;
    std::vector<Box3f> boxes(part.leaf_count);
    for (uint i = 0; i < part.leaf_count; ++i)
        boxes[i] = rounded_outwards(leaf_bounds(leaves[i], image.patches[leaves[i].patch]));
    Bvh bvh = build_bvh(device, boxes);
    std::vector<uint> place(part.leaf_count);
    std::vector<LeafRecord> ordered(part.leaf_count);
    for (uint i = 0; i < part.leaf_count; ++i) {
        ordered[i] = leaves[bvh.order[i]];
        place[bvh.order[i]] = i;
    }
    std::copy(ordered.begin(), ordered.end(), leaves);
    for (BvhNode& node : bvh.nodes)
        for (uint& child : node.child)
            if (child != kBvhEmpty && (child & kBvhLeaf) != 0)
                child = kBvhLeaf | place[child & ~kBvhLeaf];
    return std::move(bvh.nodes);
}

// ---- instances -----------------------------------------------------------------------------------------------------

/// A few boxes in part units that hold the part: the children of its uppermost nodes. More boxes hug a turned part
/// better.
void upper_boxes(const BvhNode* nodes, uint index, int levels, std::vector<Box3d>& boxes)
{
    const BvhNode& node = nodes[index];
    for (uint i = 0; i < node.exponents >> 24; ++i) {
        if (levels > 1 && (node.child[i] & kBvhLeaf) == 0) {
            upper_boxes(nodes, node.child[i], levels - 1, boxes);
            continue;
        }
        Box3d box;
        for (int c = 0; c < 3; ++c) {
            const double step = std::ldexp(1.0, int(node.exponents >> 8 * c & 0xffu) - 127);
            box.lo[c] = node.origin[c] + step * (node.lo[c] >> 8 * i & 0xffu);
            box.hi[c] = node.origin[c] + step * (node.hi[c] >> 8 * i & 0xffu);
        }
        boxes.push_back(box);
    }
}

/// Box of an instance in world mm.
Box3d world_bounds(const InstanceRecord& instance, const PartRecord& part, const std::vector<Box3d>& boxes)
{
    Box3d world;
    for (const Box3d& box : boxes) {
        Box3d moved;
        for (int row = 0; row < 3; ++row) {
            const double* m = instance.transform + 4 * row;
            moved.lo[row] = moved.hi[row] = m[3];
            for (int c = 0; c < 3; ++c) {
                const double a = m[c] * (part.origin_mm[c] + part.scale_mm * box.lo[c]);
                const double b = m[c] * (part.origin_mm[c] + part.scale_mm * box.hi[c]);
                moved.lo[row] += std::min(a, b);
                moved.hi[row] += std::max(a, b);
            }
        }
        world.add(moved.lo);
        world.add(moved.hi);
    }
    return world;
}

/// The model's box in world mm: what its leaves' own boxes reach, tighter than the tree's.
void set_bounds(const PackImage& image, std::span<const InstanceRecord> instances, std::span<const uint8_t> visible,
                const std::function<bool()>& cancelled, TopTree& tree)
{
    tbb::parallel_for(0, 6, [&](int side) {
        const int c = side / 2;
        Point3 d{};
        d[c] = side % 2 == 0 ? -1 : 1;
        double reach = -kInf;
        for (size_t i = 0; i < instances.size() && !(cancelled && cancelled()); ++i)
            if (visible.empty() || visible[i] != 0)
                reach = std::max(reach, largest_along(image, instances[i], d));
        (side % 2 == 0 ? tree.bounds_lo_mm : tree.bounds_hi_mm)[c] = d[c] * reach;
    });
}

TopTree build_top(const PackImage& image, std::span<const InstanceRecord> instances, std::span<const uint8_t> visible,
                  RTCDevice device, const std::function<bool()>& cancelled)
{
    constexpr int kLevels = 3; // up to 64 boxes a part
    std::vector<std::vector<Box3d>> of_part(image.parts.size());
    for (size_t p = 0; p < image.parts.size(); ++p)
        if (image.parts[p].node_count > 0)
            upper_boxes(image.part_nodes.data() + image.parts[p].first_node, 0, kLevels, of_part[p]);
    std::vector<Box3d> boxes;
    std::vector<uint> ids; // instances of empty parts are not in the tree
    Box3d all;
    for (size_t i = 0; i < instances.size(); ++i) {
        const InstanceRecord& instance = instances[i];
        if (!visible.empty() && visible[i] == 0)
            continue;
        const Box3d box = world_bounds(instance, image.parts[instance.part], of_part[instance.part]);
        if (box.empty())
            continue;
        all.add(box.lo);
        all.add(box.hi);
        boxes.push_back(box);
        ids.push_back(uint(i));
    }
    TopTree tree;
    if (boxes.empty())
        return tree;
    double half = 0;
    for (int c = 0; c < 3; ++c) {
        tree.origin_mm[c] = 0.5 * (all.lo[c] + all.hi[c]);
        half = std::max(half, 0.5 * (all.hi[c] - all.lo[c]));
    }
    tree.scale_mm = half > 0 ? half : 1;
    std::vector<Box3f> units;
    for (Box3d box : boxes) {
        for (int c = 0; c < 3; ++c) {
            box.lo[c] = (box.lo[c] - tree.origin_mm[c]) / tree.scale_mm - kBoxMargin;
            box.hi[c] = (box.hi[c] - tree.origin_mm[c]) / tree.scale_mm + kBoxMargin;
        }
        units.push_back(rounded_outwards(box));
    }
    Bvh bvh = build_bvh(device, units);
    for (BvhNode& node : bvh.nodes)
        for (uint& child : node.child)
            if (child != kBvhEmpty && (child & kBvhLeaf) != 0)
                child = kBvhLeaf | ids[child & ~kBvhLeaf];
    tree.nodes = std::move(bvh.nodes);
    set_bounds(image, instances, visible, cancelled, tree);
    return tree;
}

} // namespace

void derive_trees(PackImage& image, const std::function<bool()>& cancelled)
{
    RTCDevice device = rtcNewDevice(nullptr);
    std::vector<std::vector<BvhNode>> trees(image.parts.size());
    tbb::parallel_for(size_t{0}, image.parts.size(), [&](size_t p) {
        if (!cancelled || !cancelled())
            trees[p] = build_part(image, image.parts[p], device);
    });
    image.part_nodes.clear();
    for (size_t p = 0; p < trees.size(); ++p) {
        image.parts[p].first_node = uint(image.part_nodes.size());
        image.parts[p].node_count = uint(trees[p].size());
        image.part_nodes.insert(image.part_nodes.end(), trees[p].begin(), trees[p].end());
    }
    TopTree tree = build_top(image, image.instances, {}, device, cancelled);
    rtcReleaseDevice(device);
    image.top_nodes = std::move(tree.nodes);
    if (image.top_nodes.empty())
        return;
    std::copy_n(tree.origin_mm, 3, image.world_origin_mm);
    image.world_scale_mm = tree.scale_mm;
    std::copy_n(tree.bounds_lo_mm, 3, image.bounds_lo_mm);
    std::copy_n(tree.bounds_hi_mm, 3, image.bounds_hi_mm);
}

TopTree derive_top_tree(const PackImage& image, std::span<const InstanceRecord> instances,
                        std::span<const uint8_t> visible)
{
    RTCDevice device = rtcNewDevice(nullptr);
    TopTree tree = build_top(image, instances, visible, device, {});
    rtcReleaseDevice(device);
    return tree;
}

} // namespace trimray
