// Maps drawn on surfaces against closed forms, on the CPU and through Vulkan; what both draw, and pictures kept of it.
#include "runtime/surface_map.h"
#include "tests/closed_forms.h"
#include "tests/compare_frames.h"
#include "tests/golden_pictures.h"
#include "tests/traced_scenes.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace trimray {
namespace {

double dot(const Vec3& a, const Vec3& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Vec3 scaled_sum(const Vec3& a, double s, const Vec3& b)
{
    return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]};
}
Vec3 unit(const Vec3& a)
{
    return scaled_sum({}, 1 / std::sqrt(dot(a, a)), a);
}

RenderOptions seen_from(const Vec3& eye, SurfaceMap map)
{
    RenderOptions options;
    options.width = 160;
    options.height = 100;
    options.camera = {eye, {0, 0, 0}, {0, 0, 1}, 35};
    options.error_px = 1e-4f;
    options.look.map.map = map;
    return options;
}

/// Calls with each pixel that shows a face, and where its hit is.
void each_hit(const Frame& frame, const RenderOptions& options, const std::function<void(size_t, const Vec3&)>& body)
{
    const PixelRays rays(options);
    for (size_t i = 0; i < frame.face.size(); ++i)
        if (frame.face[i] >= 0)
            body(i, rays.hit(frame, i));
}

struct Principal {
    double larger, smaller;
};

/// Every curvature map of the scene is what `expected` says of the point, relative to the larger of both; the Gaussian
/// to its square.
void expect_curvatures(const std::shared_ptr<const Scene>& scene, const Vec3& eye,
                       const std::function<Principal(const Vec3&)>& expected, double most = 2e-6)
{
    const std::pair<SurfaceMap, std::function<double(Principal)>> maps[] = {
        {SurfaceMap::CurvatureMax, [](Principal k) { return k.larger; }},
        {SurfaceMap::CurvatureMin, [](Principal k) { return k.smaller; }},
        {SurfaceMap::CurvatureMean, [](Principal k) { return 0.5 * (k.larger + k.smaller); }},
        {SurfaceMap::CurvatureGaussian, [](Principal k) { return k.larger * k.smaller; }}};
    for (const auto& [map, of] : maps) {
        const RenderOptions options = seen_from(eye, map);
        const Frame frame = draw(scene, options).frame;
        ASSERT_EQ(frame.map_value.size(), frame.face.size());
        int hits = 0;
        double worst = 0;
        each_hit(frame, options, [&](size_t i, const Vec3& p) {
            const Principal k = expected(p);
            const double largest = std::max(std::abs(k.larger), std::abs(k.smaller));
            const double unit_of = map == SurfaceMap::CurvatureGaussian ? largest * largest : largest;
            worst = std::max(worst, std::abs(double(frame.map_value[i]) - of(k)) / unit_of);
            ++hits;
        });
        EXPECT_GT(hits, 500) << surface_map_name(map);
        EXPECT_LE(worst, most) << surface_map_name(map);
        for (size_t i = 0; i < frame.face.size(); ++i)
            ASSERT_TRUE(frame.face[i] >= 0 || frame.map_value[i] == 0);
    }
}

TracedScene one_sphere(double radius_mm)
{
    TracedScene scene;
    scene.add(kKindSphere, radius_mm / 10, {0, 0, 0}, {kPi, kPi / 2});
    return scene;
}

TEST(surface_map, a_ball_is_curved_alike_in_all_directions)
{
    TracedScene ball = one_sphere(7);
    expect_curvatures(ball.finish(), {20, -30, 15}, [](const Vec3&) { return Principal{1 / 7.0, 1 / 7.0}; });
    TracedScene hollow = one_sphere(7);
    hollow.image.faces[0].flags |= kFaceReversed;
    expect_curvatures(hollow.finish(), {20, -30, 15}, [](const Vec3&) { return Principal{-1 / 7.0, -1 / 7.0}; });
}

TEST(surface_map, placements_turn_mirror_and_scale_curvatures)
{
    const auto ball_of_14 = [](const Vec3&) { return Principal{1 / 14.0, 1 / 14.0}; };
    for (const std::array<double, 12>& placed :
         {std::array<double, 12>{2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0},
          std::array<double, 12>{-2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0}, // mirrored
          std::array<double, 12>{0, -1.2, 1.6, 0, 2, 0, 0, 0, 0, 1.6, 1.2, 0}}) {
        TracedScene scene = one_sphere(7);
        scene.place(placed);
        expect_curvatures(scene.finish(), {40, -60, 30}, ball_of_14);
        TracedScene left_handed = one_sphere(7);
        left_handed.image.patches[0].axis_y[1] = -1; // S_u x S_v points inwards
        left_handed.image.faces[0].flags |= kFaceReversed;
        left_handed.place(placed);
        expect_curvatures(left_handed.finish(), {40, -60, 30}, ball_of_14);
    }
    TracedScene stretched = one_sphere(7);
    stretched.place({2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0});
    const auto scene = stretched.finish();
    const auto tracer = make_cpu_tracer(scene);
    ASSERT_TRUE(tracer.ok());
    RenderStats stats;
    const Result<Frame> refused = (*tracer)->render(seen_from({40, -60, 30}, SurfaceMap::CurvatureMean), stats);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::UnsupportedPackFeature);
    EXPECT_EQ(refused.error().where, "instance 0");
    EXPECT_TRUE((*tracer)->render(seen_from({40, -60, 30}, SurfaceMap::Zebra), stats).ok());
}

TEST(surface_map, cylinders_and_cones_are_curved_across_their_axis)
{
    TracedScene rod;
    rod.add(kKindCylinder, 0.5, {0, 0, 0}, {kPi, 2});
    expect_curvatures(rod.finish(), {20, -30, 10}, [](const Vec3&) { return Principal{1 / 5.0, 0}; });
    // a wire 4000 times as long as it is thick: its points have 1e-4 of its radius in rounding
    TracedScene wire;
    PatchRecord& thin = wire.add(kKindCylinder, 1, {0, 0, 0}, {kPi, 1});
    thin.param[0] = 5e-4f;
    RenderOptions options = seen_from({0.02, -0.03, 0.01}, SurfaceMap::CurvatureMax);
    const Frame frame = draw(wire.finish(), options).frame;
    each_hit(frame, options, [&](size_t i, const Vec3&) { ASSERT_NEAR(frame.map_value[i] * 5e-3, 1, 1e-6); });

    TracedScene bore;
    PatchRecord& cone = bore.add(kKindCone, 0.5, {0, 0, 0}, {kPi, 1});
    cone.param[1] = -0.5f; // narrower towards +z
    bore.image.faces[0].flags |= kFaceReversed;
    const double cos_a = 1 / std::sqrt(1.25);
    expect_curvatures(bore.finish(), {20, -30, 10}, [&](const Vec3& p) {
        return Principal{0, -cos_a / std::hypot(p[0], p[1])};
    });
}

TEST(surface_map, tori_are_curved_outwards_at_the_rim_and_both_ways_inside)
{
    constexpr double kScale = 6;            // mm of its unit
    for (const double minor : {0.3, 1.4}) { // the second is a spindle
        TracedScene ring;
        PatchRecord& torus = ring.add(kKindTorus, kScale / 10, {0, 0, 0}, {kPi, kPi});
        torus.param[1] = float(minor);
        const double r = kScale * double(float(minor));
        expect_curvatures(
            ring.finish(), {20, -30, 40},
            [&](const Vec3& p) {
                const double rho = std::hypot(p[0], p[1]);
                const double outer = std::abs(std::hypot(rho - kScale, p[2]) - r);
                const double inner = std::abs(std::hypot(-rho - kScale, p[2]) - r);
                const double side = inner < outer ? -1 : 1;
                // where the tube has passed through the axis its outside is its inside
                const double a = side / r, b = (rho - side * kScale) / r / rho * side;
                return Principal{std::max(a, b), std::min(a, b)};
            },
            2e-5); // near the axis of the spindle, by rounding of the distance from it
    }
}

TEST(surface_map, bezier_patches_are_curved_as_their_polynomials)
{
    // z = (x^2 - 3 y^2) / 4 over [-1, 1]^2, as a patch of degree 2 x 2
    const auto blossom = [](double a, double b) { return a * b; }; // of x^2, between the ends of a side
    TracedScene saddle;
    saddle.add_bezier(2, 2, false, 1, {0, 0, 0});
    const std::array<std::array<double, 2>, 3> ends = {{{-1, -1}, {-1, 1}, {1, 1}}};
    for (const auto& u : ends)
        for (const auto& v : ends) {
            const double z = 0.25 * (blossom(u[0], u[1]) - 3 * blossom(v[0], v[1]));
            for (const double c : {0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]), z})
                saddle.image.control_points.push_back(float(c));
        }
    expect_curvatures(saddle.finish(), {10, -24, 28}, [](const Vec3& p) {
        // by the normal S_u x S_v, upwards; 10 mm a unit. do Carmo 3-3, example 5
        const double x = p[0] / 10, y = p[1] / 10, zx = 0.5 * x, zy = -1.5 * y, zxx = 0.5, zyy = -1.5;
        const double w = 1 + zx * zx + zy * zy;
        const double gaussian = zxx * zyy / (w * w);
        const double mean = -0.5 * ((1 + zy * zy) * zxx + (1 + zx * zx) * zyy) / std::pow(w, 1.5);
        const double spread = std::sqrt(mean * mean - gaussian);
        return Principal{(mean + spread) / 10, (mean - spread) / 10};
    });
}

/// An eighth of a ball of 8 mm as a rational patch with a pole, control points (wx, wy, wz, w).
TracedScene octant()
{
    TracedScene scene;
    scene.add_bezier(2, 2, true, 0.8, {0, 0, 0});
    const double half = std::sqrt(0.5);
    const double arc[3][3] = {{1, 0, 1}, {half, half, half}, {0, 1, 1}}; // (w cos, w sin, w)
    for (const auto& [cu, su, wu] : arc)
        for (const auto& [cv, sv, wv] : arc)
            for (const double c : {cu * cv, su * cv, wu * sv, wu * wv})
                scene.image.control_points.push_back(float(c));
    return scene;
}

TEST(surface_map, rational_patches_are_curved_as_the_quadrics_they_are)
{
    const auto scene = octant().finish();
    // away from the pole, and up to it: there it is that of a point a little way inside
    const auto worst_of = [&](double least_angle, double most_angle) {
        RenderOptions options = seen_from({25, 25, 40}, SurfaceMap::CurvatureMin);
        options.camera.target = {2, 2, 6};
        options.camera.fov_deg = 10;
        const Frame frame = draw(scene, options).frame;
        double worst = 0;
        int hits = 0;
        each_hit(frame, options, [&](size_t i, const Vec3& p) {
            const double angle = std::atan2(std::hypot(p[0], p[1]), p[2]);
            if (angle < least_angle || angle > most_angle)
                return;
            ++hits;
            worst = std::max(worst, std::abs(double(frame.map_value[i]) * 8 - 1));
        });
        EXPECT_GT(hits, 20);
        return worst;
    };
    EXPECT_LE(worst_of(0.2, 2), 1e-4);
    EXPECT_LE(worst_of(0, 0.2), 1e-2);
}

// ---- bands ---------------------------------------------------------------------------------------------------------

/// Whether a ray of an angle to the axis is in a light band.
bool is_light(double angle, double stripes)
{
    const double phase = angle * stripes / kPi;
    return std::abs(phase - std::round(phase)) < 0.25;
}
double angle_between(const Vec3& a, const Vec3& b)
{
    const Vec3 across = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    return std::atan2(std::sqrt(dot(across, across)), dot(a, b));
}

/// The normal of a closed form along a ray from the eye; nothing where it misses.
using NormalAlong = std::function<std::optional<Vec3>(const Vec3& eye, const Vec3& along)>;

/// Each pixel's share of light bands is the mean of kSamples x kSamples rays through it, as far as a box as wide as the
/// linear change is: on the whole within 0.02, and nowhere off by more than 0.2.
void expect_bands(const std::shared_ptr<const Scene>& scene, const RenderOptions& options, const NormalAlong& normal_at)
{
    constexpr int kSamples = 12;
    const Frame frame = draw(scene, options).frame;
    EXPECT_TRUE(frame.map_value.empty());
    const bool zebra = options.look.map.map == SurfaceMap::Zebra;
    const Vec3 axis = unit(options.look.map.direction);
    const PixelRays rays(options);
    const double dark = zebra ? 0.01 : 0.0;
    double sum = 0, worst = 0;
    int hits = 0, mixed = 0;
    each_hit(frame, options, [&](size_t i, const Vec3&) {
        const double x = double(i % frame.width), y = double(i / frame.width);
        int light = 0;
        for (int s = 0; s < kSamples * kSamples; ++s) {
            const reference::Ray ray =
                rays.through(x + (s % kSamples + 0.5) / kSamples, y + (s / kSamples + 0.5) / kSamples);
            const auto n = normal_at(ray.origin, ray.direction);
            if (!n)
                return;
            const Vec3 seen = zebra ? scaled_sum(ray.direction, -2 * dot(*n, ray.direction), *n) : *n;
            light += is_light(angle_between(seen, axis), options.look.map.stripes);
        }
        const reference::Ray middle = rays.of_pixel(i);
        const double facing = std::abs(dot(*normal_at(middle.origin, middle.direction), middle.direction));
        const double red = double(frame.rgba[4 * i]) / (0.4 + 0.6 * facing);
        const double share = (red - dark) / (0.95 - dark), expected = double(light) / (kSamples * kSamples);
        ++hits;
        mixed += light > 0 && light < kSamples * kSamples;
        sum += std::abs(share - expected);
        worst = std::max(worst, std::abs(share - expected));
    });
    EXPECT_GT(hits, 1000);
    EXPECT_GT(mixed, 100) << "no edge of a band is in the picture";
    EXPECT_LE(sum / hits, 0.02);
    EXPECT_LE(worst, 0.2);
}

std::optional<Vec3> ball_normal(const Vec3& eye, const Vec3& along)
{
    constexpr double kRadius_mm = 7;
    const double b = dot(eye, along), square = b * b - (dot(eye, eye) - kRadius_mm * kRadius_mm);
    if (square < 0)
        return {};
    return unit(scaled_sum(eye, -b - std::sqrt(square), along));
}

TEST(surface_map, zebra_stripes_are_the_mirror_images_of_rings_of_light)
{
    TracedScene ball = one_sphere(7);
    RenderOptions options = seen_from({20, -30, 15}, SurfaceMap::Zebra);
    expect_bands(ball.finish(), options, ball_normal);
    options.camera.orthographic_mm = 18;
    expect_bands(ball.finish(), options, ball_normal);

    TracedScene sheet;
    sheet.add(kKindPlane, 1, {0, 0, 0}, {0.9, 0.7});
    options = seen_from({6, -9, 5}, SurfaceMap::Zebra);
    options.look.map.direction = {1, 2, 0.5};
    options.look.map.stripes = 40;
    expect_bands(sheet.finish(), options, [](const Vec3&, const Vec3&) { return Vec3{0, 0, 1}; });
}

TEST(surface_map, isophotes_are_bands_of_the_normals_angle)
{
    RenderOptions options = seen_from({20, -30, 15}, SurfaceMap::Isophotes);
    options.look.map.direction = {0.3, -1, 2};
    expect_bands(one_sphere(7).finish(), options, ball_normal);
    // the same ball as a spline, through its second derivatives
    RenderOptions near = seen_from({25, 25, 30}, SurfaceMap::Isophotes);
    near.look.map.direction = {0.3, -1, 2};
    near.camera.fov_deg = 15;
    expect_bands(octant().finish(), near, [](const Vec3& eye, const Vec3& along) -> std::optional<Vec3> {
        const double b = dot(eye, along), square = b * b - (dot(eye, eye) - 64);
        if (square < 0)
            return {};
        return unit(scaled_sum(eye, -b - std::sqrt(square), along));
    });
}

TEST(surface_map, stripes_that_no_pixel_can_show_are_grey)
{
    RenderOptions options = seen_from({20, -30, 15}, SurfaceMap::Zebra);
    options.look.map.stripes = kMostStripes;
    const Frame frame = draw(one_sphere(7).finish(), options).frame;
    each_hit(frame, options, [&](size_t i, const Vec3& p) {
        const double facing = -dot(unit(p), unit(scaled_sum(p, -1, options.camera.eye)));
        ASSERT_NEAR(frame.rgba[4 * i], 0.48 * (0.4 + 0.6 * facing), 1e-3);
    });
}

// ---- draft ---------------------------------------------------------------------------------------------------------

TEST(surface_map, a_cones_draft_is_its_half_angle)
{
    for (const bool reversed : {false, true}) {
        TracedScene scene;
        PatchRecord& cone = scene.add(kKindCone, 0.5, {0, 0, 0}, {kPi, 1});
        cone.param[1] = float(std::tan(-5 * kPi / 180)); // narrower towards +z
        if (reversed)
            scene.image.faces[0].flags |= kFaceReversed;
        const RenderOptions options = seen_from({20, -30, 10}, SurfaceMap::Draft);
        const Frame frame = draw(scene.finish(), options).frame;
        int hits = 0;
        each_hit(frame, options, [&](size_t i, const Vec3&) {
            ++hits;
            ASSERT_NEAR(frame.map_value[i], reversed ? -5 : 5, 1e-4);
        });
        EXPECT_GT(hits, 500);
    }
}

TEST(surface_map, drafts_have_three_colours)
{
    RenderOptions options = seen_from({20, -30, 15}, SurfaceMap::Draft);
    options.look.map.draft_deg = 10;
    const Frame frame = draw(one_sphere(7).finish(), options).frame;
    std::array<int, 3> counts{};
    each_hit(frame, options, [&](size_t i, const Vec3& p) {
        const double draft = std::asin(p[2] / std::sqrt(dot(p, p))) * 180 / kPi;
        ASSERT_NEAR(frame.map_value[i], draft, 1e-3);
        if (std::abs(std::abs(draft) - 10) < 2) // pixels on the way from one colour to the next
            return;
        const float* c = &frame.rgba[4 * i];
        const size_t is = c[1] > 1.5f * c[0] ? 0 : c[0] > 2 * c[1] ? 2 : 1; // green, vermilion, yellow
        EXPECT_EQ(is, draft > 10 ? 0u : draft < -10 ? 2u : 1u) << draft;
        ++counts[is];
    });
    for (const int count : counts)
        EXPECT_GT(count, 50);
}

// ---- both tracers, all instruction sets, all units -----------------------------------------------------------------

constexpr SurfaceMap kMaps[] = {SurfaceMap::Zebra,         SurfaceMap::Isophotes,    SurfaceMap::CurvatureGaussian,
                                SurfaceMap::CurvatureMean, SurfaceMap::CurvatureMax, SurfaceMap::CurvatureMin,
                                SurfaceMap::Draft};

TEST(surface_map, instruction_sets_draw_the_same_bits)
{
    const auto scene = all_kinds().finish();
    for (const SurfaceMap map : kMaps) {
        RenderOptions options = overview(160, 90);
        options.look.map.map = map;
        std::optional<Frame> first;
        for (const char* set : {"avx512", "avx2", "sse4"}) {
            if (!make_cpu_tracer(scene, set).ok())
                continue;
            Frame frame = draw(scene, options, set).frame;
            if (first) {
                EXPECT_TRUE(same_bits(first->rgba, frame.rgba)) << surface_map_name(map) << ", " << set;
                EXPECT_TRUE(same_bits(first->map_value, frame.map_value)) << surface_map_name(map) << ", " << set;
            } else {
                first = std::move(frame);
            }
        }
    }
}

TEST(surface_map, values_follow_the_unit_and_pictures_do_not)
{
    const auto at_scale = [](double scale, SurfaceMap map) {
        TracedScene scene = all_kinds();
        scene.image.parts[0].scale_mm *= scale;
        RenderOptions options = overview(160, 90);
        for (double& x : options.camera.eye)
            x *= scale;
        options.look.map.map = map;
        auto finished = std::make_shared<Scene>(*scene.finish());
        for (size_t i = 0; i < 3; ++i) {
            finished->pack.image.bounds_lo_mm[i] *= scale;
            finished->pack.image.bounds_hi_mm[i] *= scale;
        }
        finished->pack.image.world_scale_mm *= scale;
        derive_trees(finished->pack.image);
        return draw(finished, options).frame;
    };
    for (const SurfaceMap map : {SurfaceMap::CurvatureGaussian, SurfaceMap::CurvatureMax, SurfaceMap::Draft})
        for (const double scale : {1000.0, 25.4}) {
            const Frame mm = at_scale(1, map), larger = at_scale(scale, map);
            ASSERT_EQ(mm.face, larger.face);
            const double per = map == SurfaceMap::Draft               ? 1
                               : map == SurfaceMap::CurvatureGaussian ? scale * scale
                                                                      : scale;
            const double size = map == SurfaceMap::Draft ? 90 : 1; // the smallest radius is 0.9 mm
            double worst = 0, worst_color = 0;
            for (size_t i = 0; i < mm.map_value.size(); ++i)
                worst = std::max(worst, std::abs(double(larger.map_value[i]) * per - double(mm.map_value[i])));
            for (size_t i = 0; i < mm.rgba.size(); ++i)
                worst_color = std::max(worst_color, std::abs(double(larger.rgba[i]) - double(mm.rgba[i])));
            EXPECT_LE(worst, 1e-4 * size) << surface_map_name(map);
            EXPECT_LE(worst_color, 2e-3) << surface_map_name(map);
        }
}

/// Through Vulkan, or why not.
Result<Frame> draw_by_vulkan(const std::shared_ptr<const Scene>& scene, const RenderOptions& options)
{
    keep_vulkan_loaded();
    auto tracer = make_vulkan_tracer(scene, true, true);
    if (!tracer.ok())
        return tracer.error();
    RenderStats stats;
    return (*tracer)->render(options, stats);
}

/// What a map has formulas for: a torus, a polynomial and a rational patch, also mirrored and smaller. Few kinds, and
/// no trims: drivers compile them sooner.
std::shared_ptr<const Scene> curved_kinds()
{
    TracedScene scene = octant();
    scene.add(kKindTorus, 0.3, {-0.5, -0.4, 0.3}, {kPi, kPi}).param[1] = 0.3f;
    scene.image.faces.back().flags |= kFaceReversed;
    scene.add_wave(3, {-0.5, 0.5, 0}, 0.4f, 0.5);
    scene.place({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    scene.place({-0.8, 0, 0, 6, 0, 0.8, 0, -6, 0, 0, 0.8, -4});
    return scene.finish();
}

std::string test_name(SurfaceMap map)
{
    std::string name = surface_map_name(map);
    std::replace(name.begin(), name.end(), '-', '_');
    return name;
}

class surface_maps_of_both : public testing::TestWithParam<SurfaceMap> {};

// The formulas are the same; hits differ by Newton's last step, so values by what they change over that.
TEST_P(surface_maps_of_both, tracers_agree)
{
    const auto scene = curved_kinds();
    RenderOptions options = overview(160, 90);
    options.camera.orthographic_mm = GetParam() == SurfaceMap::Zebra ? 24 : 0;
    options.error_px = 1e-4f;
    options.look.map.map = GetParam();
    const Result<Frame> vulkan = draw_by_vulkan(scene, options);
    if (!vulkan.ok() && vulkan.error().code == ErrorCode::NoDevice)
        GTEST_SKIP() << "SKIPPED: " << vulkan.error().detail;
    ASSERT_TRUE(vulkan.ok()) << vulkan.error().where << ": " << vulkan.error().detail;
    const Frame cpu = draw(scene, options).frame;
    ASSERT_EQ(vulkan->map_value.size(), cpu.map_value.size());
    size_t same = 0, far_colors = 0;
    double worst = 0;
    for (size_t i = 0; i < cpu.face.size(); ++i) {
        if (cpu.face[i] != vulkan->face[i] || cpu.instance[i] != vulkan->instance[i])
            continue;
        ++same;
        double color = 0;
        for (size_t c = 0; c < 4; ++c)
            color = std::max(color, std::abs(double(cpu.rgba[4 * i + c]) - double(vulkan->rgba[4 * i + c])));
        far_colors += color > 0.01;
        if (!cpu.map_value.empty()) {
            const double value = double(cpu.map_value[i]);
            worst = std::max(worst, std::abs(value - double(vulkan->map_value[i])) / std::max(std::abs(value), 1.0));
        }
    }
    EXPECT_GE(same, cpu.face.size() - cpu.face.size() / 500);
    EXPECT_LE(far_colors, cpu.face.size() / 2000);
    EXPECT_LE(worst, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(, surface_maps_of_both,
                         testing::Values(SurfaceMap::Zebra, SurfaceMap::CurvatureGaussian, SurfaceMap::Draft),
                         [](const testing::TestParamInfo<SurfaceMap>& info) { return test_name(info.param); });

// ---- requests ------------------------------------------------------------------------------------------------------

TEST(surface_map, requests_that_make_no_sense_are_refused)
{
    const PackImage image = all_kinds().image;
    SurfaceMapLook look;
    look.direction = {0, 0, 0};
    EXPECT_TRUE(check_map(image, look).ok()) << "no map is asked for";
    const auto refused = [&](const SurfaceMapLook& asked) {
        const Status status = check_map(image, asked);
        return !status.ok() && status.error().code == ErrorCode::Usage;
    };
    for (const SurfaceMap map : {SurfaceMap::Zebra, SurfaceMap::Isophotes, SurfaceMap::Draft}) {
        look = {};
        look.map = map;
        EXPECT_TRUE(check_map(image, look).ok());
        for (const double x : {0.0, std::numeric_limits<double>::infinity(), std::nan("")}) {
            look.direction = {x, 0, 0};
            EXPECT_TRUE(refused(look)) << surface_map_name(map) << ", " << x;
        }
    }
    look = {};
    look.map = SurfaceMap::Zebra;
    for (const uint32_t stripes : {0u, kMostStripes + 1}) {
        look.stripes = stripes;
        EXPECT_TRUE(refused(look));
    }
    look = {};
    look.map = SurfaceMap::Draft;
    for (const double draft : {-1.0, 90.0, std::nan("")}) {
        look.draft_deg = draft;
        EXPECT_TRUE(refused(look));
    }
    look = {};
    look.map = SurfaceMap::CurvatureMean;
    using Range = std::array<double, 2>;
    for (const Range& range : {Range{1, 1}, Range{1, -1}, Range{std::nan(""), 1}}) {
        look.range = range;
        EXPECT_TRUE(refused(look));
    }
    look.range = Range{-1, 2};
    EXPECT_TRUE(check_map(image, look).ok());
}

TEST(surface_map, the_ends_of_a_range_have_the_scales_full_colours)
{
    // a ball of curvature 1/7: at the range's end, its middle and beyond it
    const auto color_at = [](double lo, double hi) {
        RenderOptions options = seen_from({20, -30, 15}, SurfaceMap::CurvatureMean);
        options.look.map.range = std::array<double, 2>{lo, hi};
        const Frame frame = draw(one_sphere(7).finish(), options).frame;
        const float* c = &frame.rgba[4 * (50 * 160 + 80)];
        return std::array<float, 3>{c[0], c[1], c[2]};
    };
    const auto white = color_at(-1 / 7.0 - 1e-9, 3 / 7.0), red = color_at(-1, 1 / 7.0), blue = color_at(1 / 7.0, 1);
    EXPECT_NEAR(white[0], white[1], 1e-3);
    EXPECT_NEAR(white[0], white[2], 1e-3);
    EXPECT_GT(red[0], 3 * red[2]);
    EXPECT_GT(blue[2], 3 * blue[0]);
    EXPECT_EQ(color_at(-1, 0.1), red) << "beyond the end";
}

// ---- pictures that were looked at ----------------------------------------------------------------------------------

class golden_maps : public testing::TestWithParam<SurfaceMap> {};

TEST_P(golden_maps, are_drawn_as_they_were)
{
    RenderOptions options = overview(240, 150);
    options.look.map.map = GetParam();
    expect_golden(draw(all_kinds().finish(), options).frame, fmt::format("map_{}.png", surface_map_name(GetParam())));
}

INSTANTIATE_TEST_SUITE_P(, golden_maps,
                         testing::Values(SurfaceMap::Zebra, SurfaceMap::Isophotes, SurfaceMap::CurvatureMean,
                                         SurfaceMap::CurvatureGaussian, SurfaceMap::Draft),
                         [](const testing::TestParamInfo<SurfaceMap>& info) { return test_name(info.param); });

TEST(surface_map, pictures_without_a_map_have_no_values)
{
    EXPECT_TRUE(draw(one_sphere(7).finish(), seen_from({20, -30, 15}, SurfaceMap::None)).frame.map_value.empty());
}

} // namespace
} // namespace trimray
