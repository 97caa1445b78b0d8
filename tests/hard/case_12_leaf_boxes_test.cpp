// Hard case 12: boxes that are not conservative. A leaf's box, as it decodes, holds the surface over the leaf's
// rectangle.
#include "format/derive.h"
#include "format/leaf_geometry.h"
#include "format/record_surface.h"
#include "tests/hard/nets.h"
#include "tests/random_pack.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace trimray::hard {
namespace {

using test::random_pack;
using test::RandomSurfaces;
using test::uv_of;
using test::UvRect;

/// The share of the box's half extents that the point needs; above 1 it is outside.
double reach_in_box(const OrientedBox& box, const Point3& q)
{
    double reach = 0;
    for (int i = 0; i < 3; ++i) {
        const Point3 d{q[0] - box.center[0], q[1] - box.center[1], q[2] - box.center[2]};
        reach = std::max(reach, std::abs(dot3(d, box.axis[i])) / box.half[i]);
    }
    return reach;
}

struct Found {
    size_t outside = 0;
    double tightest = 1e9; // least share of a box that its points need
};

/// So many random points of all leaves together, every eighth on a side of its leaf.
Found look_for_points_outside(const PackImage& image, size_t samples)
{
    RandomSurfaces random(2);
    const size_t per_leaf = samples / image.leaves.size() + 1;
    Found found;
    for (const LeafRecord& leaf : image.leaves) {
        const PatchRecord& patch = image.patches[leaf.patch];
        const OrientedBox box = decode_leaf_box(leaf);
        const UvRect uv = uv_of(leaf);
        double used = 0;
        for (size_t i = 0; i < per_leaf; ++i) {
            double at[2];
            for (int c = 0; c < 2; ++c) {
                const int side = random.integer(0, 15);
                const double t = side == 0 ? 0 : side == 1 ? 1 : random.uniform(0, 1);
                at[c] = uv.lo[c] + t * (uv.hi[c] - uv.lo[c]);
                if ((patch.shape & 0xffu) != kKindBezier)
                    at[c] = (at[c] - patch.uv_offset[c]) / patch.uv_scale[c];
            }
            const double reach = reach_in_box(box, point_of(patch, image.control_points.data(), at[0], at[1]));
            found.outside += reach > 1;
            used = std::max(used, reach);
        }
        found.tightest = std::min(found.tightest, used);
    }
    return found;
}

TEST(case_12, a_million_random_points_lie_inside_their_leafs_box)
{
    PackImage image = random_pack(1, 24, 12);
    derive_leaves(image, LeafOptions{});
    ASSERT_GT(image.leaves.size(), 1000u);
    const Found found = look_for_points_outside(image, 1'000'000);
    EXPECT_EQ(found.outside, 0u);
    EXPECT_GT(found.tightest, 0.5) << "a box is much larger than its surface";
}

TEST(case_12, points_of_extreme_patches_lie_inside_their_leafs_box)
{
    // degrees up to the format's largest, weights over six decades, folded, and as narrow as 1e-4
    TracedScene scene;
    RandomSurfaces random(3);
    for (int k = 0; k < 40; ++k) {
        const int p = random.integer(1, k % 4 == 0 ? int(kMaxDegree) : 9), q = random.integer(1, 9);
        const double decades = random.uniform(0, 3), fold = random.uniform(0, 0.3);
        const double narrow = k % 3 == 0 ? std::pow(10, -random.uniform(0, 4)) : 1;
        add_net(scene, p, q, k % 2 == 0, [&](int i, int j) {
            const double x = i / double(p) - 0.5 + fold * random.uniform(-1, 1);
            const double y = j / double(q) - 0.5 + fold * random.uniform(-1, 1);
            return NetPoint{x, narrow * y, narrow * random.uniform(-0.3, 0.3),
                            std::pow(10, random.uniform(-decades, decades))};
        });
    }
    const auto made = scene.finish();
    const PackImage& image = made->pack.image;
    ASSERT_GT(image.leaves.size(), 1000u);
    EXPECT_EQ(look_for_points_outside(image, 200'000).outside, 0u);
}

} // namespace
} // namespace trimray::hard
