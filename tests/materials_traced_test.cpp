// Materials as they are traced: colours, layers of surfaces that let light through, mirrors and what is around the
// model, against closed forms, and alike on both tracers.
#include "runtime/light_view.h"
#include "tests/compare_frames.h"
#include "tests/keep_vulkan_loaded.h"
#include "tests/traced_scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

namespace trimray {
namespace {

constexpr double kPi = std::numbers::pi;

Material of(std::optional<float> opacity, std::optional<float> mirror = {}, std::optional<float> specular = {})
{
    Material material;
    material.opacity = opacity;
    material.mirror = mirror;
    material.specular = specular;
    return material;
}
Material red()
{
    Material material = of(1.0f);
    material.color = {1, 0, 0};
    return material;
}

MaterialRule of_all(const Material& material)
{
    return {.part = {}, .faces = {}, .pack_color = {}, .material = material};
}
MaterialRule of_face(uint32_t face, const Material& material)
{
    return {.part = {}, .faces = {face}, .pack_color = {}, .material = material};
}

RenderOptions straight_down(uint32_t width, uint32_t height)
{
    RenderOptions options;
    options.width = width;
    options.height = height;
    options.camera = {{0, 0, 100}, {0, 0, 0}, {0, 1, 0}, 5};
    return options;
}

/// Square plates of 12 mm side across z, at these heights.
TracedScene plates(std::initializer_list<double> heights_mm)
{
    TracedScene scene;
    for (const double z : heights_mm)
        scene.add(kKindPlane, 1, {0, 0, z / 10}, {0.6, 0.6});
    return scene;
}

/// Left half red light, right half blue, the upper third twice as strong.
std::shared_ptr<const Environment> two_colors()
{
    Environment environment;
    environment.width = 64;
    environment.height = 32;
    for (uint32_t y = 0; y < environment.height; ++y)
        for (uint32_t x = 0; x < environment.width; ++x) {
            const float strength = y < 10 ? 2.0f : 1.0f;
            const bool left = x < 32;
            environment.rgb.insert(environment.rgb.end(), {left ? strength : 0.0f, 0.25f, left ? 0.0f : strength});
        }
    return std::make_shared<const Environment>(std::move(environment));
}

TEST(materials_traced, layers_let_through_what_their_opacities_leave)
{
    TracedScene scene = plates({-3, -1, 0, 2});
    RenderOptions options = straight_down(32, 32);
    options.look.xray = 0.3f;
    const Frame frame = draw(scene.finish(), options).frame;
    const size_t middle = 4 * (16 * 32 + 16);
    EXPECT_NEAR(frame.rgba[middle + 3], 1 - std::pow(0.7, 4), 1e-6);
    // straight colours: shares of 0.3, 0.21, 0.147, 0.1029, nearest first, all lit alike from the eye
    RenderOptions one = straight_down(32, 32);
    std::array<double, 3> sum{};
    double share = 0.3;
    for (const double z : {2.0, 0.0, -1.0, -3.0}) {
        TracedScene alone = plates({-3, -1, 0, 2});
        size_t face = z == -3 ? 0 : z == -1 ? 1 : z == 0 ? 2 : 3;
        for (size_t f = 0; f < 4; ++f)
            alone.image.faces[f].color_rgba = scene.image.faces[face].color_rgba;
        const Frame opaque = draw(alone.finish(), one).frame;
        for (size_t c = 0; c < 3; ++c)
            sum[c] += share * double(opaque.rgba[middle + c]);
        share *= 0.7;
    }
    for (size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(frame.rgba[middle + c], sum[c] / (1 - std::pow(0.7, 4)), 1e-5);
}

TEST(materials_traced, a_ball_has_two_layers_and_what_hides_it_none)
{
    TracedScene scene;
    scene.add(kKindSphere, 0.5, {0, 0, 0}, {kPi, kPi / 2});
    scene.add(kKindPlane, 1, {0, 0, -1}, {2, 2});
    RenderOptions options = straight_down(64, 64);
    options.camera.fov_deg = 10;
    options.look.materials = {of_face(0, of(0.5f))};
    const Frame frame = draw(scene.finish(), options).frame;
    int ball = 0;
    for (size_t i = 0; i < frame.face.size(); ++i) {
        EXPECT_EQ(frame.rgba[4 * i + 3], 1.0f); // the plate is behind all
        ball += frame.face[i] == 0;
    }
    EXPECT_GT(ball, 800);
    options.look.materials = {of_all(of(0.5f))};
    const Frame both = draw(scene.finish(), options).frame;
    for (size_t i = 0; i < both.face.size(); ++i)
        EXPECT_NEAR(both.rgba[4 * i + 3], both.face[i] == 0 ? 0.875 : 0.5, 1e-6) << i;
}

TEST(materials_traced, depths_and_faces_are_the_first_layers)
{
    const auto scene = all_kinds().finish();
    RenderOptions options = overview(160, 100);
    const Frame opaque = draw(scene, options).frame;
    options.look.xray = 0.4f;
    const Frame seen_through = draw(scene, options).frame;
    EXPECT_TRUE(same_bits(opaque.depth_mm, seen_through.depth_mm));
    EXPECT_TRUE(same_bits(opaque.face, seen_through.face));
    EXPECT_TRUE(same_bits(opaque.normal, seen_through.normal));
    EXPECT_FALSE(same_bits(opaque.rgba, seen_through.rgba));
}

TEST(materials_traced, what_lets_light_through_throws_no_shadow)
{
    TracedScene scene = plates({-2, 3});
    RenderOptions options = straight_down(32, 32);
    Light light;
    light.direction = {0.2, 0.1, -1};
    light.shadows = true;
    options.look.lights = {light};
    const size_t middle = 4 * (16 * 32 + 16);
    options.look.materials = {of_face(1, of(0.0f))};
    const Frame clear = draw(scene.finish(), options).frame;
    TracedScene alone = plates({-2, 3});
    alone.image.faces.pop_back();
    alone.image.patches.pop_back();
    options.look.materials.clear();
    const Frame without = draw(alone.finish(), options).frame;
    for (size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(clear.rgba[middle + c], without.rgba[middle + c], 1e-6);
    EXPECT_GT(without.rgba[middle], 0.05f);
}

TEST(materials_traced, an_environment_is_seen_where_nothing_is)
{
    TracedScene scene = plates({0});
    RenderOptions options = straight_down(40, 40);
    options.camera = {
        {0, -60, 0.01}, {0, 0, 0.01}, {0, 0, 1}, 40}; // towards +y: a quarter turn left of the row's middle
    options.look.environment = two_colors();
    const Frame frame = draw(scene.finish(), options).frame;
    int misses = 0;
    for (size_t i = 0; i < frame.face.size(); ++i) {
        EXPECT_EQ(frame.rgba[4 * i + 3], 1.0f);
        if (frame.face[i] >= 0)
            continue;
        ++misses;
        EXPECT_NEAR(frame.rgba[4 * i], 1, 1e-6); // the left half: red
        EXPECT_NEAR(frame.rgba[4 * i + 2], 0, 1e-6);
    }
    EXPECT_GT(misses, 100);
    options.camera.target = {60, -60, 0.01}; // towards +x, where the halves meet
    const Frame seam = draw(scene.finish(), options).frame;
    const size_t row = size_t{20} * 40;
    EXPECT_NEAR(seam.rgba[4 * (row + 2)], 1, 1e-6);
    EXPECT_NEAR(seam.rgba[4 * (row + 37) + 2], 1, 1e-6);
}

TEST(materials_traced, a_mirror_shows_what_is_beside_it)
{
    // a mirror in the plane z = 0 seen from above at 45 degrees; a wall of another face stands behind it
    TracedScene scene;
    scene.add(kKindPlane, 1, {0, 0, 0}, {1, 1});
    PatchRecord& wall = scene.add(kKindPlane, 1, {0, 1, 1}, {1, 1});
    wall.axis_y[1] = 0;
    wall.axis_y[2] = 1;
    wall.axis_z[2] = 0;
    wall.axis_z[1] = -1;
    const auto built = scene.finish();
    RenderOptions options;
    options.width = options.height = 60;
    options.camera = {{0, -40, 40}, {0, 2, 0}, {0, 0, 1}, 20};
    options.look.materials = {of_face(0, of({}, 1.0f, 0.0f))};
    const Frame frame = draw(built, options).frame;
    // the same wall through the mirror's plane: the scene and the eye below it
    RenderOptions turned = options;
    turned.look.materials = {of_face(0, of(0.0f)), of_face(1, of({}, {}, 0.12f))};
    turned.camera.eye[2] = -40;
    turned.camera.up = {0, 0, -1};
    Light at_eye;
    at_eye.kind = LightKind::Eye;
    turned.look.lights = {at_eye};
    const Frame below = draw(built, turned).frame;
    int compared = 0;
    double worst = 0;
    for (size_t y = 0; y < 60; ++y)
        for (size_t x = 0; x < 60; ++x) {
            const size_t i = y * 60 + x, j = y * 60 + (59 - x);
            if (frame.face[i] != 0 || below.face[j] != 0 || below.rgba[4 * j + 3] < 1)
                continue;
            ++compared;
            for (size_t c = 0; c < 3; ++c)
                worst = std::max(worst, std::abs(double(frame.rgba[4 * i + c]) - double(below.rgba[4 * j + c])));
        }
    EXPECT_GT(compared, 300);
    EXPECT_LE(worst, 1e-4);
}

TEST(materials_traced, two_mirrors_face_to_face_dim_by_each_reflection)
{
    // between two mirrors of 0.5 that see but each other, n reflections leave (1 - 0.5) sum 0.5^i + 0.5^n of a colour
    // that is lit alike everywhere
    TracedScene scene = plates({-1, 1});
    for (FaceRecord& face : scene.image.faces)
        face.color_rgba = 0xff808080u;
    const auto built = scene.finish();
    RenderOptions options = straight_down(8, 8);
    options.camera = {{0, 0, 0.5}, {0, 0, -1}, {0, 1, 0}, 2};
    options.look.materials = {of_all(of({}, 0.5f))};
    options.look.sky = 1.0f;
    for (const uint32_t depth : {0u, 1u, 2u, 5u}) {
        options.look.mirror_depth = depth;
        const Frame frame = draw(built, options).frame;
        const size_t middle = 4 * (4 * 8 + 4);
        RenderOptions plain = options;
        plain.look.materials.clear();
        const Frame lower = draw(built, plain).frame;
        plain.camera.target = {0, 0, 2};
        const Frame upper = draw(built, plain).frame;
        double sum = 0, weight = 1;
        for (uint32_t i = 0; i <= depth; ++i) {
            const double color = double((i % 2 == 0 ? lower : upper).rgba[middle]);
            sum += weight * (i == depth ? 1 : 0.5) * color;
            weight *= 0.5;
        }
        EXPECT_NEAR(frame.rgba[middle], sum, 2e-4) << depth;
    }
}

TEST(materials_traced, instruction_sets_and_threads_give_the_same_bits)
{
    const auto scene = all_kinds().finish();
    RenderOptions options = overview(96, 64);
    options.look.materials = {of_all(of(0.5f, 0.3f)), of_face(2, red())};
    options.look.environment = two_colors();
    options.look.mirror_depth = 2;
    const Frame best = draw(scene, options).frame;
    for (const char* instruction_set : {"avx2", "sse4"}) {
        if (!make_cpu_tracer(scene, instruction_set).ok()) // a build may leave some out
            continue;
        EXPECT_TRUE(same_bits(best.rgba, draw(scene, options, instruction_set).frame.rgba)) << instruction_set;
    }
    options.threads = 1;
    EXPECT_TRUE(same_bits(best.rgba, draw(scene, options).frame.rgba));
}

TEST(materials_traced, vulkan_shows_the_same)
{
    keep_vulkan_loaded();
    const auto scene = all_kinds().finish();
    const auto tracer = make_vulkan_tracer(scene, true, true);
    if (!tracer.ok() && tracer.error().code == ErrorCode::NoDevice)
        GTEST_SKIP() << "SKIPPED: " << tracer.error().detail;
    ASSERT_TRUE(tracer.ok()) << tracer.error().where << ": " << tracer.error().detail;
    RenderOptions options = overview(96, 64);
    options.look.materials = {of_all(of(0.5f, 0.3f)), of_face(2, red())};
    options.look.environment = two_colors();
    options.look.mirror_depth = 2;
    Light sun;
    sun.shadows = true;
    sun.direction = {1, 2, -3};
    options.look.lights = {sun};
    options.look.section.planes = {{.point_mm = {0, 0, 5}, .normal = {0.1, -0.2, 1}}};
    const Frame cpu = draw(scene, options).frame;
    RenderStats stats;
    const Result<Frame> vulkan = (*tracer)->render(options, stats);
    ASSERT_TRUE(vulkan.ok()) << vulkan.error().where << ": " << vulkan.error().detail;
    const Disagreement d = compare(cpu, *vulkan, options);
    EXPECT_EQ(d.strangers, 0);
    EXPECT_LE(d.borders, 6);
    // a ray beside a border may see another layer or reflection: few pixels
    int apart = 0;
    for (size_t i = 0; i < cpu.face.size(); ++i)
        for (size_t c = 0; c < 4; ++c)
            if (std::abs(cpu.rgba[4 * i + c] - vulkan->rgba[4 * i + c]) > 1e-3f) {
                ++apart;
                break;
            }
    EXPECT_LE(apart, 12) << "of " << cpu.face.size();
    EXPECT_GT(stats.work.free_rays, 1000u);
}

} // namespace
} // namespace trimray
