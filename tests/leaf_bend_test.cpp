// Bounds of how leaves bend: no sample exceeds them, they are not far above, and rays steeper than they ask for meet a
// leaf once.
#include "format/leaf_bend.h"

#include "format/bezier_reference.h"
#include "format/derive.h"
#include "format/leaf_geometry.h"
#include "tests/random_pack.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace trimray {
namespace {

using reference::BezierReference;
using reference::SurfacePoint;
using test::random_pack;
using test::RandomSurfaces;

struct Frame {
    Point3 axis[3]; // q0, q1, n
    double r11, r12, r22;
};

Frame frame_of(const SurfacePoint& s)
{
    Frame f;
    const Point3 u = s.du, v = s.dv;
    f.r11 = std::sqrt(dot3(u, u));
    for (int c = 0; c < 3; ++c)
        f.axis[0][c] = u[c] / f.r11;
    f.r12 = dot3(f.axis[0], v);
    Point3 rest;
    for (int c = 0; c < 3; ++c)
        rest[c] = v[c] - f.r12 * f.axis[0][c];
    f.r22 = std::sqrt(dot3(rest, rest));
    for (int c = 0; c < 3; ++c)
        f.axis[1][c] = rest[c] / f.r22;
    f.axis[2] = cross3(f.axis[0], f.axis[1]);
    return f;
}

/// Leaves of random Bezier patches, rational and not, with the patch's reference.
template <class Visit>
void for_each_leaf(uint32_t seed, Visit visit)
{
    PackImage image = random_pack(seed, 4, 12);
    derive_leaves(image, LeafOptions{});
    for (const LeafRecord& leaf : image.leaves) {
        const PatchRecord& patch = image.patches[leaf.patch];
        if ((patch.shape & 0xffu) != kKindBezier)
            continue;
        const std::array<double, 2> lo{(leaf.uv_lo & 0xffffu) / 32768.0, (leaf.uv_lo >> 16) / 32768.0};
        const std::array<double, 2> hi{(leaf.uv_hi & 0xffffu) / 32768.0, (leaf.uv_hi >> 16) / 32768.0};
        const BezierReference reference(patch, image.control_points.data(), 0, 0);
        visit(load_net(image, patch), reference, lo, hi);
    }
}

TEST(leaf_bend, no_derivative_leaves_the_bounds_and_the_bounds_are_near)
{
    RandomSurfaces random(3);
    std::vector<double> used; // of the bound across
    int leaves = 0, outside = 0;
    for_each_leaf(
        11, [&](const Net& net, const BezierReference& reference, std::array<double, 2> lo, std::array<double, 2> hi) {
            const std::array<double, 2> at{0.5 * (lo[0] + hi[0]), 0.5 * (lo[1] + hi[1])};
            const LeafBend bend = leaf_bend(net, lo, hi, at);
            const Frame f = frame_of(reference.evaluate(at[0], at[1]));
            double across = 0;
            for (int i = 0; i < 40; ++i) {
                const auto part = [&](int c) {
                    const int side = random.integer(0, 5);
                    return side == 0 ? lo[c] : side == 1 ? hi[c] : random.uniform(lo[c], hi[c]);
                };
                const double u = part(0), v = part(1);
                const SurfacePoint s = reference.evaluate(u, v);
                double d[2][3]; // D's columns in the frame
                for (int a = 0; a < 3; ++a) {
                    const double to_u = dot3(s.du, f.axis[a]) - (a == 0 ? f.r11 : 0);
                    const double to_v = dot3(s.dv, f.axis[a]) - (a == 0 ? f.r12 : a == 1 ? f.r22 : 0);
                    d[0][a] = to_u / f.r11;
                    d[1][a] = (to_v - f.r12 / f.r11 * to_u) / f.r22;
                }
                // the largest singular value of the 2 x 2 part
                const double p = d[0][0], q = d[1][0], r = d[0][1], t = d[1][1];
                const double sum = p * p + q * q + r * r + t * t, det = p * t - q * r;
                const double along = std::sqrt(0.5 * (sum + std::sqrt(std::max(0.0, sum * sum - 4 * det * det))));
                const double off = std::hypot(d[0][2], d[1][2]);
                across = std::max(across, off);
                outside += along > bend.along * (1 + 1e-9) + 1e-9 || off > bend.across * (1 + 1e-9) + 1e-9;
            }
            used.push_back(across / bend.across);
            ++leaves;
        });
    ASSERT_GT(leaves, 300);
    EXPECT_EQ(outside, 0);
    std::nth_element(used.begin(), used.begin() + long(used.size() / 2), used.end());
    EXPECT_GT(used[used.size() / 2], 0.4) << "the bounds are far above what they bound";
}

TEST(leaf_bend, a_ray_steeper_than_the_bound_asks_meets_a_leaf_once)
{
    RandomSurfaces random(5);
    int rays = 0, twice = 0, bounded = 0, leaves = 0;
    for_each_leaf(12, [&](const Net& net, const BezierReference& reference, std::array<double, 2> lo,
                          std::array<double, 2> hi) {
        const std::array<double, 2> at{0.5 * (lo[0] + hi[0]), 0.5 * (lo[1] + hi[1])};
        const double slope = leaf_bend(net, lo, hi, at).least_slope();
        ++leaves;
        if (!(slope < 4))
            return;
        ++bounded;
        const Frame f = frame_of(reference.evaluate(at[0], at[1]));
        for (int i = 0; i < 8; ++i) {
            const SurfacePoint through = reference.evaluate(random.uniform(lo[0], hi[0]), random.uniform(lo[1], hi[1]));
            const double angle = random.uniform(0, 6.283185307), tan_b = slope * random.uniform(1, 1.2);
            Point3 direction, origin;
            for (int c = 0; c < 3; ++c) {
                direction[c] = std::cos(angle) * f.axis[0][c] + std::sin(angle) * f.axis[1][c] + tan_b * f.axis[2][c];
                origin[c] = through.p[c] - 10 * direction[c];
            }
            std::vector<std::array<double, 2>> met;
            reference.intersect({origin, direction}, 0, 20, [&](const reference::Root& root) {
                const bool here = root.u >= lo[0] && root.u <= hi[0] && root.v >= lo[1] && root.v <= hi[1];
                const bool known = std::any_of(met.begin(), met.end(), [&](const std::array<double, 2>& other) {
                    return std::hypot(other[0] - root.u, other[1] - root.v) < 1e-9;
                });
                if (here && !known)
                    met.push_back({root.u, root.v});
                return 20.0; // all of them
            });
            ++rays;
            twice += met.size() > 1;
        }
    });
    ASSERT_GT(rays, 2000);
    EXPECT_EQ(twice, 0);
    EXPECT_GT(bounded, leaves / 2);
}

TEST(leaf_bend, a_plane_does_not_bend_and_a_pole_has_no_bound)
{
    Net plane{2, 2, {{0, 0, 0, 1}, {0, 1, 0, 1}, {2, 0, 0, 1}, {2, 1, 0, 1}}};
    const LeafBend flat = leaf_bend(plane, {0, 0}, {1, 1}, {0.5, 0.5});
    EXPECT_LT(flat.along, 1e-9);
    EXPECT_LT(flat.across, 1e-9);
    Net pole{2, 2, {{0, 0, 0, 1}, {0, 0, 0, 1}, {2, 0, 0, 1}, {2, 1, 0, 1}}};
    EXPECT_EQ(leaf_bend(pole, {0, 0}, {1, 1}, {0, 0.5}).least_slope(), std::numeric_limits<double>::infinity());
}

} // namespace
} // namespace trimray
