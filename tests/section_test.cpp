// Section planes and their caps against closed forms, on both tracers; and what both tracers make of the same scene.
#include "shaders/section_layout.h"
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

bool is_cap(const Frame& frame, size_t i)
{
    return frame.face[i] <= -2;
}
size_t cap_count(const Frame& frame)
{
    size_t count = 0;
    for (size_t i = 0; i < frame.face.size(); ++i)
        count += is_cap(frame, i);
    return count;
}

/// A plane in the middle of a square picture, at right angles to the view and `height_mm` of it seen, turned so that
/// few lines of a model lie along its rows. Through a pinhole too each pixel sees as much of the plane as any other.
RenderOptions straight_at(const SectionPlane& plane, double height_mm, uint32_t pixels, bool parallel)
{
    constexpr double kAway_mm = 50;
    RenderOptions options;
    options.width = options.height = pixels;
    options.camera.eye = plane.point_mm + unit(plane.normal) * kAway_mm;
    options.camera.target = plane.point_mm;
    options.camera.up = {0.31, 0.83, 0.46};
    options.camera.fov_deg = 2 * std::atan(0.5 * height_mm / kAway_mm) * 180 / kPi;
    if (parallel)
        options.camera.orthographic_mm = height_mm;
    options.shade = false;
    options.look.section.planes = {plane};
    return options;
}

/// Where pixel i sees the only plane.
Vec3 in_plane(const RenderOptions& options, const PixelRays& rays, size_t i)
{
    const SectionPlane& plane = options.look.section.planes[0];
    const reference::Ray ray = rays.of_pixel(i);
    return ray.at(dot(plane.point_mm - ray.origin, plane.normal) / dot(ray.direction, plane.normal));
}

/// So much more than asked is cut away, 5e-6 of the scene's 30 mm; what rounding adds.
constexpr double kMoreCut_mm = 1.5e-4, kPlace_mm = kMoreCut_mm + 1.5e-4;

/// Every hit lies in what is left, and every cap in its plane, with the plane's normal, certified.
void expect_cut(const Frame& frame, const RenderOptions& options)
{
    const PixelRays rays(options);
    const std::vector<SectionPlane>& planes = options.look.section.planes;
    size_t beyond = 0, off_plane = 0, turned = 0, uncertified = 0, nameless = 0;
    for (size_t i = 0; i < frame.face.size(); ++i) {
        if (frame.face[i] == -1)
            continue;
        const Vec3 p = rays.hit(frame, i);
        for (const SectionPlane& plane : planes)
            beyond += dot(unit(plane.normal), p - plane.point_mm) > kPlace_mm;
        if (!is_cap(frame, i))
            continue;
        ASSERT_LT(size_t(-2 - frame.face[i]), planes.size());
        const SectionPlane& plane = planes[size_t(-2 - frame.face[i])];
        off_plane += std::abs(dot(unit(plane.normal), p - plane.point_mm)) > kPlace_mm;
        const Vec3 normal{double(frame.normal[3 * i]), double(frame.normal[3 * i + 1]),
                          double(frame.normal[3 * i + 2])};
        turned += length(normal - unit(plane.normal)) > 1e-6;
        uncertified += frame.certified[i] != 1;
        nameless += frame.instance[i] < 0;
    }
    EXPECT_EQ(beyond, 0u) << "hits in what is cut away";
    EXPECT_EQ(off_plane, 0u) << "caps off their plane";
    EXPECT_EQ(turned, 0u) << "caps without their plane's normal";
    EXPECT_EQ(uncertified, 0u) << "caps that are not certain";
    EXPECT_EQ(nameless, 0u) << "caps of no instance";
}

class section : public testing::TestWithParam<bool> {
protected:
    bool vulkan() const { return GetParam(); }

    std::optional<Frame> cut(const std::shared_ptr<const Scene>& scene, const RenderOptions& options) const
    {
        auto drawn = drawn_by(vulkan(), scene, options);
        if (!drawn)
            return {};
        expect_cut(drawn->frame, options);
        return std::move(drawn->frame);
    }

    /// The cap's area by counting pixels. The border of n of them passes some 8 sqrt(n), each of which is counted by
    /// chance, off by 0.29 of a pixel (a uniform deviate's standard deviation); four times the sum's is allowed.
    void expect_area(const std::shared_ptr<const Scene>& scene, const SectionPlane& plane, double expected_mm2,
                     const char* name) const
    {
        constexpr double kSeen_mm = 24;
#ifdef __SANITIZE_ADDRESS__
        constexpr uint32_t kOnCpu = 400;
#else
        constexpr uint32_t kOnCpu = 1600;
#endif
        const uint32_t side = vulkan() ? 128 : kOnCpu;
        for (const bool parallel : {false, true}) {
            if (parallel && vulkan())
                continue; // the software driver is slow
            const auto frame = cut(scene, straight_at(plane, kSeen_mm, side, parallel));
            if (!frame)
                return;
            const double pixels = double(cap_count(*frame)), pixel_mm2 = std::pow(kSeen_mm / side, 2);
            const double off = std::abs(pixels * pixel_mm2 / expected_mm2 - 1);
            const double chance = 4 * 0.29 * std::sqrt(8 * std::sqrt(pixels)) / pixels;
            std::cout << fmt::format("{}: {:.6g} of {:.6g} mm2, off by {:.2g}, {:.2g} by chance\n", name,
                                     pixels * pixel_mm2, expected_mm2, off, chance);
            EXPECT_LE(off, chance) << name;
        }
    }
};
INSTANTIATE_TEST_SUITE_P(, section, testing::Bool(), tracer_name);

std::shared_ptr<const Scene> made(const std::function<void(TracedScene&)>& make)
{
    TracedScene scene;
    make(scene);
    return scene.finish();
}

TEST_P(section, caps_are_as_large_as_closed_forms_say)
{
    const auto ball = made([](TracedScene& s) { add_ball(s, {1, 2, -1}, 9); });
    const Vec3 slant = unit({0.3, -0.5, 0.8});
    const auto square = [](double x) { return x * x; };
    expect_area(ball, {Vec3{1, 2, -1} + slant * 4, slant}, kPi * (81 - square(4 - kMoreCut_mm)), "ball");
    const auto ring = made([](TracedScene& s) { add_ring(s, {0, 0, 0}, 7, 2.5); });
    expect_area(ring, {{0, 0, 0}, {0.6, 0.8, 0}}, 2 * kPi * 2.5 * 2.5, "ring, along its axis");
    expect_area(ring, {{0, 0, 1.5}, {0, 0, 1}}, 4 * kPi * 7 * std::sqrt(6.25 - square(1.5 - kMoreCut_mm)),
                "ring, across");
    const auto box = made([](TracedScene& s) { add_box(s, {0.5, 0, 0}, {6, 6, 6}); });
    expect_area(box, {{0.5, 0, 0}, {1, 1, 1}}, 0.75 * std::sqrt(3.0) * 144, "cube, across its diagonal");
    expect_area(box, {{0.5, 0, 2}, {0, 0, 1}}, 144, "cube, across");
}

TEST_P(section, what_is_hollow_has_no_cap_and_what_lies_within_has_its_own)
{
    const SectionPlane plane{{0, 0, 0}, {0.3, -0.5, 0.8}};
    const auto nested = made([](TracedScene& s) {
        add_ball(s, {0, 0, 0}, 10);
        add_ball(s, {0, 0, 0}, 8);
        s.image.faces[1].flags |= kFaceReversed; // a hollow
        add_ball(s, {0, 0, 0}, 5);
    });
    expect_area(nested, plane, kPi * (100 - 64 + 25), "shell and kernel");
    const auto within = made([](TracedScene& s) {
        add_ball(s, {0, 0, 0}, 10);
        add_ball(s, {1, 1, 0}, 5);
    });
    expect_area(within, plane, kPi * 100, "ball within a ball");
}

TEST_P(section, solids_that_touch_or_overlap_have_one_cap_without_a_gap)
{
    struct Second {
        double gap, half_y, half_z;
        bool certain;
    };
    // side by side; into each other; so that they share parts of four sides too, which are each met once: then one
    // direction may say what another denies
    for (const Second& second : {Second{0, 5, 5, true}, Second{-1.5, 4, 4.5, true}, Second{-1.5, 5, 5, false}}) {
        if (vulkan() && !second.certain)
            continue;
        const double middle = 4 + second.gap;
        const auto boxes = made([&](TracedScene& s) {
            add_box(s, {-4, 0, 0}, {4, 5, 5});
            add_box(s, {middle, 0, 0}, {4, second.half_y, second.half_z});
        });
        const RenderOptions options = straight_at({{0, 0, 1}, {0, 0, 1}}, 20, vulkan() ? 96 : 320, !vulkan());
        const auto drawn = drawn_by(vulkan(), boxes, options);
        if (!drawn)
            return;
        const Frame& frame = drawn->frame;
        if (second.certain)
            expect_cut(frame, options);
        const PixelRays rays(options);
        int inside = 0, holes = 0, outside = 0;
        for (size_t i = 0; i < frame.face.size(); ++i) {
            const Vec3 p = in_plane(options, rays, i);
            const auto in = [&](double more) {
                return (std::abs(p[0] + 4) < 4 + more && std::abs(p[1]) < 5 + more) ||
                       (std::abs(p[0] - middle) < 4 + more && std::abs(p[1]) < second.half_y + more);
            };
            inside += in(0);
            holes += in(-kPlace_mm) && !is_cap(frame, i);
            outside += !in(kPlace_mm) && is_cap(frame, i);
        }
        EXPECT_GT(inside, vulkan() ? 2000 : 20000);
        EXPECT_EQ(holes, 0) << second.gap;
        EXPECT_EQ(outside, 0) << second.gap;
    }
}

TEST_P(section, mirrored_copies_have_caps_too)
{
    TracedScene pair;
    add_ball(pair, {6, 1, 0}, 4);
    add_box(pair, {6, -6, 0}, {3, 2, 4});
    pair.place({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    pair.place({-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    const auto scene = pair.finish();
    const SectionPlane plane{{0, 0, 1}, {0, 0, 1}};
    expect_area(scene, plane, 2 * (kPi * 15 + 24), "a ball and a box, twice");
    const RenderOptions options = straight_at(plane, 24, 96, !vulkan());
    const auto frame = cut(scene, options);
    if (!frame)
        return;
    const PixelRays rays(options);
    for (size_t i = 0; i < frame->face.size(); ++i) {
        ASSERT_TRUE(!is_cap(*frame, i) || frame->instance[i] == (in_plane(options, rays, i)[0] < 0)) << i;
    }
}

/// A ray keeps so many crossings only; what depends on the others is not certain.
TEST_P(section, more_crossings_than_are_kept_leave_nothing_certain)
{
    const SectionPlane plane{{0, 0, 0}, {0, 0, 1}};
    for (const size_t boxes : {size_t(kMostCrossings / 2 - 2), size_t(kMostCrossings)}) {
        const auto stack = made([&](TracedScene& s) {
            for (size_t i = 0; i < boxes; ++i)
                add_box(s, {0, 0, -1 - 0.25 * double(i)}, {8, 8, 0.08});
        });
        const RenderOptions options = straight_at(plane, 8, vulkan() ? 24 : 64, true);
        const auto drawn = drawn_by(vulkan(), stack, options);
        if (!drawn)
            return;
        const Frame& frame = drawn->frame;
        const size_t pixels = frame.face.size();
        EXPECT_EQ(size_t(std::count(frame.face.begin(), frame.face.end(), -1)), 0u);
        const size_t certain = size_t(std::count(frame.certified.begin(), frame.certified.end(), 1));
        if (2 * boxes <= kMostCrossings) {
            EXPECT_EQ(cap_count(frame), 0u);
            EXPECT_EQ(certain, pixels);
        } else
            EXPECT_EQ(certain, 0u);
    }
}

/// What is left of a box between planes along the axes is a box.
TEST_P(section, several_planes_leave_what_none_cuts_away)
{
    const auto scene = made([](TracedScene& s) { add_box(s, {0, 0, 0}, {8, 6, 5}); });
    RenderOptions options = overview(vulkan() ? 96 : 320, vulkan() ? 60 : 200);
    options.look.section.planes = {{{2, 0, 0}, {3, 0, 0}}, {{0, -1, 0}, {0, -1, 0}}, {{0, 0, 3}, {0, 0, 0.1}}};
    const auto frame = cut(scene, options);
    if (!frame)
        return;
    const Vec3 lo{-8, -1, -5}, hi{2, 6, 3};
    const PixelRays rays(options);
    // the plane of the side that the ray through (x, y) enters by, or none
    const auto expected = [&](double x, double y) {
        const reference::Ray ray = rays.through(x, y);
        double near = 0, far = 1e30;
        int side = -1;
        for (size_t k = 0; k < 3; ++k) {
            double a = (lo[k] - ray.origin[k]) / ray.direction[k], b = (hi[k] - ray.origin[k]) / ray.direction[k];
            if (a > b)
                std::swap(a, b);
            if (a > near)
                side = int(k), near = a;
            far = std::min(far, b);
        }
        return near < far ? -2 - side : -1;
    };
    std::array<int, 3> seen{};
    int wrong = 0, misses = 0;
    for (size_t i = 0; i < frame->face.size(); ++i) {
        const double x = double(i % options.width) + 0.5, y = double(i / options.width) + 0.5;
        const int face = expected(x, y);
        bool rim = false;
        for (const double dx : {-0.02, 0.02})
            for (const double dy : {-0.02, 0.02})
                rim |= expected(x + dx, y + dy) != face;
        if (rim)
            continue;
        wrong += frame->face[i] != face;
        if (face == -1)
            ++misses;
        else
            ++seen[size_t(-2 - face)];
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_GT(misses, vulkan() ? 1000 : 10000);
    for (const int count : seen)
        EXPECT_GT(count, vulkan() ? 100 : 1000);
}

TEST_P(section, a_plane_in_a_face_puts_its_cap_there_or_leaves_nothing)
{
    const auto scene = made([](TracedScene& s) { add_box(s, {1, 0, 0}, {7, 6, 5}); });
    for (const Vec3& eye : {Vec3{38, -26, 19}, Vec3{30, 4, 2}}) {
        RenderOptions options = overview(vulkan() ? 96 : 320, vulkan() ? 60 : 200);
        options.camera.eye = eye;
        options.camera.target = {8, 0, 0};
        RenderOptions whole = options;
        options.look.section.planes = {{{8, 0, 0}, {1, 0, 0}}};
        const auto uncut = drawn_by(vulkan(), scene, whole);
        const auto frame = cut(scene, options);
        if (!uncut || !frame)
            return;
        int in_plane = 0, other = 0;
        for (size_t i = 0; i < frame->face.size(); ++i) {
            const bool shown = uncut->frame.face[i] >= 0 && uncut->frame.normal[3 * i] > 0.5f;
            in_plane += shown;
            other += is_cap(*frame, i) != shown;
        }
        EXPECT_GT(in_plane, vulkan() ? 200 : 2000);
        EXPECT_LE(other, vulkan() ? 2 : 8) << "at the face's border alone";
        // all of the box lies on the other side, but for a face
        options.look.section.planes = {{{8, 0, 0}, {-1, 0, 0}}};
        const auto nothing = cut(scene, options);
        EXPECT_EQ(std::count(nothing->face.begin(), nothing->face.end(), -1), std::ptrdiff_t(nothing->face.size()));
        if (vulkan())
            return;
    }
}

TEST_P(section, without_caps_the_inside_is_seen)
{
    const auto scene = made([](TracedScene& s) { add_ball(s, {0, 0, 0}, 9); });
    RenderOptions options = overview(vulkan() ? 96 : 320, vulkan() ? 60 : 200);
    options.look.section.planes = {{{0, 0, 0}, {0.3, -0.6, 0.7}}};
    const auto closed = cut(scene, options);
    options.look.section.caps = CapStyle::None;
    const auto open = cut(scene, options);
    options.look.section.caps = CapStyle::Hatched;
    const auto hatched = cut(scene, options);
    if (!closed || !open || !hatched)
        return;
    EXPECT_EQ(cap_count(*open), 0u);
    const PixelRays rays(options);
    const Vec3 normal = unit(options.look.section.planes[0].normal);
    int bowl = 0, wrong = 0, darker = 0;
    for (size_t i = 0; i < open->face.size(); ++i) {
        wrong += (open->face[i] >= 0) != (closed->face[i] != -1);
        if (open->face[i] < 0)
            continue;
        // the far root where the near one is cut away
        const reference::Ray ray = rays.of_pixel(i);
        const double b = dot(ray.origin, ray.direction), square = b * b - (dot(ray.origin, ray.origin) - 81);
        const double near = -b - std::sqrt(square), far = -b + std::sqrt(square);
        const bool inside = dot(normal, ray.at(near)) > 0;
        bowl += inside;
        wrong += std::abs(double(open->depth_mm[i]) - (inside ? far : near)) > 1e-3;
    }
    EXPECT_GT(bowl, vulkan() ? 300 : 3000);
    EXPECT_EQ(wrong, 0);
    // hatches are colours, and nothing else
    EXPECT_TRUE(same_bits(closed->face, hatched->face) && same_bits(closed->depth_mm, hatched->depth_mm) &&
                same_bits(closed->normal, hatched->normal) && same_bits(closed->uv, hatched->uv) &&
                same_bits(closed->instance, hatched->instance) && same_bits(closed->certified, hatched->certified));
    for (size_t i = 0; i < 4 * closed->face.size(); ++i) {
        ASSERT_TRUE(closed->rgba[i] == hatched->rgba[i] || is_cap(*closed, i / 4)) << i;
        ASSERT_GE(closed->rgba[i], hatched->rgba[i]);
        darker += closed->rgba[i] > hatched->rgba[i];
    }
    EXPECT_GT(darker, vulkan() ? 300 : 3000);
}

TEST_P(section, what_is_cut_away_throws_no_shadow)
{
    const Vec3 middle{0, 0, 6};
    constexpr double kRadius = 4;
    const auto scene = made([&](TracedScene& s) {
        add_rectangle(s, {0, 0, 0}, {0, 1, 20}, {1, 1, 20});
        add_ball(s, middle, kRadius);
    });
    RenderOptions options = overview(vulkan() ? 96 : 320, vulkan() ? 60 : 200);
    options.look.section.planes = {{middle, {0, 0, 1}}};
    options.look.section.caps = CapStyle::None;
    options.look.lights = {{.direction = {1, 0.5, -1}, .shadows = true}};
    options.look.sky = 0.0f;
    const auto frame = cut(scene, options);
    if (!frame)
        return;
    const PixelRays rays(options);
    const auto in_shadow = [&](double x, double y) {
        const reference::Ray ray = rays.through(x, y);
        const Vec3 p = ray.at(-ray.origin[2] / ray.direction[2]), way = unit(options.look.lights[0].direction) * -1;
        const double s = dot(middle - p, way), square = s * s - dot(middle - p, middle - p) + kRadius * kRadius;
        if (square < 0)
            return false;
        return p[2] + (s - std::sqrt(square)) * way[2] < middle[2] ||
               p[2] + (s + std::sqrt(square)) * way[2] < middle[2];
    };
    int dark = 0, wrong = 0;
    for (size_t i = 0; i < frame->face.size(); ++i) {
        if (frame->face[i] != 0)
            continue;
        const double x = double(i % options.width) + 0.5, y = double(i / options.width) + 0.5;
        const bool expected = in_shadow(x, y);
        bool rim = false;
        for (const double dx : {-0.02, 0.02})
            for (const double dy : {-0.02, 0.02})
                rim |= in_shadow(x + dx, y + dy) != expected;
        dark += expected;
        wrong += !rim && (frame->rgba[4 * i + 1] == 0) != expected;
    }
    EXPECT_GT(dark, vulkan() ? 100 : 1000);
    EXPECT_EQ(wrong, 0);
}

} // namespace
} // namespace trimray
