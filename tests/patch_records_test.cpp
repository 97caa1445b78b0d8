// Patch records are the surface they came from, and parameters read back from a point are the domain's.
#include "format/record_surface.h"
#include "preprocess/bezier_patch.h"
#include "preprocess/vec3d.h"
#include "tests/random_surfaces.h"

#include <gtest/gtest.h>

namespace trimray {
namespace {

using test::RandomSurfaces;

constexpr double kPi = 3.14159265358979323846;

Vec3d patch_to_mm(const PatchRecord& r, const PartFrame& frame, const std::array<double, 3>& q)
{
    double p[3];
    for (int c = 0; c < 3; ++c)
        p[c] = double(r.origin_hi[c]) + r.origin_lo[c] +
               r.scale * (r.axis_x[c] * q[0] + r.axis_y[c] * q[1] + r.axis_z[c] * q[2]);
    return frame.origin_mm + frame.scale_mm * Vec3d{p[0], p[1], p[2]};
}

/// The record's own parameters at a point in mm, as a tracer finds them: from the point alone.
Vec2d uv_face_of_point(const PatchRecord& r, const PartFrame& frame, const Vec3d& mm)
{
    const Vec3d part = (1 / frame.scale_mm) * (mm - frame.origin_mm);
    const double p[3] = {part.x, part.y, part.z};
    double q[3] = {};
    for (int c = 0; c < 3; ++c) {
        const double d = (p[c] - r.origin_hi[c] - r.origin_lo[c]) / r.scale;
        q[0] += d * r.axis_x[c];
        q[1] += d * r.axis_y[c];
        q[2] += d * r.axis_z[c];
    }
    const uint kind = r.shape & 0xffu;
    double u = std::atan2(q[1], q[0]), v = q[2];
    switch (kind) {
    case kKindPlane:
        u = q[0];
        v = q[1];
        break;
    case kKindCone: {
        const double a = std::atan(double(r.param[1]));
        v = q[2] / std::cos(a);
        if (r.param[0] + v * std::sin(a) < 0)
            u = std::atan2(-q[1], -q[0]);
        break;
    }
    case kKindSphere:
        v = std::atan2(q[2], std::hypot(q[0], q[1]));
        break;
    case kKindTorus:
        v = std::atan2(q[2], std::hypot(q[0], q[1]) - r.param[0]);
        break;
    default:
        break;
    }
    Vec2d uv{r.uv_offset[0] + r.uv_scale[0] * u, r.uv_offset[1] + r.uv_scale[1] * v};
    if (kind == kKindTorus && uv.y < 0.5 - kPi * r.uv_scale[1])
        uv.y += 2 * kPi * r.uv_scale[1]; // pack_layout.h
    return uv;
}

TEST(append_patches, native_records_are_their_surface_and_give_back_its_parameters)
{
    RandomSurfaces random(1);
    const PartFrame frame{{3, -4, 5}, 50};
    int natives = 0;
    for (uint kind = kKindPlane; kind <= kKindTorus; ++kind) {
        for (int repeat = 0; repeat < 200; ++repeat) {
            const CadSurface s = random.native(kind);
            const Rect2d d = random.native_domain(kind);
            std::vector<PatchRecord> patches;
            std::vector<float> control_points;
            ASSERT_TRUE(append_patches(s, d, frame, 7, patches, control_points).ok());
            ASSERT_EQ(patches.size(), 1u);
            const PatchRecord& r = patches[0];
            if (r.shape != kind)
                continue; // nearly flat: the next test's
            natives += 1;
            ASSERT_EQ(r.face, 7u);
            EXPECT_GE(r.param[0], 0);
            for (int i = 0; i < 20; ++i) {
                // inside the domain: at its very ends of a full turn both ends are right answers
                const Vec2d uv_face{random.uniform(0.001, 0.999), random.uniform(0.001, 0.999)};
                const double u = std::lerp(d.lo.x, d.hi.x, uv_face.x), v = std::lerp(d.lo.y, d.hi.y, uv_face.y);
                const Vec3d exact = evaluate(s, u, v).p;
                const std::array<double, 3> q = point_of(r, nullptr, (uv_face.x - r.uv_offset[0]) / r.uv_scale[0],
                                                         (uv_face.y - r.uv_offset[1]) / r.uv_scale[1]);
                EXPECT_LE(std::hypot(q[0], q[1], q[2]), 1.00001) << "numbers of about 1";
                const double patch_mm = r.scale * frame.scale_mm;
                EXPECT_LE(norm(patch_to_mm(r, frame, q) - exact), 2e-6 * patch_mm);
                const double rho = std::hypot(q[0], q[1]); // near the axis the angle says little
                const Vec2d found = uv_face_of_point(r, frame, exact);
                if (kind == kKindPlane || rho > 0.01) {
                    EXPECT_NEAR(found.x, uv_face.x, 1e-4 * std::max(1.0f, r.uv_scale[0]));
                    EXPECT_NEAR(found.y, uv_face.y, 1e-4 * std::max(1.0f, r.uv_scale[1]));
                }
            }
        }
    }
    EXPECT_GT(natives, 900);
}

TEST(append_patches, small_domains_of_wide_surfaces_keep_their_precision_and_parameters)
{
    RandomSurfaces random(7);
    for (uint kind = kKindCylinder; kind <= kKindTorus; ++kind) {
        for (int repeat = 0; repeat < 50; ++repeat) {
            CadSurface s = random.native(kind);
            s.radius *= 1e4;
            s.minor_radius *= 1e4;
            const bool v_is_angle = kind == kKindSphere || kind == kKindTorus;
            const double mm = random.uniform(0.5, 5), u = random.uniform(-6, 6);
            const double v = v_is_angle ? random.uniform(-1.2, 1.2) : random.uniform(-1, 1);
            const double rho = norm(evaluate(s, u, v).du), speed_v = norm(evaluate(s, u, v).dv);
            const Rect2d d{{u, v}, {u + mm / rho, v + mm / speed_v}};
            std::vector<PatchRecord> patches;
            std::vector<float> control_points;
            const PartFrame frame{evaluate(s, u, v).p, 10};
            ASSERT_TRUE(append_patches(s, d, frame, 0, patches, control_points).ok());
            ASSERT_EQ(patches.size(), 1u);
            ASSERT_EQ(patches[0].shape & 0xffu, kKindBezier);
            for (int i = 0; i < 20; ++i) {
                const double a = random.uniform(0, 1), b = random.uniform(0, 1);
                const Vec3d exact = evaluate(s, std::lerp(d.lo.x, d.hi.x, a), std::lerp(d.lo.y, d.hi.y, b)).p;
                const Vec3d ours = patch_to_mm(patches[0], frame, point_of(patches[0], control_points.data(), a, b));
                EXPECT_LE(norm(ours - exact), 1e-6 * mm); // in the native form: 1e-7 of the radius, 1e-3 to 1e-2 mm
            }
        }
    }
}

TEST(append_patches, bezier_records_are_their_surface_within_single_precision)
{
    RandomSurfaces random(2);
    const PartFrame frame{{1, 2, 3}, 20};
    for (int repeat = 0; repeat < 60; ++repeat) {
        const CadSurface s = random.spline(random.integer(1, 9), random.integer(1, 9), repeat % 2 == 0, 3, 3);
        const Rect2d d = s.natural_bounds;
        std::vector<PatchRecord> patches;
        std::vector<float> control_points;
        ASSERT_TRUE(append_patches(s, d, frame, 0, patches, control_points).ok());
        double area = 0;
        for (const PatchRecord& r : patches) {
            area += double(r.uv_scale[0]) * r.uv_scale[1];
            for (int i = 0; i < 10; ++i) {
                const double a = random.uniform(0, 1), b = random.uniform(0, 1);
                const std::array<double, 3> q = point_of(r, control_points.data(), a, b);
                EXPECT_LE(std::hypot(q[0], q[1], q[2]), 1.00001);
                const double u = std::lerp(d.lo.x, d.hi.x, r.uv_offset[0] + r.uv_scale[0] * a);
                const double v = std::lerp(d.lo.y, d.hi.y, r.uv_offset[1] + r.uv_scale[1] * b);
                EXPECT_LE(norm(patch_to_mm(r, frame, q) - evaluate(s, u, v).p), 4e-6 * r.scale * frame.scale_mm);
            }
        }
        EXPECT_NEAR(area, 1, 1e-6);
    }
}

TEST(append_patches, a_part_far_from_the_origin_keeps_its_precision)
{
    RandomSurfaces random(3);
    const CadSurface s = random.spline(3, 3, true, 2, 2);
    std::vector<PatchRecord> near_patches, far_patches;
    std::vector<float> near_points, far_points;
    ASSERT_TRUE(append_patches(s, s.natural_bounds, PartFrame{{5, 5, 0}, 10}, 0, near_patches, near_points).ok());
    CadSurface moved = s;
    for (auto& p : moved.spline.control_points)
        p[0] += 1e6 * p[3];
    ASSERT_TRUE(
        append_patches(moved, s.natural_bounds, PartFrame{{1e6 + 5, 5, 0}, 10}, 0, far_patches, far_points).ok());
    ASSERT_EQ(near_points.size(), far_points.size());
    for (size_t i = 0; i < near_points.size(); ++i)
        EXPECT_NEAR(near_points[i], far_points[i], 1e-8); // 1e6 mm in double leaves 1e-10 mm
}

TEST(append_patches, refuses_with_a_reason)
{
    RandomSurfaces random(4);
    std::vector<PatchRecord> patches;
    std::vector<float> control_points;
    const auto code_of = [&](const CadSurface& s, const Rect2d& d) {
        const auto appended = append_patches(s, d, PartFrame{}, 0, patches, control_points);
        EXPECT_FALSE(appended.ok());
        EXPECT_TRUE(appended.ok() || !appended.error().detail.empty());
        return appended.ok() ? ErrorCode::Internal : appended.error().code;
    };
    const CadSurface good = random.spline(3, 3, true, 2, 2);
    CadSurface s = good;
    s.spline.control_points[5][3] = -1;
    EXPECT_EQ(code_of(s, s.natural_bounds), ErrorCode::UnsupportedSurface);
    s = good;
    s.spline.control_points[0][3] = 0;
    EXPECT_EQ(code_of(s, s.natural_bounds), ErrorCode::UnsupportedSurface);
    s = good;
    s.spline.control_points[0][0] = std::nan("");
    EXPECT_EQ(code_of(s, s.natural_bounds), ErrorCode::InvalidSurface);
    s = good;
    s.spline.degree_u = 26;
    EXPECT_EQ(code_of(s, s.natural_bounds), ErrorCode::UnsupportedSurface);
    s = good;
    for (auto& p : s.spline.control_points)
        p = {1, 2, 3, 1};
    EXPECT_EQ(code_of(s, s.natural_bounds), ErrorCode::InvalidSurface);
    EXPECT_EQ(code_of(good, {{100, 100}, {101, 101}}), ErrorCode::InvalidSurface);
    const CadSurface cylinder = random.native(kKindCylinder);
    EXPECT_EQ(code_of(cylinder, {{0, 0}, {1, 0}}), ErrorCode::InvalidSurface);
    EXPECT_EQ(code_of(cylinder, {{0, 0}, {1, INFINITY}}), ErrorCode::InvalidSurface);
    CadSurface thread = cylinder;
    thread.radius = -1;
    EXPECT_EQ(code_of(thread, {{0, 0}, {1, 1}}), ErrorCode::InvalidSurface);
    EXPECT_TRUE(patches.empty());
    EXPECT_TRUE(control_points.empty());
}

TEST(append_patches, weights_over_twelve_decades_stay_finite_and_positive)
{
    RandomSurfaces random(5);
    CadSurface s = random.spline(3, 3, true, 1, 1);
    for (size_t i = 0; i < s.spline.control_points.size(); ++i) {
        const double w = std::pow(10, random.uniform(-6, 6));
        for (double& c : s.spline.control_points[i])
            c *= w;
    }
    std::vector<PatchRecord> patches;
    std::vector<float> control_points;
    ASSERT_TRUE(append_patches(s, s.natural_bounds, PartFrame{{0, 0, 0}, 10}, 0, patches, control_points).ok());
    for (size_t i = 0; i < control_points.size(); i += 4) {
        EXPECT_GT(control_points[i + 3], 0);
        EXPECT_LE(control_points[i + 3], 1);
        for (int c = 0; c < 3; ++c)
            EXPECT_LE(std::abs(control_points[i + c]), 1.001 * control_points[i + 3]);
    }
}

TEST(surface_extent, gives_areas_and_lengths_of_known_surfaces)
{
    CadSurface s;
    s.kind = kKindSphere;
    s.radius = 2;
    SurfaceExtent e = surface_extent(s, {{0, -kPi / 2}, {2 * kPi, kPi / 2}});
    EXPECT_NEAR(e.area_mm2, 4 * kPi * 4, 1e-12);
    EXPECT_NEAR(e.length_v_mm, 2 * kPi, 1e-12);
    s.kind = kKindTorus;
    s.radius = 5;
    s.minor_radius = 2;
    EXPECT_NEAR(surface_extent(s, {{0, 0}, {2 * kPi, 2 * kPi}}).area_mm2, 4 * kPi * kPi * 10, 1e-10);
    s.kind = kKindCone;
    s.radius = 0;
    s.half_angle = 0.5;
    EXPECT_NEAR(surface_extent(s, {{0, -1}, {kPi, 2}}).area_mm2, kPi * std::sin(0.5) * (0.5 + 2), 1e-12);
    s.kind = kKindCylinder;
    s.radius = 3;
    e = surface_extent(s, {{1, 2}, {2, 6}});
    EXPECT_NEAR(e.area_mm2, 12, 1e-12);
    EXPECT_NEAR(e.length_u_mm, 3, 1e-12);
    EXPECT_NEAR(e.length_v_mm, 4, 1e-12);

    // a spline: against a fine midpoint sum
    RandomSurfaces random(6);
    for (int repeat = 0; repeat < 10; ++repeat) {
        const CadSurface b = random.spline(3, 2, repeat % 2 == 0, 3, 3);
        const Rect2d& d = b.natural_bounds;
        constexpr int kSteps = 200;
        double area = 0;
        for (int i = 0; i < kSteps; ++i) {
            for (int j = 0; j < kSteps; ++j) {
                const SurfaceDerivatives at = evaluate(b, std::lerp(d.lo.x, d.hi.x, (i + 0.5) / kSteps),
                                                       std::lerp(d.lo.y, d.hi.y, (j + 0.5) / kSteps));
                area += norm(cross(at.du, at.dv));
            }
        }
        area *= (d.hi.x - d.lo.x) * (d.hi.y - d.lo.y) / (kSteps * kSteps);
        EXPECT_NEAR(surface_extent(b, d).area_mm2 / area, 1, 0.05); // jagged nets: smooth ones do better
    }
}

} // namespace
} // namespace trimray
