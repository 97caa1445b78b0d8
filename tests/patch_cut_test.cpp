// Patches with weights far apart are cut until rounding of their parameters is no more than that of their points.
#include "preprocess/patch_cut.h"
#include "preprocess/vec3d.h"
#include "tests/bezier_surface.h"
#include "tests/random_surfaces.h"
#include "tests/spline_model.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace trimray {
namespace {

using test::as_surface;
using test::RandomSurfaces;

/// Over [2, 4] x [-1, 0] in uv_file, with weights drawn from so many decades.
BezierPatch random_patch(RandomSurfaces& random, double decades, int least_degree = 1, int most_degree = 9)
{
    BezierPatch patch;
    patch.degree_u = random.integer(least_degree, most_degree);
    patch.degree_v = random.integer(least_degree, most_degree);
    patch.rational = true;
    patch.domain = {{2, -1}, {4, 0}};
    for (int i = 0; i <= patch.degree_u; ++i)
        for (int j = 0; j <= patch.degree_v; ++j) {
            const double w = std::pow(10, random.uniform(0, decades));
            const double x = 100 + 10.0 * i / patch.degree_u, y = 10.0 * j / patch.degree_v;
            patch.control_points.push_back({w * x, w * y, w * random.uniform(-2, 2), w});
        }
    return patch;
}

/// The largest of many points and the corners, where ends of light sides are fastest.
PatchSpeed sampled_speed(const BezierPatch& patch, RandomSurfaces& random)
{
    const CadSurface surface = as_surface(patch);
    const double size = control_box(patch.control_points).half_diagonal();
    PatchSpeed largest;
    for (int i = 0; i < 100; ++i) {
        const double u = i < 4 ? i % 2 : random.uniform(0, 1), v = i < 4 ? i / 2 : random.uniform(0, 1);
        const SurfaceDerivatives at = evaluate(surface, u, v);
        largest = {std::max(largest.u, norm(at.du) / size), std::max(largest.v, norm(at.dv) / size)};
    }
    return largest;
}

TEST(patch_speed, bounds_the_derivatives_of_random_patches)
{
    RandomSurfaces random(1);
    double tightest = 0;
    for (int repeat = 0; repeat < 300; ++repeat) {
        const BezierPatch patch = random_patch(random, random.uniform(0, 6));
        const PatchSpeed bound = patch_speed(patch), sampled = sampled_speed(patch, random);
        EXPECT_LE(sampled.u, bound.u * (1 + 1e-9));
        EXPECT_LE(sampled.v, bound.v * (1 + 1e-9));
        tightest = std::max(tightest, sampled.u / bound.u);
    }
    EXPECT_GT(tightest, 0.9);
}

TEST(cut_by_weights, gives_pieces_that_tile_the_patch_and_are_its_surface)
{
    RandomSurfaces random(2);
    size_t most = 0;
    for (int repeat = 0; repeat < 100; ++repeat) {
        const BezierPatch patch = random_patch(random, random.uniform(0, 6));
        const CutPatch cut = cut_by_weights(patch);
        EXPECT_FALSE(cut.too_fast);
        most = std::max(most, cut.pieces.size());
        const CadSurface whole = as_surface(patch);
        double area = 0;
        for (const BezierPatch& piece : cut.pieces) {
            const Rect2d& d = piece.domain;
            area += (d.hi.x - d.lo.x) * (d.hi.y - d.lo.y);
            const CadSurface surface = as_surface(piece);
            for (int i = 0; i < 10; ++i) {
                const double a = random.uniform(0, 1), b = random.uniform(0, 1);
                const double u = std::lerp(d.lo.x, d.hi.x, a) / 2 - 1, v = std::lerp(d.lo.y, d.hi.y, b) + 1;
                // u of 2^-53 and speeds up to 1e7 leave 1e-8 of 10 mm
                EXPECT_LE(norm(evaluate(surface, a, b).p - evaluate(whole, u, v).p), 1e-8);
            }
        }
        EXPECT_NEAR(area, 2, 1e-12);
    }
    EXPECT_GT(most, 8u);
}

TEST(cut_by_weights, leaves_no_piece_faster_than_its_overlap_makes_up_for)
{
    RandomSurfaces random(3);
    for (int repeat = 0; repeat < 100; ++repeat) {
        const BezierPatch patch = random_patch(random, random.uniform(0, 9));
        const double most = largest_speed(patch.degree_u, patch.degree_v),
                     size = control_box(patch.control_points).half_diagonal();
        for (const BezierPatch& piece : cut_by_weights(patch).pieces) {
            const PatchSpeed speed = sampled_speed(piece, random);
            const double own = control_box(piece.control_points).half_diagonal();
            EXPECT_LE((speed.u + speed.v) * own, most * std::max(own, size / 1024));
        }
    }
}

TEST(cut_by_weights, leaves_patches_of_modest_weights_alone)
{
    RandomSurfaces random(4);
    for (int repeat = 0; repeat < 100; ++repeat) {
        BezierPatch patch = random_patch(random, 0.5);
        EXPECT_EQ(cut_by_weights(patch).pieces.size(), 1u);
        for (auto& p : patch.control_points)
            p[3] = 1;
        patch.rational = false;
        EXPECT_EQ(cut_by_weights(patch).pieces.size(), 1u);
        const PatchSpeed speed = patch_speed(patch);
        EXPECT_LE(speed.u + speed.v, 2 * (patch.degree_u + patch.degree_v) * (1 + 1e-9));
    }
}

TEST(cut_by_weights, leaves_a_patch_with_a_light_inner_point_alone)
{
    RandomSurfaces random(5);
    BezierPatch patch = random_patch(random, 0, 3, 3);
    for (double& c : patch.control_points[5])
        c *= 1e-12; // the surface hardly knows it
    EXPECT_EQ(cut_by_weights(patch).pieces.size(), 1u);
}

/// A bicubic face of 12 mm with one heavy point, trimmed to a triangle.
CadModel heavy_triangle(double weight)
{
    CadFace face = spline_face({{0, 0}, {1, 1}});
    SplineSurface& s = face.surface.spline;
    s.degree_u = s.degree_v = 3;
    s.count_u = s.count_v = 4;
    s.rational = true;
    s.knots_u = s.knots_v = {0, 0, 0, 0, 1, 1, 1, 1};
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) {
            const double w = i == 1 && j == 2 ? weight : 1;
            s.control_points.push_back({w * 4 * i, w * 4 * j, w * ((i + j) % 2), w});
        }
    const Vec2d corners[3] = {{0, 0}, {1, 0.2}, {0.4, 1}};
    CadLoop& loop = face.loops.emplace_back();
    for (uint32_t k = 0; k < 3; ++k) {
        const Vec2d &a = corners[k], &b = corners[(k + 1) % 3];
        CadEdgeUse use;
        use.pcurve.knots = {0, 0, 1, 1};
        use.pcurve.control_points = {{a.x, a.y, 1}, {b.x, b.y, 1}};
        use.last = 1;
        use.edge = k;
        loop.push_back(use);
    }
    CadModel model = model_of(face);
    model.parts[0].edges.assign(3, {1e-6, false});
    return model;
}

TEST(cut_by_weights, gives_no_empty_piece_however_far_apart_weights_and_parameters_are)
{
    RandomSurfaces random(6);
    for (const double lo : {0.0, 1e3, 1e9}) {
        BezierPatch patch = random_patch(random, 0, 3, 3);
        patch.domain = {{lo, -lo - 1}, {lo + 1, -lo}};
        for (double& c : patch.control_points[5])
            c *= 1e30;
        const CutPatch cut = cut_by_weights(patch);
        EXPECT_TRUE(cut.too_fast);
        EXPECT_LE(cut.pieces.size(), kMostPieces);
        for (const BezierPatch& piece : cut.pieces) {
            EXPECT_GT(piece.domain.hi.x, piece.domain.lo.x);
            EXPECT_GT(piece.domain.hi.y, piece.domain.lo.y);
        }
    }
}

TEST(cut_by_weights, what_single_precision_cannot_keep_is_named)
{
    BuildReport report;
    EXPECT_EQ(build_pack(heavy_triangle(1), {}, report).patches.size(), 1u);
    EXPECT_TRUE(report.warnings.empty());
    EXPECT_GT(build_pack(heavy_triangle(1e6), {}, report).patches.size(), 10u);
    ASSERT_EQ(report.warnings.size(), 1u);
    EXPECT_NE(report.warnings[0].find("part 0, face 0"), std::string::npos);
    EXPECT_NE(report.warnings[0].find("points of its trims"), std::string::npos) << report.warnings[0];
    EXPECT_LE(build_pack(heavy_triangle(1e25), {}, report).patches.size(), kMostPieces);
    ASSERT_EQ(report.warnings.size(), 2u);
    EXPECT_NE(report.warnings[0].find("rays may pass through"), std::string::npos) << report.warnings[0];
}

} // namespace
} // namespace trimray
