// Trees reach every leaf once, their boxes hold what is below them, and their bytes do not depend on threads.
#include "format/derive.h"
#include "format/leaf_geometry.h"
#include "tests/random_pack.h"

#include <cmath>
#include <cstring>
#include <limits>

#include <tbb/global_control.h>

namespace trimray {
namespace {

using test::random_pack;
using test::RandomSurfaces;

struct Boxf {
    float lo[3], hi[3];
};

Boxf child_box(const BvhNode& node, uint child)
{
    Boxf box;
    for (int c = 0; c < 3; ++c) {
        const float step = std::ldexp(1.0f, int(node.exponents >> 8 * c & 0xffu) - 127);
        box.lo[c] = node.origin[c] + step * float(node.lo[c] >> 8 * child & 0xffu);
        box.hi[c] = node.origin[c] + step * float(node.hi[c] >> 8 * child & 0xffu);
    }
    return box;
}

bool holds(const Boxf& box, const Point3& p)
{
    for (int c = 0; c < 3; ++c)
        if (!(p[c] >= box.lo[c] && p[c] <= box.hi[c]))
            return false;
    return true;
}

/// Corners of a leaf's box in part units.
std::vector<Point3> leaf_corners(const PackImage& image, const LeafRecord& leaf)
{
    const PatchRecord& patch = image.patches[leaf.patch];
    const OrientedBox box = decode_leaf_box(leaf);
    std::vector<Point3> corners;
    for (int corner = 0; corner < 8; ++corner) {
        Point3 q = box.center, p;
        for (int i = 0; i < 3; ++i)
            for (int c = 0; c < 3; ++c)
                q[c] += ((corner >> i & 1) ? 1 : -1) * box.half[i] * box.axis[i][c];
        for (int c = 0; c < 3; ++c)
            p[c] = double(patch.origin_hi[c]) + patch.origin_lo[c] +
                   patch.scale * (patch.axis_x[c] * q[0] + patch.axis_y[c] * q[1] + patch.axis_z[c] * q[2]);
        corners.push_back(p);
    }
    return corners;
}

/// Walks a tree; `visit(leaf, boxes on the path)`. Returns the depth in nodes.
template <class Visit>
uint walk(const BvhNode* nodes, uint node_count, uint index, std::vector<Boxf>& path, const Visit& visit)
{
    EXPECT_LT(index, node_count);
    const BvhNode& node = nodes[index];
    const uint children = node.exponents >> 24;
    EXPECT_GE(children, 1u);
    EXPECT_LE(children, 4u);
    uint depth = 1;
    for (uint i = 0; i < 4; ++i) {
        if (i >= children) {
            EXPECT_EQ(node.child[i], kBvhEmpty);
            continue;
        }
        path.push_back(child_box(node, i));
        if (node.child[i] & kBvhLeaf) {
            visit(node.child[i] & ~kBvhLeaf, path);
        } else {
            EXPECT_GT(node.child[i], index) << "parents come first";
            depth = std::max(depth, 1 + walk(nodes, node_count, node.child[i], path, visit));
        }
        path.pop_back();
    }
    return depth;
}

PackImage pack_with_trees(uint32_t seed, uint parts, uint faces)
{
    PackImage image = random_pack(seed, parts, faces);
    derive_leaves(image, LeafOptions{});
    derive_trees(image);
    return image;
}

TEST(derive_trees, each_leaf_is_reached_once_in_tree_order_and_all_boxes_above_hold_it)
{
    const PackImage image = pack_with_trees(1, 9, 12);
    for (const PartRecord& part : image.parts) {
        uint next = 0;
        std::vector<Boxf> path;
        const uint depth = walk(image.part_nodes.data() + part.first_node, part.node_count, 0, path,
                                [&](uint leaf, const std::vector<Boxf>& boxes) {
                                    ASSERT_EQ(leaf, next++); // tree order: each exactly once
                                    for (const Point3& p : leaf_corners(image, image.leaves[part.first_leaf + leaf]))
                                        for (const Boxf& box : boxes)
                                            ASSERT_TRUE(holds(box, p));
                                });
        EXPECT_EQ(next, part.leaf_count);
        EXPECT_LE(depth, kMaxBvhDepth);
    }
}

TEST(derive_trees, the_top_tree_holds_each_placed_part)
{
    const PackImage image = pack_with_trees(2, 5, 8);
    std::vector<int> seen(image.instances.size());
    std::vector<Boxf> path;
    walk(image.top_nodes.data(), uint(image.top_nodes.size()), 0, path, [&](uint id, const std::vector<Boxf>& boxes) {
        ++seen[id];
        const InstanceRecord& instance = image.instances[id];
        const PartRecord& part = image.parts[instance.part];
        for (uint i = 0; i < part.leaf_count; ++i) {
            for (const Point3& p : leaf_corners(image, image.leaves[part.first_leaf + i])) {
                Point3 world, unit;
                for (int row = 0; row < 3; ++row) {
                    const double* m = instance.transform + 4 * row;
                    world[row] = m[3];
                    for (int c = 0; c < 3; ++c)
                        world[row] += m[c] * (part.origin_mm[c] + part.scale_mm * p[c]);
                    unit[row] = (world[row] - image.world_origin_mm[row]) / image.world_scale_mm;
                    // the bounds add the same terms in another order: a few roundings of the largest apart
                    const double rounding_mm = 16 * std::numeric_limits<double>::epsilon() * image.world_scale_mm;
                    ASSERT_GE(world[row], image.bounds_lo_mm[row] - rounding_mm);
                    ASSERT_LE(world[row], image.bounds_hi_mm[row] + rounding_mm);
                }
                for (const Boxf& box : boxes)
                    ASSERT_TRUE(holds(box, unit));
            }
        }
    });
    EXPECT_EQ(seen, std::vector<int>(image.instances.size(), 1));
}

TEST(derive_trees, empty_parts_have_no_nodes_and_single_leaves_have_one)
{
    PackImage image = random_pack(3, 3, 1, 1); // a plane, nothing, a cone
    derive_leaves(image, LeafOptions{});
    derive_trees(image);
    ASSERT_EQ(image.parts[0].leaf_count, 1u);
    EXPECT_EQ(image.parts[0].node_count, 1u);
    EXPECT_EQ(image.parts[1].node_count, 0u);
    EXPECT_EQ(image.parts[2].first_node, 1u);
    std::vector<Boxf> path;
    uint placed = 0;
    walk(image.top_nodes.data(), uint(image.top_nodes.size()), 0, path, [&](uint id, const std::vector<Boxf>&) {
        EXPECT_NE(image.instances[id].part, 1u);
        ++placed;
    });
    EXPECT_EQ(placed, 4u);
}

TEST(derive_trees, one_thread_and_two_give_the_same_bytes)
{
    PackImage one = random_pack(4, 1, 240), two;
    derive_leaves(one, LeafOptions{});
    // coincident leaves have no split between them: the order must still be fixed
    const std::vector<LeafRecord> copies(3000, one.leaves[0]);
    one.leaves.insert(one.leaves.end(), copies.begin(), copies.end());
    one.parts[0].leaf_count = uint(one.leaves.size());
    two = one;
    {
        tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
        derive_trees(one);
    }
    for (int repeat = 0; repeat < 3; ++repeat) {
        PackImage again = two;
        derive_trees(again);
        ASSERT_EQ(one.part_nodes.size(), again.part_nodes.size());
        EXPECT_EQ(std::memcmp(one.part_nodes.data(), again.part_nodes.data(), one.part_nodes.size() * sizeof(BvhNode)),
                  0);
        EXPECT_EQ(std::memcmp(one.leaves.data(), again.leaves.data(), one.leaves.size() * sizeof(LeafRecord)), 0);
        EXPECT_EQ(std::memcmp(one.top_nodes.data(), again.top_nodes.data(), one.top_nodes.size() * sizeof(BvhNode)), 0);
    }
}

TEST(derive_trees, depth_stays_bounded_for_boxes_that_shrink_without_end)
{
    // each plane half as large as the one before and at its corner: splits peel them off one by one
    PackImage image;
    PartRecord part{};
    part.scale_mm = 1;
    for (int i = 0; i < 120; ++i) {
        CadSurface plane;
        const double size = std::ldexp(1.0, -i);
        const Rect2d domain{{size / 2, size / 2}, {size, size}};
        ASSERT_TRUE(append_patches(plane, domain, PartFrame{}, 0, image.patches, image.control_points).ok());
    }
    part.patch_count = uint(image.patches.size());
    image.parts.push_back(part);
    derive_leaves(image, LeafOptions{});
    derive_trees(image);
    std::vector<Boxf> path;
    uint reached = 0;
    const uint depth = walk(image.part_nodes.data(), image.parts[0].node_count, 0, path,
                            [&](uint, const std::vector<Boxf>&) { ++reached; });
    EXPECT_EQ(reached, 120u);
    EXPECT_LE(depth, kMaxBvhDepth);
}

} // namespace
} // namespace trimray
