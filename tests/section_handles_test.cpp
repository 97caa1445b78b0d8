// What moves a section's plane by hand: against what is seen, through camera_rays, which pictures are made with.
#include "runtime/camera_frame.h"
#include "runtime/navigation.h"
#include "runtime/view/section_handles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace trimray {
namespace {

using namespace camera_math;

constexpr PictureSize kSize{800, 600};
constexpr double kArrow = 80;

PlacementView box()
{
    PlacementView placed;
    placed.bounds_lo_mm = {-10, -20, 5};
    placed.bounds_hi_mm = {30, 20, 25};
    return placed;
}

double length(const Vec3& v)
{
    return std::sqrt(dot(v, v));
}

/// The ray through a pixel, as pictures have it.
Vec3 direction_at(const Camera& camera, const std::array<double, 2>& pixel)
{
    const CameraRays rays = camera_rays(camera, kSize.width, kSize.height);
    return normalised(rays.corner + rays.step_x * pixel[0] + rays.step_y * pixel[1], {0, 0, 1});
}

/// From all around, near enough for perspective to matter, and the same with parallel rays.
std::vector<Camera> some_cameras()
{
    std::mt19937 random(11);
    std::normal_distribution<double> number;
    std::vector<Camera> cameras;
    for (int i = 0; i < 20; ++i) {
        Camera camera;
        camera.target = {10 + number(random), number(random), 15 + number(random)};
        camera.eye = camera.target + normalised({number(random), number(random), number(random)}, {1, 0, 0}) * 90;
        cameras.push_back(camera);
        cameras.push_back(with_parallel_rays(camera));
    }
    return cameras;
}

std::vector<SectionHandle> handles_of(const SectionPlane& plane, const Camera& camera)
{
    SectionLook section;
    section.planes = {plane};
    return section_handles(section, box(), camera, kSize, kArrow);
}

SectionPlane some_plane(std::mt19937& random)
{
    std::normal_distribution<double> number;
    return {{10 + number(random), number(random), 15 + number(random)},
            {number(random), number(random), 2 * number(random)}};
}

TEST(section_handles, a_point_is_seen_where_its_ray_goes_through)
{
    std::mt19937 random(3);
    std::uniform_real_distribution<double> number(-10, 10);
    for (const Camera& camera : some_cameras()) {
        const Vec3 point = camera.target + Vec3{number(random), number(random), number(random)};
        const auto pixel = seen_at(camera, point, kSize);
        ASSERT_TRUE(pixel);
        const Vec3 way = normalised(point - camera_rays(camera, kSize.width, kSize.height).eye, {0, 0, 1});
        // parallel rays are a pinhole's far away
        EXPECT_LT(length(cross(direction_at(camera, *pixel), way)), camera.orthographic_mm > 0 ? 1e-12 : 1e-9);
    }
    Camera camera;
    camera.eye = {0, 0, 0};
    camera.target = {1, 0, 0};
    EXPECT_FALSE(seen_at(camera, {-1, 0, 0}, kSize));
}

TEST(section_handles, the_rim_lies_in_the_plane_around_the_box)
{
    std::mt19937 random(5);
    for (const Camera& camera : some_cameras()) {
        const SectionPlane plane = some_plane(random);
        const std::vector<SectionHandle> handles = handles_of(plane, camera);
        ASSERT_EQ(handles.size(), 1u);
        const SectionHandle& h = handles.front();
        ASSERT_GE(h.rim.size(), 3u);
        ASSERT_LE(h.rim.size(), 6u);
        Vec3 around{};
        for (size_t i = 0; i < h.rim.size(); ++i) {
            EXPECT_NEAR(dot(h.normal, h.rim[i] - plane.point_mm), 0, 1e-9);
            bool on_side = false; // of the box with its room
            for (size_t k = 0; k < 3; ++k) {
                const double room = 0.04 * length(box().bounds_hi_mm - box().bounds_lo_mm);
                on_side |= std::abs(h.rim[i][k] - (box().bounds_lo_mm[k] - room)) < 1e-9 ||
                           std::abs(h.rim[i][k] - (box().bounds_hi_mm[k] + room)) < 1e-9;
            }
            EXPECT_TRUE(on_side);
            const Vec3 turn = cross(h.rim[i] - h.middle, h.rim[(i + 1) % h.rim.size()] - h.middle);
            EXPECT_GT(dot(turn, h.normal), 0); // one after another, around the middle
            around = around + turn;
        }
        EXPECT_NEAR(length(normalised(around, {0, 0, 1}) - h.normal), 0, 1e-9);
    }
}

TEST(section_handles, a_plane_beside_the_box_has_none)
{
    EXPECT_TRUE(handles_of({{100, 0, 0}, {1, 0, 0}}, some_cameras().front()).empty());
}

TEST(section_handles, what_is_moved_stays_with_the_pointer)
{
    std::mt19937 random(7);
    std::uniform_real_distribution<double> way(-4, 4);
    int moved = 0;
    for (const Camera& camera : some_cameras())
        for (const bool by_rim : {false, true}) {
            const SectionHandle h = handles_of(some_plane(random), camera).front();
            if (std::abs(dot(h.normal, camera_axes(camera).forward)) > 0.9)
                continue; // along the view: below
            const Vec3 at = by_rim ? (h.rim[0] + h.rim[1]) * 0.5 : h.middle;
            const double s = way(random);
            const auto from = seen_at(camera, at, kSize), to = seen_at(camera, at + h.normal * s, kSize);
            ASSERT_TRUE(from && to);
            const SectionPlane after = dragged({h, SectionGrip::Move, at}, camera, kSize, *from, *to);
            EXPECT_NEAR(dot(h.normal, after.point_mm - h.middle), s, 1e-6);
            EXPECT_LT(length(after.normal - h.normal), 1e-12);
            ++moved;
        }
    EXPECT_GT(moved, 40);
}

TEST(section_handles, a_plane_that_is_looked_at_straight_comes_as_the_pointer_goes_down)
{
    Camera camera;
    camera.eye = {10, -100, 15};
    camera.target = {10, 0, 15};
    for (const double sign : {1.0, -1.0}) {
        const SectionHandle h = handles_of({{10, 0, 15}, {0, sign, 0}}, camera).front();
        const SectionPlane nearer = dragged({h, SectionGrip::Move, h.middle}, camera, kSize, {400, 300}, {400, 340});
        EXPECT_LT(nearer.point_mm[1], -1);
        EXPECT_NEAR(nearer.point_mm[0], h.middle[0], 1e-9);
    }
}

TEST(section_handles, a_plane_stays_within_what_is_placed)
{
    Camera camera;
    camera.eye = {10, -100, 15};
    camera.target = {10, 0, 15};
    const SectionHandle h = handles_of({{10, 0, 15}, {1, 0, 0}}, camera).front();
    const auto far = dragged({h, SectionGrip::Move, h.middle}, camera, kSize, {400, 300}, {4000, 300});
    EXPECT_NEAR(far.point_mm[0], 30, 1e-9);
    EXPECT_FALSE(handles_of(far, camera).empty()); // and can be brought back
    const auto back = dragged({h, SectionGrip::Move, h.middle}, camera, kSize, {400, 300}, {-4000, 300});
    EXPECT_NEAR(back.point_mm[0], -10, 1e-9);
}

TEST(section_handles, the_ball_stays_with_the_pointer)
{
    std::mt19937 random(9);
    std::normal_distribution<double> number;
    int turned = 0;
    for (const Camera& camera : some_cameras()) {
        const SectionHandle h = handles_of(some_plane(random), camera).front();
        const Vec3 wanted = normalised(h.normal + Vec3{number(random), number(random), number(random)} * 0.1, h.normal);
        bool near_axis = false;
        for (const double c : wanted)
            near_axis |= std::abs(c) > 0.99;
        const double radius = length(h.tip - h.middle);
        const Vec3 ball = h.middle + wanted * radius;
        // on the half of the sphere that it was on, seen from the eye
        const Vec3 sight = camera.orthographic_mm > 0 ? camera_axes(camera).forward : normalised(ball - camera.eye, {});
        if (near_axis || dot(wanted, sight) * dot(h.normal, sight) <= 0 || std::abs(dot(wanted, sight)) < 0.05)
            continue;
        const auto to = seen_at(camera, ball, kSize);
        ASSERT_TRUE(to);
        const SectionPlane after = dragged({h, SectionGrip::Turn, h.tip}, camera, kSize, h.tip_px, *to);
        EXPECT_LT(length(after.normal - wanted), 1e-6);
        EXPECT_LT(length(after.point_mm - h.middle), 1e-12);
        ++turned;
    }
    EXPECT_GT(turned, 20);
}

TEST(section_handles, a_normal_near_an_axis_is_the_axis)
{
    Camera camera;
    camera.eye = {10, -100, 15};
    camera.target = {10, 0, 15};
    const SectionHandle h = handles_of({{10, 0, 15}, {std::sin(0.3), -std::cos(0.3), 0}}, camera).front();
    const Vec3 near{std::sin(0.04), -std::cos(0.04), 0};
    const auto to = seen_at(camera, h.middle + near * length(h.tip - h.middle), kSize);
    EXPECT_EQ(dragged({h, SectionGrip::Turn, h.tip}, camera, kSize, h.tip_px, *to).normal, (Vec3{0, -1, 0}));
}

TEST(section_handles, balls_are_gripped_before_arrows_and_rims)
{
    Camera camera;
    camera.eye = {60, -100, 50};
    camera.target = {10, 0, 15};
    const std::vector<SectionHandle> handles = handles_of({{10, 0, 15}, {1, 0, 0}}, camera);
    const SectionHandle& h = handles.front();
    const auto at = [&](const std::array<double, 2>& p) { return grip_at(handles, p[0], p[1], 7); };
    ASSERT_TRUE(at(h.tip_px));
    EXPECT_EQ(at(h.tip_px)->grip, SectionGrip::Turn);
    ASSERT_TRUE(at(h.middle_px));
    EXPECT_EQ(at(h.middle_px)->grip, SectionGrip::Move);
    const std::array<double, 2> rim{0.5 * (h.rim_px[0][0] + h.rim_px[1][0]), 0.5 * (h.rim_px[0][1] + h.rim_px[1][1])};
    ASSERT_TRUE(at(rim));
    EXPECT_LT(length(at(rim)->at - (h.rim[0] + h.rim[1]) * 0.5), 1e-9);
    EXPECT_FALSE(at({h.tip_px[0] + 30, h.tip_px[1] + 30}));
}

} // namespace
} // namespace trimray
