// Moving a camera by hand, against what is seen: points are projected through camera_rays, which pictures are made
// with.
#include "runtime/camera_frame.h"
#include "runtime/navigation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace trimray {
namespace {

using namespace camera_math;

constexpr PictureSize kSize{640, 360};

/// Where a point is seen, in pixels: the solution of point - eye = t * (corner + x * step_x + y * step_y).
std::array<double, 2> seen_at(const Camera& camera, const Vec3& point)
{
    const CameraRays rays = camera_rays(camera, kSize.width, kSize.height);
    const Vec3 way = point - rays.eye;
    const double det = dot(rays.corner, cross(rays.step_x, rays.step_y));
    const double t = dot(way, cross(rays.step_x, rays.step_y)) / det;
    return {dot(rays.corner, cross(way, rays.step_y)) / det / t, dot(rays.corner, cross(rays.step_x, way)) / det / t};
}

/// Any camera, and the same with parallel rays.
std::vector<Camera> some_cameras()
{
    std::mt19937 random(5);
    std::uniform_real_distribution<double> number(-1, 1);
    std::vector<Camera> cameras;
    for (int i = 0; i < 20; ++i) {
        Camera camera;
        for (size_t k = 0; k < 3; ++k) {
            camera.target[k] = 10 * number(random);
            camera.eye[k] = camera.target[k] + 40 * number(random);
            camera.up[k] = number(random);
        }
        camera.fov_deg = 45 + 30 * number(random);
        cameras.push_back(camera);
        cameras.push_back(with_parallel_rays(camera));
    }
    return cameras;
}

double length(const Vec3& v)
{
    return std::sqrt(dot(v, v));
}

void expect_near(const Vec3& a, const Vec3& b, double within)
{
    EXPECT_LT(length(a - b), within);
}

Camera in_front(const Vec3& eye)
{
    Camera camera;
    camera.eye = eye;
    camera.target = {0, 0, 0};
    return camera;
}

TEST(navigation, a_pan_takes_what_is_as_far_as_the_target_with_the_pointer)
{
    for (const Camera& camera : some_cameras()) {
        const Vec3 point = point_at_target(camera, 100, 300, kSize);
        const auto before = seen_at(camera, point), after = seen_at(pan(camera, 37, -21, kSize), point);
        EXPECT_NEAR(before[0], 100, 1e-4);
        EXPECT_NEAR(before[1], 300, 1e-4);
        EXPECT_NEAR(after[0], 137, 1e-4);
        EXPECT_NEAR(after[1], 279, 1e-4);
    }
}

TEST(navigation, a_zoom_keeps_the_point_under_the_pointer_and_scales_what_is_about_it)
{
    for (const Camera& camera : some_cameras()) {
        const Vec3 point = point_at_target(camera, 500, 80, kSize), beside = point_at_target(camera, 520, 80, kSize);
        for (const double scale : {0.25, 0.9, 3.0}) {
            const Camera zoomed = zoom_about(camera, point, scale);
            const auto fixed = seen_at(zoomed, point), other = seen_at(zoomed, beside);
            EXPECT_NEAR(fixed[0], 500, 1e-4);
            EXPECT_NEAR(fixed[1], 80, 1e-4);
            EXPECT_NEAR(other[0], 500 + 20 / scale, 1e-3);
        }
    }
}

TEST(navigation, a_turn_keeps_the_target_where_it_is_seen_and_as_far_away)
{
    for (const Camera& camera : some_cameras())
        for (const Turning turning : {Turning::Turntable, Turning::Free}) {
            const Camera moved = orbit(camera, 50, 20, kSize, turning, {0, 0, 1});
            expect_near(moved.target, camera.target, 1e-12);
            EXPECT_NEAR(length(moved.eye - moved.target), length(camera.eye - camera.target), 1e-9);
            const auto middle = seen_at(moved, camera.target);
            EXPECT_NEAR(middle[0], 320, 1e-4);
            EXPECT_NEAR(middle[1], 180, 1e-4);
        }
}

TEST(navigation, the_model_follows_the_pointer)
{
    const Vec3 front{0, -1, 0}; // of a model about the origin, before the eye
    const Camera camera = in_front({0, -10, 0});
    for (const Turning turning : {Turning::Turntable, Turning::Free}) {
        const auto right = seen_at(orbit(camera, 30, 0, kSize, turning, {0, 0, 1}), front);
        EXPECT_GT(right[0], 321);
        EXPECT_NEAR(right[1], 180, 1e-6);
        const auto down = seen_at(orbit(camera, 0, 30, kSize, turning, {0, 0, 1}), front);
        EXPECT_NEAR(down[0], 320, 1e-6);
        EXPECT_GT(down[1], 181);
    }
}

TEST(navigation, a_quarter_of_a_turn_is_half_of_the_pictures_height)
{
    expect_near(orbit(in_front({0, -10, 0}), 180, 0, kSize, Turning::Turntable, {0, 0, 1}).eye, {-10, 0, 0}, 1e-12);
    expect_near(orbit(in_front({0, -10, 0}), 180, 0, kSize, Turning::Free, {0, 0, 1}).eye, {-10, 0, 0}, 1e-12);
    expect_near(orbit(in_front({0, -10, 0}), 0, 180, kSize, Turning::Free, {0, 0, 1}).eye, {0, 0, 10}, 1e-12);
}

TEST(navigation, on_a_turntable_up_stays_up_and_the_poles_are_not_passed)
{
    for (const Camera& camera : some_cameras()) {
        Camera moved = orbit(camera, 3, 2, kSize, Turning::Turntable, {0, 0, 1});
        EXPECT_NEAR(camera_axes(moved).right[2], 0, 1e-9); // level
        for (int i = 0; i < 30; ++i)
            moved = orbit(moved, 1, 40, kSize, Turning::Turntable, {0, 0, 1});
        EXPECT_GT(moved.eye[2], moved.target[2]);
        EXPECT_GT(camera_axes(moved).up[0] * camera_axes(moved).up[0] +
                      camera_axes(moved).up[1] * camera_axes(moved).up[1],
                  0.99);
        EXPECT_NEAR(camera_axes(moved).right[2], 0, 1e-9);
    }
}

TEST(navigation, a_turntable_leaves_the_view_from_above_without_a_jump)
{
    Camera top = in_front({0, 0, 10});
    top.up = {0, 1, 0};
    const CameraAxes before = camera_axes(top),
                     after = camera_axes(orbit(top, 0, -5, kSize, Turning::Turntable, {0, 0, 1}));
    EXPECT_GT(dot(before.right, after.right), 0.999999);
    EXPECT_GT(dot(before.up, after.up), 0.99);
    EXPECT_LT(orbit(top, 0, -5, kSize, Turning::Turntable, {0, 0, 1}).eye[1], 0); // towards the front
}

TEST(navigation, a_roll_turns_the_picture_clockwise)
{
    const Camera camera = in_front({0, -10, 0});
    const auto before = seen_at(camera, {0, 0, 1}), after = seen_at(roll(camera, 90), {0, 0, 1});
    EXPECT_LT(before[1], 179); // above the middle
    EXPECT_GT(after[0], 321);  // right of it
    EXPECT_NEAR(after[1], 180, 1e-6);
    for (const Camera& any : some_cameras())
        expect_near(camera_axes(roll(roll(any, 50), -50)).up, camera_axes(any).up, 1e-9);
}

TEST(navigation, parallel_rays_show_the_targets_surroundings_as_large_and_back)
{
    for (const Camera& camera : some_cameras()) {
        const Vec3 point = point_at_target(camera, 10, 20, kSize);
        const Camera parallel = with_parallel_rays(camera), back = with_perspective(parallel);
        for (const Camera& each : {parallel, back}) {
            EXPECT_NEAR(seen_at(each, point)[0], 10, 1e-4);
            EXPECT_NEAR(seen_at(each, point)[1], 20, 1e-4);
        }
        EXPECT_EQ(back.orthographic_mm, 0);
    }
}

TEST(navigation, what_is_framed_whole_touches_no_side_and_fills_one)
{
    const Reach ball = [](const Vec3& direction) { return 2 * length(direction) + dot(direction, {5, 6, 7}); };
    for (Camera camera : some_cameras()) {
        const CameraAxes before = camera_axes(camera);
        frame_whole(camera, ball, 640.0 / 360);
        const CameraAxes axes = camera_axes(camera);
        expect_near(axes.forward, before.forward, 1e-9);
        expect_near(axes.up, before.up, 1e-9);
        // the topmost point that is seen of a ball: where the ray touches it
        const double away = length(Vec3{5, 6, 7} - camera.eye);
        const double radius = camera.orthographic_mm > 0
                                  ? 2 / camera.orthographic_mm * 360
                                  : 2 / std::sqrt(away * away - 4) / half_height(camera.fov_deg) * 180;
        EXPECT_LT(radius, 180);
        EXPECT_GT(radius, 168);
        EXPECT_NEAR(seen_at(camera, {5, 6, 7})[0], 320, 1e-3);
    }
}

} // namespace
} // namespace trimray
