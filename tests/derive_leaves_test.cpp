// Leaves tile their patch, and their boxes decode alike; that they hold the surface is hard case 12.
#include "format/derive.h"
#include "format/leaf_geometry.h"
#include "shaders/shared/leaf_box.h"
#include "tests/random_pack.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include <tbb/global_control.h>

namespace trimray {
namespace {

using test::random_pack;
using test::RandomSurfaces;
using test::uv_of;
using test::UvRect;

TEST(derive_leaves, boxes_decode_as_the_tracers_decode_them)
{
    PackImage image = random_pack(9, 6, 12);
    derive_leaves(image, LeafOptions{});
    for (const LeafRecord& leaf : image.leaves) {
        const OrientedBox ours = decode_leaf_box(leaf);
        const HWY_NAMESPACE::LeafBox theirs = HWY_NAMESPACE::decode_leaf(leaf);
        const Point3 center{theirs.center.x, theirs.center.y, theirs.center.z};
        const Point3 half{theirs.half_extent.x, theirs.half_extent.y, theirs.half_extent.z};
        const Point3 axes[3] = {{theirs.axis_x.x, theirs.axis_x.y, theirs.axis_x.z},
                                {theirs.axis_y.x, theirs.axis_y.y, theirs.axis_y.z},
                                {theirs.axis_z.x, theirs.axis_z.y, theirs.axis_z.z}};
        const UvRect uv = uv_of(leaf);
        ASSERT_EQ(uv.lo[0], theirs.uv_lo.x);
        ASSERT_EQ(uv.lo[1], theirs.uv_lo.y);
        ASSERT_EQ(uv.hi[0], theirs.uv_hi.x);
        ASSERT_EQ(uv.hi[1], theirs.uv_hi.y);
        const LeafBend bend = decode_leaf_bend(leaf);
        ASSERT_EQ(std::isinf(bend.along) ? double(HWY_NAMESPACE::kHuge) : bend.along, theirs.along);
        ASSERT_EQ(std::isinf(bend.across) ? double(HWY_NAMESPACE::kHuge) : bend.across, theirs.across);
        for (int i = 0; i < 3; ++i) {
            ASSERT_EQ(ours.center[i], center[i]);
            ASSERT_EQ(ours.half[i], half[i]);
            for (int c = 0; c < 3; ++c)
                ASSERT_NEAR(ours.axis[i][c], axes[i][c], 1e-6);
        }
    }
}

TEST(derive_leaves, bounds_are_kept_rounded_up_by_an_eighth_at_most)
{
    RandomSurfaces random(13);
    for (int i = 0; i < 4000; ++i) {
        const double bound = i < 8 ? 1 + i / 8.0 : std::exp2(random.uniform(-24, 14));
        LeafRecord leaf{};
        leaf.quat_z_bend = 0x8001u;
        encode_leaf_bend({bound, 0.5 * bound}, leaf);
        ASSERT_EQ(leaf.quat_z_bend & 0xffffu, 0x8001u);
        const LeafBend kept = decode_leaf_bend(leaf);
        ASSERT_GE(kept.along, bound);
        ASSERT_GE(kept.across, 0.5 * bound);
        ASSERT_EQ(std::isinf(kept.along), bound > 3584) << bound;
        if (bound <= 3584) {
            ASSERT_LE(kept.along, std::max(bound * (i < 8 ? 1 : 1.125), std::exp2(-20)));
        }
    }
    LeafRecord leaf{};
    encode_leaf_bend({}, leaf);
    EXPECT_EQ(leaf.quat_z_bend, 0xffff0000u);
    encode_leaf_bend({0, 0}, leaf);
    EXPECT_EQ(leaf.quat_z_bend, 0u);
}

TEST(derive_leaves, leaves_tile_their_patch)
{
    PackImage image = random_pack(3, 12, 12);
    derive_leaves(image, LeafOptions{});
    std::map<uint, double> area;
    std::map<uint, std::vector<UvRect>> rects;
    for (const LeafRecord& leaf : image.leaves) {
        const UvRect r = uv_of(leaf);
        ASSERT_LT(r.lo[0], r.hi[0]);
        ASSERT_LT(r.lo[1], r.hi[1]);
        area[leaf.patch] += (r.hi[0] - r.lo[0]) * (r.hi[1] - r.lo[1]);
        rects[leaf.patch].push_back(r);
    }
    ASSERT_EQ(area.size(), image.patches.size());
    for (const auto& [patch, sum] : area)
        EXPECT_EQ(sum, 1.0) << "patch " << patch;
    RandomSurfaces random(4);
    for (const auto& [patch, list] : rects) {
        for (int i = 0; i < 50; ++i) {
            const double u = random.uniform(0, 1), v = random.uniform(0, 1);
            int holders = 0;
            for (const UvRect& r : list)
                holders += u >= r.lo[0] && u < r.hi[0] && v >= r.lo[1] && v < r.hi[1];
            ASSERT_EQ(holders, 1);
        }
    }
}

TEST(derive_leaves, parts_own_consecutive_leaves_of_their_own_patches)
{
    PackImage image = random_pack(5, 7, 5, 3); // an empty part between others
    derive_leaves(image, LeafOptions{});
    EXPECT_EQ(image.parts[3].leaf_count, 0u);
    for (const PartRecord& part : image.parts) {
        for (uint i = part.first_leaf; i < part.first_leaf + part.leaf_count; ++i) {
            EXPECT_GE(image.leaves[i].patch, part.first_patch);
            EXPECT_LT(image.leaves[i].patch, part.first_patch + part.patch_count);
        }
    }
}

bool flagged(const LeafRecord& leaf)
{
    return std::isinf(decode_leaf_bend(leaf).least_slope());
}

TEST(derive_leaves, the_budget_bounds_the_leaves_of_a_patch_and_what_still_bends_is_flagged)
{
    PackImage image = random_pack(6, 2, 12);
    LeafOptions few;
    few.max_leaves_per_patch = 4;
    derive_leaves(image, few);
    std::map<uint, uint> count;
    for (const LeafRecord& leaf : image.leaves) {
        if ((image.patches[leaf.patch].shape & 0xffu) == kKindBezier) {
            EXPECT_LE(++count[leaf.patch], 4u);
        }
    }
    const auto flagged_area = [&] {
        double area = 0;
        for (const LeafRecord& leaf : image.leaves) {
            const UvRect r = uv_of(leaf);
            area += flagged(leaf) ? (r.hi[0] - r.lo[0]) * (r.hi[1] - r.lo[1]) : 0;
        }
        return area;
    };
    const double with_few = flagged_area();
    EXPECT_GT(with_few, 0);
    derive_leaves(image, LeafOptions{});
    EXPECT_LT(flagged_area(), 0.2 * with_few);
}

TEST(derive_leaves, fewer_degrees_prove_more_rays_with_more_leaves)
{
    PackImage image = random_pack(14, 2, 12);
    for (PatchRecord& patch : image.patches)
        patch.scale *= 2; // so that few leaves are too small in their part to be split for their bend
    size_t leaves = 0;
    double unproved = 1;
    for (const float slope : {90.0f, 45.0f, 30.0f, 15.0f}) {
        LeafOptions options;
        options.leaf_slope_deg = slope;
        derive_leaves(image, options);
        double area = 0; // of uv_patch, whose rays of more than 15 degrees are not all proved
        for (const LeafRecord& leaf : image.leaves) {
            const UvRect r = uv_of(leaf);
            area +=
                decode_leaf_bend(leaf).least_slope() > std::tan(0.27) ? (r.hi[0] - r.lo[0]) * (r.hi[1] - r.lo[1]) : 0;
        }
        area /= double(image.patches.size());
        EXPECT_GE(image.leaves.size(), leaves);
        EXPECT_LT(area, unproved);
        leaves = image.leaves.size();
        unproved = area;
    }
    EXPECT_LT(unproved, 0.1);
}

TEST(derive_leaves, a_flat_quarter_patch_is_one_leaf_with_a_flat_box)
{
    CadSurface s;
    s.kind = kKindBezier;
    s.spline = {
        1, 1, 2, 2, false, {0, 0, 1, 1}, {0, 0, 1, 1}, {{0, 0, 0, 1}, {0, 3, 0, 1}, {2, 0, 0, 1}, {2, 3, 0, 1}}};
    PackImage image;
    ASSERT_TRUE(
        append_patches(s, {{0, 0}, {1, 1}}, PartFrame{{0, 0, 0}, 4}, 0, image.patches, image.control_points).ok());
    image.parts.push_back({});
    image.parts[0].patch_count = 1;
    derive_leaves(image, LeafOptions{});
    ASSERT_EQ(image.leaves.size(), 1u);
    const OrientedBox box = decode_leaf_box(image.leaves[0]);
    // half sides 1 and 1.5 mm in a unit of 2 mm (the power of two that holds the half diagonal sqrt(13)/2 mm, part
    // scale 4 mm); the sides may come out 1/64 longer, and the box two quanta thick
    std::array<double, 3> half = box.half;
    std::sort(half.begin(), half.end());
    EXPECT_LE(half[0], 2 * kLeafQuantum);
    EXPECT_GE(half[1], 0.5);
    EXPECT_LE(half[1], 0.5 * (1 + 1.0 / 64) + 3 * kLeafQuantum);
    EXPECT_GE(half[2], 0.75);
    EXPECT_LE(half[2], 0.75 * (1 + 1.0 / 64) + 3 * kLeafQuantum);
}

TEST(derive_leaves, a_side_that_meets_in_one_point_but_for_rounding_is_not_split_for_ever)
{
    // a quarter of a cone: the row u = 0 is its apex, whose points differ in their last digit
    const float eps = 5.9604645e-8f, w = 0.70710678f;
    PatchRecord patch{};
    patch.shape = kKindBezier | 1u << 8 | 2u << 16 | kShapeRational;
    patch.scale = 1.5f; // leaves beside the apex are large enough in their part to be split for their bend
    PackImage image;
    image.patches.push_back(patch);
    image.control_points = {0.5f,  0.5f + eps, 0.5f - eps, 1,         w * 0.5f, w * 0.5f, w * (0.5f + eps),
                            w,     0.5f - eps, 0.5f,       0.5f,      1,        0.25f,    0,
                            0,     1,          w * 0.25f,  w * 0.25f, 0,        w,        0,
                            0.25f, 0,          1};
    image.parts.push_back({});
    image.parts[0].patch_count = 1;
    derive_leaves(image, LeafOptions{});
    EXPECT_LE(image.leaves.size(), 256u);
    for (const LeafRecord& leaf : image.leaves)
        EXPECT_TRUE(uv_of(leaf).hi[0] <= 1.0 / 16 || !flagged(leaf));
}

TEST(derive_leaves, one_thread_and_two_give_the_same_leaves)
{
    PackImage one = random_pack(8, 6, 12), two = one;
    {
        tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
        derive_leaves(one, LeafOptions{});
    }
    derive_leaves(two, LeafOptions{});
    ASSERT_EQ(one.leaves.size(), two.leaves.size());
    EXPECT_EQ(std::memcmp(one.leaves.data(), two.leaves.data(), one.leaves.size() * sizeof(LeafRecord)), 0);
}

} // namespace
} // namespace trimray
