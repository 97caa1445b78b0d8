// What the trim modes are measured by: decibels, wrong rays, border errors in pixels, and the close-up's rule.
#include "runtime/close_up.h"
#include "runtime/trim_errors.h"
#include "tests/traced_scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace trimray {
namespace {

constexpr uint32_t kWidth = 320, kHeight = 240;

Frame render(const std::shared_ptr<const Scene>& scene, const Camera& camera, TrimMode trim)
{
    RenderOptions options;
    options.width = kWidth;
    options.height = kHeight;
    options.camera = camera;
    options.trim = trim;
    return draw(scene, options).frame;
}

Picture grey(uint8_t level)
{
    Picture picture{4, 2, std::vector<uint8_t>(32, level)};
    return picture;
}

TEST(trim_errors, psnr_is_that_of_the_formula)
{
    const Picture a = grey(100);
    Picture b = a;
    EXPECT_EQ(psnr_db(a, b), std::numeric_limits<double>::infinity());
    b.rgba[3] = 0; // alpha does not count
    EXPECT_EQ(psnr_db(a, b), std::numeric_limits<double>::infinity());
    b.rgba[0] = 106; // one of 24 numbers is off by 6: MSE = 36 / 24
    EXPECT_NEAR(psnr_db(a, b), 10 * std::log10(255.0 * 255.0 / 1.5), 1e-12);
    EXPECT_NEAR(psnr_db(grey(0), grey(255)), 0, 1e-12);
}

/// A plane across the view of a camera straight above it, 1 mm = 10 pixels; u and v run along x and y over 20 mm.
struct PlaneFromAbove {
    TracedScene scene;
    Camera camera;

    PlaneFromAbove()
    {
        scene.add(kKindPlane, 1, {0, 0, 0}, {1, 1});
        constexpr double kEye = 100;
        camera = {{0, 0, kEye}, {0, 0, 0}, {0, 1, 0}, 2 * std::atan(12.0 / kEye) * 180 / M_PI};
    }
};

TEST(trim_errors, pixels_of_a_plane_are_where_its_scale_says)
{
    PlaneFromAbove model;
    const auto scene = model.scene.finish();
    const CameraRays rays = camera_rays(model.camera, kWidth, kHeight);
    const PixelOfFace pixel = pixel_of_face(scene->pack.image, rays, 0, 0, 0.75, 0.6);
    EXPECT_NEAR(pixel.at[0], 160 + 50, 1e-6);
    EXPECT_NEAR(pixel.at[1], 120 - 20, 1e-6);
    EXPECT_NEAR(pixel.change.uu, 200, 1e-4);
    EXPECT_NEAR(pixel.change.vu, 0, 1e-4);
    EXPECT_NEAR(pixel.change.uv, 0, 1e-4);
    EXPECT_NEAR(pixel.change.vv, -200, 1e-4);
}

TEST(trim_errors, every_hit_of_every_kind_lies_in_its_pixel)
{
    TracedScene model = all_kinds();
    model.place({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    model.place({0, 0, -0.5, 9, 0.5, 0, 0, -4, 0, 0.5, 0, 3}); // turned, half as large, mirrored
    const auto scene = model.finish();
    const Frame frame = render(scene, kOverview, TrimMode::Exact);
    const CameraRays rays = camera_rays(kOverview, kWidth, kHeight);
    size_t hits = 0, far = 0;
    std::vector<bool> seen(2 * scene->pack.image.faces.size());
    for (size_t i = 0; i < frame.face.size(); ++i) {
        if (frame.face[i] < 0)
            continue;
        const uint face_id = static_cast<uint>(frame.face[i]), instance = static_cast<uint>(frame.instance[i]);
        const FaceRecord& face = scene->pack.image.faces[face_id];
        double uv[2];
        for (size_t c = 0; c < 2; ++c)
            uv[c] = (frame.uv[2 * i + c] - face.domain_lo[c]) / (face.domain_hi[c] - face.domain_lo[c]);
        const PixelOfFace pixel = pixel_of_face(scene->pack.image, rays, instance, face_id, uv[0], uv[1]);
        const double x = static_cast<double>(i % kWidth) + 0.5, y = static_cast<double>(i / kWidth) + 0.5;
        far += std::hypot(pixel.at[0] - x, pixel.at[1] - y) > 0.05; // Newton stops at 0.02
        seen[2 * face_id + instance] = true;
        ++hits;
    }
    EXPECT_GT(hits, 15000u);
    EXPECT_EQ(far, 0u);
    EXPECT_GE(std::count(seen.begin(), seen.end(), true), 12);
}

TEST(trim_errors, a_border_that_moved_is_off_by_as_many_pixels)
{
    PlaneFromAbove right, moved;
    const auto with_hole = [](float radius) {
        return std::vector{shapes::polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}}),
                           shapes::circle(0.5, 0.5, radius, radius, 4)};
    };
    right.scene.trim(0, with_hole(0.25f));
    moved.scene.trim(0, with_hole(0.235f)); // 200 pixels a unit: 3 pixels less
    const auto scene = right.scene.finish(), other = moved.scene.finish();
    const Frame a = render(scene, right.camera, TrimMode::Reference),
                b = render(other, moved.camera, TrimMode::Reference);
    const CameraRays rays = camera_rays(right.camera, kWidth, kHeight);
    const TrimReference reference(scene->pack.image), other_reference(other->pack.image);
    // seen as an error of b against a: a face that was kept; and the other way round: one that was lost
    for (const TrimErrors& errors : {trim_errors(scene->pack.image, reference, rays, b, a),
                                     trim_errors(other->pack.image, other_reference, rays, a, b)}) {
        EXPECT_EQ(errors.rays, size_t{kWidth} * kHeight);
        EXPECT_NEAR(static_cast<double>(errors.wrong_rays), M_PI * (50 * 50 - 47 * 47), 20);
        EXPECT_GT(errors.largest_border_error_px, 2.8);
        EXPECT_LT(errors.largest_border_error_px, 3.001);
        EXPECT_GT(errors.psnr_db, 10);
        EXPECT_LT(errors.psnr_db, 40);
    }
    const TrimErrors none = trim_errors(scene->pack.image, reference, rays, a, a);
    EXPECT_EQ(none.wrong_rays, 0u);
    EXPECT_EQ(none.largest_border_error_px, 0);
    EXPECT_EQ(none.psnr_db, std::numeric_limits<double>::infinity());
}

TEST(close_up, goes_to_where_most_borders_are)
{
    PlaneFromAbove model; // one large hole on the left, nine small ones on the right
    std::vector<shapes::Loop> loops{shapes::polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}}),
                                    shapes::circle(0.25, 0.5, 0.2, 0.2)};
    for (int i = 0; i < 9; ++i)
        loops.push_back(shapes::circle(0.72 + 0.03 * (i % 3), 0.47 + 0.03 * static_cast<double>(i / 3), 0.01, 0.01));
    model.scene.trim(0, loops);
    const auto scene = model.scene.finish();
    const auto tracer = make_cpu_tracer(scene);
    ASSERT_TRUE(tracer.ok());
    RenderOptions whole;
    whole.width = kWidth;
    whole.height = kHeight;
    whole.camera = model.camera;
    const Result<Camera> camera = close_up(**tracer, scene->pack.image, whole, 10);
    ASSERT_TRUE(camera.ok());
    // x = 20 (u - 0.5) mm
    EXPECT_NEAR(camera->target[0], 20 * (0.75 - 0.5), 1); // the window is larger than the nine
    EXPECT_NEAR(camera->target[1], 0, 1);
    EXPECT_NEAR(camera->target[2], 0, 1e-3);
    for (size_t i = 0; i < 3; ++i)
        EXPECT_NEAR(camera->eye[i] - camera->target[i], (model.camera.eye[i] - camera->target[i]) / 10, 1e-9);
    const Frame frame = render(scene, *camera, TrimMode::Exact);
    const size_t middle = size_t{kHeight / 2} * kWidth + kWidth / 2;
    EXPECT_EQ(frame.face[middle], 0);
    EXPECT_LT(*std::min_element(frame.face.begin(), frame.face.end()), 0); // and a hole beside it
    const Result<Camera> again = close_up(**tracer, scene->pack.image, whole, 10);
    ASSERT_TRUE(again.ok());
    EXPECT_EQ(again->eye, camera->eye);
}

TEST(close_up, stays_where_nothing_is_seen)
{
    TracedScene model;
    const auto scene = model.finish();
    const auto tracer = make_cpu_tracer(scene);
    ASSERT_TRUE(tracer.ok());
    RenderOptions whole;
    whole.width = whole.height = 16;
    whole.camera = kOverview;
    const Result<Camera> camera = close_up(**tracer, scene->pack.image, whole, 8);
    ASSERT_TRUE(camera.ok());
    EXPECT_EQ(camera->eye, kOverview.eye);
    EXPECT_EQ(camera->target, kOverview.target);
}

} // namespace
} // namespace trimray
