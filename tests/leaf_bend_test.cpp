// Bounds of how fast a leaf's derivatives change: no sample exceeds them, they are not far above, and rays steeper than
// they ask for meet a leaf's reach once.
#include "format/leaf_bend.h"

#include "format/bezier_reference.h"
#include "format/derive.h"
#include "format/leaf_geometry.h"
#include "tests/random_pack.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>

namespace trimray {
namespace {

using reference::BezierReference;
using reference::SurfacePoint;
using test::random_pack;
using test::RandomSurfaces;
using test::uv_of;
using Place = std::array<double, 2>;

constexpr double kReach = 2, kOutside = 1e-3; // as in shaders/shared/newton_reach.h

struct Frame {
    Point3 axis[3]; // q_1, q_2, n
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

/// |Q^T (DS_a - DS_b) R^-1| and |n^T (DS_a - DS_b) R^-1|.
LeafBend change(const Frame& f, const SurfacePoint& a, const SurfacePoint& b)
{
    double d[2][3]; // columns
    for (int k = 0; k < 3; ++k) {
        const double of_u = dot3(a.du, f.axis[k]) - dot3(b.du, f.axis[k]);
        const double of_v = dot3(a.dv, f.axis[k]) - dot3(b.dv, f.axis[k]);
        d[0][k] = of_u / f.r11;
        d[1][k] = (of_v - f.r12 / f.r11 * of_u) / f.r22;
    }
    // the largest singular value of the 2 x 2 part
    const double sum = d[0][0] * d[0][0] + d[1][0] * d[1][0] + d[0][1] * d[0][1] + d[1][1] * d[1][1];
    const double det = d[0][0] * d[1][1] - d[1][0] * d[0][1];
    return {std::sqrt(0.5 * (sum + std::sqrt(std::max(0.0, sum * sum - 4 * det * det)))), std::hypot(d[0][2], d[1][2])};
}

struct Leaf {
    Place lo, hi;

    double middle(int i) const { return 0.5 * (lo[i] + hi[i]); }
    double half(int i) const { return 0.5 * (hi[i] - lo[i]); }
    double from(int i) const { return std::max(middle(i) - kReach * half(i), -kOutside); }
    double to(int i) const { return std::min(middle(i) + kReach * half(i), 1 + kOutside); }
};

/// A wavy patch of the given degrees as a pack of its own.
PackImage wavy_patch(RandomSurfaces& random, int degree_u, int degree_v, bool rational, double wave)
{
    PatchRecord patch{};
    patch.shape = kKindBezier | uint(degree_u) << 8 | uint(degree_v) << 16 | (rational ? kShapeRational : 0);
    patch.scale = 1;
    PackImage image;
    image.patches = {patch};
    for (int i = 0; i <= degree_u; ++i) {
        for (int j = 0; j <= degree_v; ++j) {
            const double w = rational ? std::exp(random.uniform(-wave, wave)) : 1;
            for (const double place : {0.5 * (i + wave * random.uniform(-1, 1)) / degree_u,
                                       0.5 * (j + wave * random.uniform(-1, 1)) / degree_v,
                                       0.5 * wave * random.uniform(-1, 1) / std::max(degree_u, degree_v)})
                image.control_points.push_back(float(w * place));
            if (rational)
                image.control_points.push_back(float(w));
        }
    }
    return image;
}

TEST(leaf_bend, no_two_derivatives_in_the_reach_differ_by_more_and_the_bounds_are_near)
{
    RandomSurfaces random(3);
    long outside = 0, samples = 0;
    std::vector<double> room[2]; // bound over largest sample, of leaves that turn little: polynomial, rational
    for (int trial = 0; trial < 1200; ++trial) {
        const bool rational = trial % 2 == 1;
        const PackImage image = wavy_patch(random, random.integer(1, 9), random.integer(1, 9), rational, 0.4);
        Leaf leaf{{0, 0}, {1, 1}};
        for (int i = 0; i < 2; ++i) {
            const int pieces = 1 << random.integer(0, 5), at = random.integer(0, pieces - 1);
            leaf.lo[i] = double(at) / pieces;
            leaf.hi[i] = double(at + 1) / pieces;
        }
        const LeafBend bend = leaf_bend(load_net(image, image.patches[0]), leaf.lo, leaf.hi);
        const BezierReference reference(image.patches[0], image.control_points.data(), 0, 0);
        const Frame f = frame_of(reference.evaluate(leaf.middle(0), leaf.middle(1)));
        LeafBend largest{0, 0};
        for (int i = 0; i < 60; ++i) {
            Place a, b;
            double share = 0; // l: the largest |a_i - b_i| / h_i
            const double far = i % 3 == 0 ? 0.1 : 1;
            for (int c = 0; c < 2; ++c) {
                const int side = random.integer(0, 3);
                a[c] = side == 0 ? leaf.from(c) : side == 1 ? leaf.to(c) : random.uniform(leaf.from(c), leaf.to(c));
                b[c] = a[c] + far * (random.uniform(leaf.from(c), leaf.to(c)) - a[c]);
                share = std::max(share, std::abs(a[c] - b[c]) / leaf.half(c));
            }
            const LeafBend here = change(f, reference.evaluate(a[0], a[1]), reference.evaluate(b[0], b[1]));
            largest.along = std::max(largest.along, here.along / share);
            largest.across = std::max(largest.across, here.across / share);
            ++samples;
        }
        outside += largest.along > bend.along * (1 + 1e-9) || largest.across > bend.across * (1 + 1e-9);
        if (bend.along < 0.25) {
            room[rational].push_back(bend.along / largest.along);
            room[rational].push_back(bend.across / largest.across);
        }
    }
    EXPECT_EQ(outside, 0);
    EXPECT_GT(samples, 40000);
    for (std::vector<double>& of : room) {
        ASSERT_GT(of.size(), 200u);
        std::nth_element(of.begin(), of.begin() + long(of.size() / 2), of.end());
        EXPECT_LT(of[of.size() / 2], 1.5) << "the bounds are far above what they bound";
    }
}

TEST(leaf_bend, a_ray_steeper_than_the_bound_asks_meets_the_reach_once)
{
    RandomSurfaces random(5);
    int rays = 0, twice = 0, bounded = 0, leaves = 0;
    PackImage image = random_pack(12, 4, 12);
    derive_leaves(image, LeafOptions{});
    for (const LeafRecord& record : image.leaves) {
        const PatchRecord& patch = image.patches[record.patch];
        if ((patch.shape & 0xffu) != kKindBezier)
            continue;
        const auto [lo, hi] = uv_of(record);
        const Leaf leaf{{lo[0], lo[1]}, {hi[0], hi[1]}};
        const double slope = decode_leaf_bend(record).least_slope();
        ++leaves;
        if (!(slope < 4))
            continue;
        ++bounded;
        const BezierReference reference(patch, image.control_points.data(), kOutside, kOutside);
        const Frame f = frame_of(reference.evaluate(leaf.middle(0), leaf.middle(1)));
        for (int i = 0; i < 8; ++i) {
            const SurfacePoint through =
                reference.evaluate(random.uniform(leaf.from(0), leaf.to(0)), random.uniform(leaf.from(1), leaf.to(1)));
            const double angle = random.uniform(0, 6.283185307), tan_b = slope * random.uniform(1, 1.2);
            Point3 direction, origin;
            for (int c = 0; c < 3; ++c) {
                direction[c] = std::cos(angle) * f.axis[0][c] + std::sin(angle) * f.axis[1][c] + tan_b * f.axis[2][c];
                origin[c] = through.p[c] - 10 * direction[c];
            }
            std::vector<Place> met;
            reference.intersect({origin, direction}, 0, 20, [&](const reference::Root& root) {
                const bool here =
                    root.u >= leaf.from(0) && root.u <= leaf.to(0) && root.v >= leaf.from(1) && root.v <= leaf.to(1);
                const bool known = std::any_of(met.begin(), met.end(), [&](const Place& other) {
                    return std::hypot(other[0] - root.u, other[1] - root.v) < 1e-9;
                });
                if (here && !known)
                    met.push_back({root.u, root.v});
                return 20.0; // all of them
            });
            ++rays;
            twice += met.size() > 1;
        }
    }
    ASSERT_GT(rays, 2000);
    EXPECT_EQ(twice, 0);
    EXPECT_GT(bounded, leaves / 2);
}

TEST(leaf_bend, a_plane_does_not_bend_and_a_pole_or_a_weight_of_zero_has_no_bound)
{
    const Net plane{2, 2, {{0, 0, 0, 1}, {0, 1, 0, 1}, {1, 0, 0, 1}, {1, 1, 0, 1}}};
    const LeafBend flat = leaf_bend(plane, {0, 0}, {1, 1});
    EXPECT_LT(flat.along, 1e-5); // what rounding may do
    EXPECT_LT(flat.across, 1e-5);
    const Net line{2, 2, {{0, 0, 0, 1}, {0, 0, 0, 1}, {1, 0, 0, 1}, {1, 0, 0, 1}}};
    EXPECT_TRUE(std::isinf(leaf_bend(line, {0, 0}, {1, 1}).along));
    const Net pole{2, 2, {{0, 0, 0, 1}, {0, 0, 0, 1}, {1, 0, 0, 1}, {1, 1, 0, 1}}};
    for (const double side : {0.5, 1e-3, 3e-5})
        EXPECT_TRUE(std::isinf(leaf_bend(pole, {0, 0}, {side, 1}).least_slope())) << side;
    const Net weightless{2, 2, {{0, 0, 0, 1}, {0, 1, 0, 1}, {1, 0, 0, 1}, {0, 0, 0, 0}}};
    EXPECT_TRUE(std::isinf(leaf_bend(weightless, {0, 0}, {1, 1}).along));
}

TEST(leaf_bend, a_leaf_half_as_long_bends_half_as_much)
{
    RandomSurfaces random(8);
    for (const bool rational : {false, true}) {
        const PackImage image = wavy_patch(random, 3, 3, rational, 0.3);
        const Net net = load_net(image, image.patches[0]);
        const LeafBend whole = leaf_bend(net, {0.375, 0.375}, {0.625, 0.625});
        const LeafBend half = leaf_bend(net, {0.4375, 0.4375}, {0.5625, 0.5625});
        EXPECT_LT(half.along, 0.52 * whole.along);
        EXPECT_LT(half.across, 0.52 * whole.across);
    }
}

TEST(leaf_bend, is_the_same_on_every_instruction_set)
{
    RandomSurfaces random(9);
    for (int trial = 0; trial < 40; ++trial) {
        const PackImage image = wavy_patch(random, random.integer(1, 15), random.integer(1, 15), trial % 2 == 1, 0.4);
        const Net net = load_net(image, image.patches[0]);
        const auto bend = [&](int64_t targets) {
            hwy::SetSupportedTargetsForTest(targets); // 0: the best there is
            hwy::GetChosenTarget().DeInit();
            return leaf_bend_by_side(net, derivative_rounding(net), {0.25, 0.5}, {0.5, 0.75});
        };
        const std::array<LeafBend, 2> best = bend(0);
        ASSERT_GT(best[0].along, 0);
        for (const int64_t target : {int64_t(HWY_EMU128), int64_t(HWY_SSE4), int64_t(HWY_AVX2), int64_t(HWY_AVX3)}) {
            hwy::SetSupportedTargetsForTest(0);
            if ((hwy::SupportedTargets() & target) == 0)
                continue;
            const std::array<LeafBend, 2> here = bend(target);
            for (int d = 0; d < 2; ++d) {
                EXPECT_EQ(here[d].along, best[d].along) << hwy::TargetName(target);
                EXPECT_EQ(here[d].across, best[d].across) << hwy::TargetName(target);
            }
        }
        bend(0);
    }
}

} // namespace
} // namespace trimray
