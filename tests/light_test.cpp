// Lights, shadows and ambient occlusion against closed forms and integrals in double, on both tracers; and what both
// tracers make of the same scene.
#include "tests/closed_forms.h"
#include "tests/compare_frames.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iostream>
#include <vector>

namespace trimray {
namespace {

using reference::cross;
using reference::dot;
using reference::length;
using reference::operator+;
using reference::operator-;
using reference::operator*;

Vec3 unit(const Vec3& v)
{
    return v * (1 / length(v));
}

/// One colour channel, which is what the tests look at.
float green(const Frame& frame, size_t i)
{
    return frame.rgba[4 * i + 1];
}

class light : public testing::TestWithParam<bool> {
protected:
    bool vulkan() const { return GetParam(); }
    std::optional<Drawn> draw_one(const std::shared_ptr<const Scene>& scene, const RenderOptions& options) const
    {
        return drawn_by(vulkan(), scene, options);
    }
};
INSTANTIATE_TEST_SUITE_P(, light, testing::Bool(), tracer_name);

// ---- shadows -------------------------------------------------------------------------------------------------------

constexpr double kFloor = 20; // mm, half a side of the square z = 0

struct Ball {
    Vec3 middle{0, 0, 6};
    double radius = 3;
};

std::shared_ptr<const Scene> floor_and(const std::optional<Ball>& ball)
{
    TracedScene scene;
    add_rectangle(scene, {0, 0, 0}, {0, 1, kFloor}, {1, 1, kFloor});
    if (ball)
        add_ball(scene, ball->middle, ball->radius);
    return scene.finish();
}

/// Whether the ball is met on the way from p along the unit direction, nearer than `reach`.
bool hides(const Ball& ball, const Vec3& p, const Vec3& along, double reach)
{
    const Vec3 to = ball.middle - p;
    const double s = dot(to, along), square = dot(to, to) - s * s - ball.radius * ball.radius;
    return s > 0 && square < 0 && s - std::sqrt(-square) < reach;
}

RenderOptions lit_by_one(const Light& light)
{
    RenderOptions options;
    options.width = 160;
    options.height = 90;
    options.camera = {{18, -26, 24}, {-2, 1, 0}, {0, 0, 1}, 34};
    options.look.lights = {light};
    options.look.sky = 0.0f;
    return options;
}

/// In units of a pixel. The floor's points are known to 1e-7 of the way to the eye, 1e-4 pixels here; where the light
/// grazes the ball that is some 1e-2 of a pixel at the shadow's rim.
constexpr double kRim_px = 0.02;

void expect_shadow(bool vulkan, Light light)
{
    const Ball ball;
    const auto scene = floor_and(ball);
    light.shadows = false;
    const auto open = drawn_by(vulkan, scene, lit_by_one(light));
    light.shadows = true;
    const RenderOptions options = lit_by_one(light);
    const auto dark = drawn_by(vulkan, scene, options);
    if (!open || !dark)
        return;
    const auto in_shadow = [&](const Vec3& p) {
        const Vec3 to_light = light.kind == LightKind::Point ? light.position_mm - p : light.direction * -1;
        const double reach = light.kind == LightKind::Point ? length(to_light) : 1e30;
        return hides(ball, p, unit(to_light), reach);
    };
    const PixelRays rays(options);
    const auto on_floor = [&](double x, double y) {
        const reference::Ray ray = rays.through(x, y);
        return ray.at(-ray.origin[2] / ray.direction[2]);
    };
    int shadowed = 0, lit = 0, on_rim = 0, wrong = 0, wrong_on_rim = 0;
    for (size_t i = 0; i < dark->frame.face.size(); ++i) {
        if (dark->frame.face[i] != 0)
            continue;
        const double x = double(i % options.width) + 0.5, y = double(i / options.width) + 0.5;
        const bool expected = in_shadow(on_floor(x, y));
        bool rim = false;
        for (int k = 0; k < 8; ++k) {
            const double angle = k * kPi / 4;
            rim |= in_shadow(on_floor(x + kRim_px * std::cos(angle), y + kRim_px * std::sin(angle))) != expected;
        }
        const bool right = green(dark->frame, i) == (expected ? 0.0f : green(open->frame, i));
        on_rim += rim;
        (rim ? wrong_on_rim : wrong) += !right;
        ++(expected ? shadowed : lit);
    }
    std::cout << fmt::format("{} pixels in shadow, {} lit; {} wrong, {} of {} on the rim\n", shadowed, lit, wrong,
                             wrong_on_rim, on_rim);
    EXPECT_GT(shadowed, 250);
    EXPECT_GT(lit, 3000);
    EXPECT_EQ(wrong, 0);
}

TEST_P(light, a_ball_throws_the_shadow_its_outline_bounds)
{
    expect_shadow(vulkan(), {.direction = {0.5, 0.3, -1}});
    expect_shadow(vulkan(), {.direction = {0.9, -0.4, -0.5}});
    expect_shadow(vulkan(), {.kind = LightKind::Point, .position_mm = {4, -3, 20}});
    expect_shadow(vulkan(), {.kind = LightKind::Point, .position_mm = {-5, 2, 7}}); // beside the ball
}

TEST_P(light, what_lies_beyond_a_point_light_throws_no_shadow)
{
    Light lamp{.kind = LightKind::Point, .position_mm = {0, 0, 2}};
    RenderOptions options = lit_by_one(lamp);
    const auto scene = floor_and(Ball{});
    const auto open = draw_one(scene, options);
    options.look.lights[0].shadows = true;
    const auto dark = draw_one(scene, options);
    if (!open || !dark)
        return;
    for (size_t i = 0; i < open->frame.face.size(); ++i) {
        const bool is_floor = open->frame.face[i] == 0;
        ASSERT_TRUE(!is_floor || green(open->frame, i) == green(dark->frame, i)) << i;
    }
}

/// What leaves a point of the floor towards the eye of light from `to_light`, as shaders/shared/light.h says; all unit.
double leaves(const Vec3& to_eye, const Vec3& to_light)
{
    const double color = std::pow((0xe0 / 255.0 + 0.055) / 1.055, 2.4); // the first face's, green
    const double facing = std::max(to_light[2], 0.0), half_way = unit(to_eye + to_light)[2];
    return 0.72 * color * facing + 0.12 * std::pow(half_way, 32);
}

/// Of what a light's disc sends to a point of the floor.
struct Sent {
    double seen, whole;
};

/// What of a light leaves p towards the eye, the mean over its disc.
Sent sent_by(const Light& light, const Ball& ball, const Vec3& p, const Vec3& to_eye)
{
    const bool point = light.kind == LightKind::Point;
    const Vec3 middle = point ? light.position_mm - p : unit(light.direction) * -1;
    const double radius = point ? light.radius_mm : std::tan(light.half_angle_deg * kPi / 180);
    const Vec3 u = unit(cross(middle, std::abs(middle[2]) < 0.9 * length(middle) ? Vec3{0, 0, 1} : Vec3{1, 0, 0}));
    const Vec3 v = unit(cross(middle, u));
    constexpr int kRings = 64, kSpokes = 192;
    Sent sum{};
    for (int ring = 0; ring < kRings; ++ring) // rings of one area
        for (int spoke = 0; spoke < kSpokes; ++spoke) {
            const double r = radius * std::sqrt((ring + 0.5) / kRings), angle = 2 * kPi * (spoke + 0.5) / kSpokes;
            const Vec3 way = middle + u * (r * std::cos(angle)) + v * (r * std::sin(angle));
            const double sent = leaves(to_eye, unit(way)) / (kRings * kSpokes);
            sum.whole += sent;
            sum.seen += hides(ball, p, unit(way), point ? length(way) : 1e30) ? 0 : sent;
        }
    return sum;
}

/// Pixels in the half shadow and beside it, by 4096 samples (1024 on Vulkan's software driver), as shares of all that
/// the light would send.
void expect_soft(bool vulkan, const Light& light)
{
    const Ball ball;
    RenderOptions options = lit_by_one(light);
    options.width = 32;
    options.height = 18;
    options.camera.target = {2, 2, 0};
    options.camera.fov_deg = 13;
    options.look.light_samples = vulkan ? 1024 : 4096;
    const auto drawn = drawn_by(vulkan, floor_and(ball), options);
    if (!drawn)
        return;
    const PixelRays rays(options);
    double sum = 0, worst = 0;
    int half_lit = 0, pixels = 0;
    for (size_t i = 0; i < drawn->frame.face.size(); ++i) {
        if (drawn->frame.face[i] != 0)
            continue;
        const Sent sent = sent_by(light, ball, rays.hit(drawn->frame, i), rays.of_pixel(i).direction * -1);
        const double off = std::abs(double(green(drawn->frame, i)) - sent.seen) / sent.whole;
        half_lit += sent.seen > 0.05 * sent.whole && sent.seen < 0.95 * sent.whole;
        ++pixels;
        sum += off;
        worst = std::max(worst, off);
    }
    std::cout << fmt::format("{} pixels, {} half lit: off by {:.2g} in the mean, {:.2g} at most\n", pixels, half_lit,
                             sum / pixels, worst);
    EXPECT_GT(half_lit, pixels / 5);
    EXPECT_LE(sum / pixels, 1e-3);
    EXPECT_LE(worst, 1e-2);
}

TEST_P(light, half_shadows_are_the_share_of_the_disc_that_is_seen)
{
    expect_soft(vulkan(), {.direction = {0.35, 0.3, -1}, .half_angle_deg = 20, .shadows = true});
    expect_soft(vulkan(), {.kind = LightKind::Point, .position_mm = {-5, -4, 22}, .radius_mm = 4, .shadows = true});
}

// ---- ambient occlusion ---------------------------------------------------------------------------------------------

/// Lit by the sky alone.
RenderOptions under_sky(uint32_t samples)
{
    RenderOptions options;
    options.width = 48;
    options.height = 27;
    options.look.lights = {{.color = {0, 0, 0}}};
    options.look.sky = 1.0f;
    options.look.occlusion.samples = samples;
    return options;
}

/// The share of the sky that each pixel sees.
std::vector<double> open_shares(bool vulkan, const std::shared_ptr<const Scene>& scene, RenderOptions options,
                                Frame& frame)
{
    const auto hidden = drawn_by(vulkan, scene, options);
    options.look.occlusion.samples = 0;
    const auto open = drawn_by(vulkan, scene, options);
    std::vector<double> shares;
    if (!hidden || !open)
        return shares;
    frame = open->frame;
    for (size_t i = 0; i < frame.face.size(); ++i)
        shares.push_back(frame.face[i] < 0 ? 1 : double(green(hidden->frame, i)) / double(green(open->frame, i)));
    return shares;
}

/// expected(p): the share that is hidden, at points of face 0; nothing where it is not known.
void expect_hidden(bool vulkan, const std::shared_ptr<const Scene>& scene, const RenderOptions& options,
                   const std::function<std::optional<double>(const Vec3&)>& expected, int at_least)
{
    Frame frame;
    const std::vector<double> open = open_shares(vulkan, scene, options, frame);
    if (open.empty())
        return;
    const PixelRays rays(options);
    double worst = 0, sum = 0, most_hidden = 0;
    int pixels = 0;
    for (size_t i = 0; i < open.size(); ++i) {
        if (frame.face[i] != 0)
            continue;
        const auto hidden = expected(rays.hit(frame, i));
        if (!hidden)
            continue;
        const double off = std::abs(1 - open[i] - *hidden);
        worst = std::max(worst, off);
        sum += off;
        most_hidden = std::max(most_hidden, *hidden);
        ++pixels;
    }
    std::cout << fmt::format("{} points, up to {:.3f} hidden: off by {:.2g} in the mean, {:.2g} at most\n", pixels,
                             most_hidden, sum / pixels, worst);
    EXPECT_GE(pixels, at_least);
    EXPECT_LE(worst, 0.01);
}

uint32_t many(bool vulkan)
{
    return vulkan ? 512 : 1024;
}

TEST_P(light, a_ball_hides_of_the_sky_what_its_form_factor_says)
{
    const Ball ball{{0, 0, 5}, 3};
    const auto scene = floor_and(ball);
    RenderOptions options = under_sky(many(vulkan()));
    options.camera = {{0, -40, 9}, {0, 0, 1}, {0, 0, 1}, 14};
    // wholly above the horizon: (r / d)^2 cos(theta)
    const auto hidden = [&](const Vec3& p) {
        const double d = length(ball.middle - p);
        return std::pow(ball.radius / d, 2) * ball.middle[2] / d;
    };
    expect_hidden(vulkan(), scene, options, hidden, 200);
    // the same where all of it that is seen lies within reach, nothing where none does
    options.look.occlusion.reach_mm = 7;
    int none = 0;
    expect_hidden(
        vulkan(), scene, options,
        [&](const Vec3& p) -> std::optional<double> {
            const double d = length(ball.middle - p);
            if (std::sqrt(d * d - ball.radius * ball.radius) < 7)
                return hidden(p);
            if (d - ball.radius <= 7.001)
                return {};
            ++none;
            return 0;
        },
        200);
    EXPECT_GT(none, 20);
}

/// The share of the sky that a wall hides from a floor: the wall stands on the floor's border, `away` from the point,
/// from there `along` to one side. Source: Howell, Thermal Radiation Configuration Factors, differential element to a
/// rectangle in a plane at right angles, the element opposite of a corner.
double hidden_by_wall(double away, double height, double along)
{
    const double x = height / along, y = away / along, far = std::hypot(x, y);
    return (std::atan(1 / y) - y / far * std::atan(1 / far)) / (2 * kPi);
}

TEST_P(light, a_wall_hides_of_the_sky_what_its_form_factor_says)
{
    constexpr double kHeight = 16, kLong = 18; // mm, half as long on either side
    TracedScene corner;
    add_rectangle(corner, {10, 0, 0}, {0, 1, 10}, {1, 1, kLong});
    add_rectangle(corner, {0, 0, kHeight / 2}, {1, 1, kLong}, {2, 1, kHeight / 2});
    const auto scene = corner.finish();
    RenderOptions options = under_sky(many(vulkan()));
    options.camera = {{30, -8, 24}, {5, 0, 0}, {0, 0, 1}, 20};
    expect_hidden(
        vulkan(), scene, options,
        [&](const Vec3& p) {
            return hidden_by_wall(p[0], kHeight, kLong - p[1]) + hidden_by_wall(p[0], kHeight, kLong + p[1]);
        },
        200);
    // within reach the wall has no end, and hides what rises towards it by more than c = away / reach: the part u > c
    // of the unit disc that directions project to
    constexpr double kReach = 6;
    options.look.occlusion.reach_mm = kReach;
    expect_hidden(
        vulkan(), scene, options,
        [&](const Vec3& p) -> std::optional<double> {
            if (std::abs(p[1]) > kLong - kReach)
                return {};
            const double c = std::min(p[0] / kReach, 1.0);
            return (std::acos(c) - c * std::sqrt(1 - c * c)) / kPi;
        },
        200);
}

// ---- rays that begin at surfaces -----------------------------------------------------------------------------------

struct Convex {
    const char* name;
    std::shared_ptr<const Scene> scene;
    double least_rho = 0; // mm from z: what is farther from there hides nothing of itself
};
std::vector<Convex> convex_bodies()
{
    TracedScene ball, ring, box, dome;
    add_ball(ball, {0, 0, 0}, 9);
    add_ring(ring, {0, 0, 0}, 7, 2.5);
    add_box(box, {0, 0, 0}, {8, 6, 5});
    // z = 0.4 (2 - x^2 - y^2) over [-1, 1]^2: control points of x^2 are 1, -1, 1
    dome.add_bezier(2, 2, false, 0.9, {0, 0, -0.3});
    for (const float x : {-1.0f, 0.0f, 1.0f})
        for (const float y : {-1.0f, 0.0f, 1.0f}) {
            const auto square = [](float c) { return c == 0 ? -1.0f : 1.0f; };
            dome.image.control_points.insert(dome.image.control_points.end(),
                                             {x, y, 0.4f * (2 - square(x) - square(y))});
        }
    return {{"ball", ball.finish()}, {"ring", ring.finish(), 7}, {"box", box.finish()}, {"dome", dome.finish()}};
}

TEST_P(light, nothing_hides_what_bulges_out)
{
    for (const Convex& body : convex_bodies()) {
        const bool is_ball_or_dome = body.scene->pack.image.faces.size() == 1 && body.least_rho == 0;
        if (vulkan() && !is_ball_or_dome)
            continue; // the software driver takes seconds for the shaders of each kind
        for (const Vec3& eye : {Vec3{18, -26, 19}, Vec3{2, -3, 40}, Vec3{-34, 9, 3}}) {
            if (vulkan() && eye[0] != 18)
                continue; // and a second a picture
            RenderOptions options;
            options.width = vulkan() ? 64 : 160;
            options.height = vulkan() ? 36 : 90;
            options.camera = {eye, {0, 0, 0}, {0, 0, 1}, 40};
            options.look.sky = 1.0f;
            options.look.lights = {{.direction = {1, 2, -1}},
                                   {.direction = {-1, 0.2, -0.3}},
                                   {.kind = LightKind::Point, .position_mm = {20, -15, 12}}};
            const auto open = draw_one(body.scene, options);
            for (Light& light : options.look.lights)
                light.shadows = true;
            options.look.occlusion.samples = vulkan() ? 16 : 64; // a power of two, so that all of them make exactly 1
            const auto hidden = draw_one(body.scene, options);
            if (!open || !hidden)
                return;
            const PixelRays rays(options);
            int compared = 0, wrong = 0;
            for (size_t i = 0; i < open->frame.face.size(); ++i) {
                if (open->frame.face[i] < 0)
                    continue;
                const Vec3 p = rays.hit(open->frame, i);
                const float* n = &open->frame.normal[3 * i];
                const bool outside = dot({double(n[0]), double(n[1]), double(n[2])}, rays.of_pixel(i).direction) < 0;
                if (!outside || (body.least_rho > 0 && std::hypot(p[0], p[1]) < body.least_rho + 1e-3))
                    continue;
                ++compared;
                wrong += std::abs(green(open->frame, i) - green(hidden->frame, i)) > 1e-6f;
            }
            EXPECT_GT(compared, vulkan() ? 100 : 400) << body.name;
            EXPECT_EQ(wrong, 0) << body.name << " from " << eye[0] << ", " << eye[1] << ", " << eye[2];
        }
    }
}

// ---- both tracers, all instruction sets, any number of threads -----------------------------------------------------

/// All kinds of faces over a floor, and a box.
std::shared_ptr<const Scene> busy_scene()
{
    TracedScene scene = all_kinds();
    add_rectangle(scene, {0, 0, -9}, {0, 1, 20}, {1, 1, 20});
    add_box(scene, {-12, 8, -5}, {3, 4, 4});
    return scene.finish();
}

struct Asked {
    const char* name;
    SceneLook look;
};
std::vector<Asked> looks()
{
    SceneLook hard;
    hard.lights = {
        {.direction = {1, 2, -3}, .shadows = true},
        {.kind = LightKind::Point, .position_mm = {10, -10, 15}, .color = {0.6f, 0.5f, 0.2f}, .shadows = true}};
    SceneLook soft = hard;
    soft.lights[0].half_angle_deg = 4;
    soft.lights[1].radius_mm = 2;
    SceneLook hidden;
    hidden.occlusion.samples = 16;
    SceneLook cut = hard;
    cut.lights.pop_back();
    cut.section.planes = {{{-11, 8, -3}, {0.1, -0.2, 1}}, {{8, 0, 0}, {1, 0, 0.2}}};
    cut.section.caps = CapStyle::Hatched;
    SceneLook all = soft;
    all.occlusion = {4, 12};
    all.section = cut.section;
    return {{"hard shadows", hard}, {"soft shadows", soft}, {"occlusion", hidden}, {"sections", cut}, {"all", all}};
}

TEST(light_of_tracers, every_instruction_set_and_number_of_threads_draws_the_same_bits)
{
    const auto scene = busy_scene();
    for (const auto& [name, look] : looks()) {
        RenderOptions options = overview(160, 90);
        options.look = look;
        options.threads = 4;
        const Frame first = draw(scene, options).frame;
        options.threads = 1;
        for (const char* set : {"avx512", "avx2", "sse4"}) {
            if (!make_cpu_tracer(scene, set).ok())
                continue;
            const Frame frame = draw(scene, options, set).frame;
            EXPECT_TRUE(same_bits(first.rgba, frame.rgba)) << name << ", " << set;
            EXPECT_TRUE(same_bits(first.face, frame.face)) << name << ", " << set;
            EXPECT_TRUE(same_bits(first.depth_mm, frame.depth_mm)) << name << ", " << set;
            EXPECT_TRUE(same_bits(first.certified, frame.certified)) << name << ", " << set;
        }
    }
}

TEST(light_of_tracers, both_tracers_agree)
{
    const auto scene = busy_scene();
    for (const auto& [name, look] : looks()) {
        RenderOptions options = overview(160, 90);
        options.look = look;
        const auto vulkan = drawn_by(true, scene, options);
        if (!vulkan)
            return;
        const Frame cpu = draw(scene, options).frame;
        const Frame& other = vulkan->frame;
        const Disagreement d = compare(cpu, other, options);
        double sum = 0, worst = 0;
        int off = 0, hits = 0;
        for (size_t i = 0; i < cpu.face.size(); ++i) {
            if (cpu.face[i] != other.face[i] || cpu.face[i] == -1)
                continue;
            double most = 0;
            for (size_t c = 0; c < 3; ++c)
                most = std::max(most, std::abs(double(cpu.rgba[4 * i + c]) - double(other.rgba[4 * i + c])));
            ++hits;
            sum += most;
            worst = std::max(worst, most);
            off += most > 1e-3;
        }
        std::cout << fmt::format(
            "{}: {} pixels, {} at borders and {} elsewhere have another face; {} differ by more than "
            "1e-3, {:.2g} at most, {:.2g} in the mean\n",
            name, hits, d.borders, d.strangers, off, worst, sum / hits);
        EXPECT_GT(hits, 5000) << name;
        EXPECT_EQ(d.strangers, 0) << name;
        EXPECT_LE(d.borders, hits / 1000) << name;
        EXPECT_LE(d.depth, 1e-6) << name;
        EXPECT_LE(d.certified, hits / 1000) << name;
        EXPECT_LE(off, hits / 1000) << name;
        EXPECT_LE(sum / hits, 1e-4) << name;
    }
}

} // namespace
} // namespace trimray
