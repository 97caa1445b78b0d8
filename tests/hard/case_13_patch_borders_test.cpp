// Hard case 13: leaks at patch borders, where a root just outside of a patch is rejected on both sides. No ray passes
// between the patches of one face, however narrow they are and however slant the ray.
#include "preprocess/bezier_patch.h"
#include "tests/hard/closest_hits.h"
#include "tests/spline_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <random>

namespace trimray::hard {
namespace {

constexpr double kSide_mm = 100;

/// A bicubic face, wavy, of so many patches along u and one along v.
CadModel strips(int patches)
{
    CadFace face = spline_face({{0, 0}, {double(patches), 1}});
    SplineSurface& s = face.surface.spline;
    s.degree_u = s.degree_v = 3;
    s.count_u = patches + 3;
    s.count_v = 4;
    for (int i = -3; i <= patches + 3; ++i)
        s.knots_u.push_back(std::clamp(i, 0, patches));
    s.knots_v = {0, 0, 0, 0, 1, 1, 1, 1};
    std::mt19937 rng(5);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < s.count_u; ++i)
        for (int j = 0; j < s.count_v; ++j) {
            const double x = kSide_mm * i / (s.count_u - 1) + 0.137, y = kSide_mm * j / 3 - 3.3;
            const double z =
                3 * std::sin(0.05 * x) + 2 * std::cos(0.04 * y + 0.02 * x) + 0.3 * uniform(rng) * kSide_mm / s.count_u;
            s.control_points.push_back({x, y, z, 1});
        }
    return model_of(face);
}

/// A face of degree 1, so that neighbouring patches share no more than their common side: hills of random heights,
/// `patches` by `patches` over 100 mm by 100 mm.
CadModel hills(int patches)
{
    CadFace face = spline_face({{0, 0}, {double(patches), double(patches)}});
    SplineSurface& s = face.surface.spline;
    s.degree_u = s.degree_v = 1;
    s.count_u = s.count_v = patches + 1;
    for (int i = -1; i <= patches + 1; ++i)
        s.knots_u.push_back(std::clamp(i, 0, patches));
    s.knots_v = s.knots_u;
    std::mt19937 rng(6);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i <= patches; ++i)
        for (int j = 0; j <= patches; ++j)
            s.control_points.push_back(
                {kSide_mm * i / patches + 0.137, kSide_mm * j / patches - 3.3, 20 * uniform(rng) / patches, 1});
    return model_of(face);
}

/// Missed rays of close-ups of the patches' common sides, along x `tilt_deg` from upright. `thinning`: of every so many
/// sides one, in pictures with sides so many times shorter.
int64_t missed_rays(Tracer& tracer, const CadSurface& surface, int patches, double tilt_deg, double pixel_mm,
                    int thinning)
{
    constexpr double kDistance_mm = 300;
    const double tilt = tilt_deg * std::numbers::pi / 180;
    const int pixels = 64 / thinning;
    int64_t missed = 0;
    for (int side = 1; side < std::min(patches, 40); side += thinning)
        for (const double v : {0.137, 0.5, 0.871}) {
            const Vec3d p = evaluate(surface, side, v).p;
            RenderOptions options;
            options.width = options.height = uint32_t(pixels);
            options.shade = false;
            options.trim = TrimMode::Exact;
            options.camera.target = {p.x, p.y, p.z};
            options.camera.eye = {p.x + kDistance_mm * std::sin(tilt), p.y + 11, p.z + kDistance_mm * std::cos(tilt)};
            options.camera.up = {0, 1, 0};
            options.camera.fov_deg = 360 / std::numbers::pi * std::atan(0.5 * pixels * pixel_mm / kDistance_mm);
            RenderStats stats;
            const Result<Frame> frame = tracer.render(options, stats);
            if (!frame.ok()) {
                ADD_FAILURE() << frame.error().detail;
                return missed;
            }
            missed += std::count(frame->face.begin(), frame->face.end(), -1);
        }
    return missed;
}

TEST(case_13, no_ray_passes_between_patches_whatever_their_shape_and_its_slant)
{
    keep_vulkan_loaded();
    for (const auto& [patches, tilt_deg] : {std::pair{4, 80.0}, {16, 60.0}, {64, 80.0}, {256, 60.0}}) {
        const CadModel model = strips(patches);
        const CadSurface& surface = model.parts[0].faces[0].surface;
        BuildReport report;
        const auto scene = converted(model, report);
        ASSERT_EQ(scene->pack.image.patches.size(), size_t(patches));
        const auto cpu = make_cpu_tracer(scene);
        ASSERT_TRUE(cpu.ok());
        for (const double pixel_mm : {1e-4, 1e-5})
            EXPECT_EQ(missed_rays(**cpu, surface, patches, tilt_deg, pixel_mm, 1), 0) << patches << ", " << tilt_deg;
        const auto vulkan = make_vulkan_tracer(scene, true, false);
        if (!vulkan.ok()) {
            std::cout << "skipped vulkan: " << vulkan.error().detail << "\n";
            continue;
        }
        EXPECT_EQ(missed_rays(**vulkan, surface, patches, tilt_deg, 1e-4, 3), 0) << patches << ", " << tilt_deg;
    }
}

TEST(case_13, patches_with_creases_between_them_leave_no_hole_edge_on)
{
    for (const int patches : {8, 40}) {
        BuildReport report;
        const auto scene = converted(hills(patches), report);
        ASSERT_EQ(scene->pack.image.patches.size(), size_t(patches) * patches);
        std::vector<View> views;
        for (const double height_mm : {30.0, 5.0, 0.5}) { // seen at 14, 2.5 and 0.2 degrees
            Camera camera;
            camera.eye = {-70, 20, height_mm};
            camera.target = {50, 46.7, 0};
            camera.fov_deg = 20;
            views.push_back({camera, 240, 180});
        }
        on_both_tracers(scene, views, [](const Score& score) {
            EXPECT_GT(score.hits, score.rays / 8);
            EXPECT_EQ(score.false_misses, 0u) << score;
            EXPECT_EQ(score.false_hits, 0u) << score;
        });
    }
}

} // namespace
} // namespace trimray::hard
