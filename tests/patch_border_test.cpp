// No ray passes between the patches of one face, however narrow they are and however slant the ray.
#include "preprocess/bezier_patch.h"
#include "preprocess/build_pack.h"
#include "runtime/tracer.h"
#include "tests/keep_vulkan_loaded.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <random>

namespace trimray {
namespace {

constexpr double kSide_mm = 100;

/// A bicubic face, wavy, of so many patches along u and one along v.
CadModel strips(int patches)
{
    CadFace face;
    face.surface.kind = kKindBezier;
    face.surface.source_kind = "bspline";
    face.surface.natural_bounds = {{0, 0}, {double(patches), 1}};
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
    CadModel model;
    model.parts.emplace_back().faces.push_back(face);
    model.instances.emplace_back();
    model.tree.emplace_back();
    return model;
}

/// Missed rays of close-ups of the patches' common sides, along x `tilt_deg` from upright.
int64_t missed_rays(Tracer& tracer, const CadSurface& surface, int patches, double tilt_deg, double pixel_mm)
{
    constexpr double kDistance_mm = 300;
    const double tilt = tilt_deg * std::numbers::pi / 180;
    int64_t missed = 0;
    for (int side = 1; side < std::min(patches, 40); ++side)
        for (const double v : {0.137, 0.5, 0.871}) {
            const Vec3d p = evaluate(surface, side, v).p;
            RenderOptions options;
            options.width = options.height = 64;
            options.shade = false;
            options.trim = TrimMode::Exact;
            options.camera.target = {p.x, p.y, p.z};
            options.camera.eye = {p.x + kDistance_mm * std::sin(tilt), p.y + 11, p.z + kDistance_mm * std::cos(tilt)};
            options.camera.up = {0, 1, 0};
            options.camera.fov_deg = 360 / std::numbers::pi * std::atan(32 * pixel_mm / kDistance_mm);
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

TEST(patch_border, lets_no_ray_through_whatever_the_patches_shape_and_the_rays_slant)
{
    keep_vulkan_loaded();
    for (const auto& [patches, tilt_deg] : {std::pair{4, 80.0}, {16, 60.0}, {64, 80.0}, {256, 60.0}}) {
        const CadModel model = strips(patches);
        const CadSurface& surface = model.parts[0].faces[0].surface;
        BuildReport report;
        auto scene = std::make_shared<Scene>();
        scene->pack.image = build_pack(model, {}, report);
        ASSERT_EQ(scene->pack.image.patches.size(), size_t(patches));
        const auto cpu = make_cpu_tracer(scene);
        ASSERT_TRUE(cpu.ok());
        for (const double pixel_mm : {1e-4, 1e-5})
            EXPECT_EQ(missed_rays(**cpu, surface, patches, tilt_deg, pixel_mm), 0) << patches << ", " << tilt_deg;
        const auto vulkan = make_vulkan_tracer(scene, true, false);
        if (!vulkan.ok()) {
            std::cout << "skipped vulkan: " << vulkan.error().detail << "\n";
            continue;
        }
        EXPECT_EQ(missed_rays(**vulkan, surface, patches, tilt_deg, 1e-4), 0) << patches << ", " << tilt_deg;
    }
}

} // namespace
} // namespace trimray
