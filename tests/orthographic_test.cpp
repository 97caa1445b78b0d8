// Parallel rays: pictures against the reference's, whose rays are parallel; the CPU tracer's come from a pinhole far
// back.
#include "runtime/camera.h"
#include "tests/against_reference.h"
#include "tests/keep_vulkan_loaded.h"
#include "tests/traced_scenes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace trimray {
namespace {

/// Along `view` at a height of `height_mm`, from `back` mm before the origin.
Camera parallel_camera(std::array<double, 3> view, double height_mm, double back)
{
    const double length = std::hypot(view[0], view[1], view[2]);
    Camera camera;
    for (size_t i = 0; i < 3; ++i) {
        camera.eye[i] = -back * view[i] / length;
        camera.target[i] = camera.eye[i] + view[i];
    }
    camera.orthographic_mm = height_mm;
    return camera;
}

Frame traced(const std::shared_ptr<const Scene>& scene, const Camera& camera, uint32_t width, uint32_t height,
             Tracer* tracer = nullptr)
{
    RenderOptions options;
    options.camera = camera;
    options.width = width;
    options.height = height;
    RenderStats stats;
    Result<Frame> frame =
        tracer != nullptr ? tracer->render(options, stats) : (*make_cpu_tracer(scene))->render(options, stats);
    EXPECT_TRUE(frame.ok()) << frame.error().detail;
    return std::move(*frame);
}

AgainstReference against(const std::shared_ptr<const Scene>& scene, const Camera& camera)
{
    return compare_with_reference(traced(scene, camera, 160, 120), camera, ClosestReference(scene->pack.image));
}

TEST(orthographic, pictures_are_the_references)
{
    const std::shared_ptr<const Scene> scene = all_kinds().finish();
    for (const std::array<double, 3>& view :
         {std::array<double, 3>{0, 0, -1}, {-1, 1, -1}, {0.3, 1, 0.2}, {1, 0, 0}, {-0.2, -0.1, 1}})
        for (const double height_mm : {24.0, 3.0, 0.2}) {
            const Camera camera = parallel_camera(view, height_mm, 40);
            const AgainstReference found = against(scene, camera);
            EXPECT_EQ(std::accumulate(found.faults.begin(), found.faults.end(), uint64_t{0}), 0u)
                << view[0] << ' ' << view[1] << ' ' << view[2] << " at " << height_mm << " mm";
            EXPECT_EQ(found.certified_wrong, 0u);
            EXPECT_EQ(found.not_finite, 0u);
            // a model far larger than the picture has fewer digits left of a pixel
            EXPECT_LT(found.largest_depth_px, height_mm > 1 ? 1e-2 : 5e-2) << height_mm;
        }
}

TEST(orthographic, pictures_through_vulkan_are_the_references)
{
    const std::shared_ptr<const Scene> scene = all_kinds().finish();
    keep_vulkan_loaded();
    const Result<std::unique_ptr<Tracer>> tracer = make_vulkan_tracer(scene, true, false);
    if (!tracer.ok())
        GTEST_SKIP() << tracer.error().detail;
    const ClosestReference closest(scene->pack.image);
    for (const std::array<double, 3>& view : {std::array<double, 3>{0, 0, -1}, {-1, 1, -1}, {0.3, 1, 0.2}})
        for (const double back : {40.0, 0.0}) {
            const Camera camera = parallel_camera(view, 24, back);
            const Frame frame = traced(scene, camera, 160, 120, tracer->get());
            const AgainstReference found = compare_with_reference(frame, camera, closest);
            EXPECT_EQ(std::accumulate(found.faults.begin(), found.faults.end(), uint64_t{0}), 0u)
                << view[0] << ' ' << view[1] << ' ' << view[2] << " from " << back << " mm";
            EXPECT_EQ(found.certified_wrong, 0u);
            EXPECT_EQ(found.not_finite, 0u);
            EXPECT_LT(found.largest_depth_px, 1e-2);
        }
}

TEST(orthographic, what_lies_behind_the_eyes_plane_is_not_seen_and_depth_counts_from_it)
{
    const std::shared_ptr<const Scene> scene = all_kinds().finish();
    const Camera before = parallel_camera({0, 0, -1}, 24, 40);
    const Camera within = parallel_camera({0, 0, -1}, 24, 0);
    const Frame all = traced(scene, before, 64, 48), cut = traced(scene, within, 64, 48);
    size_t same = 0, behind = 0;
    for (size_t i = 0; i < all.depth_mm.size(); ++i) {
        if (all.face[i] < 0) {
            EXPECT_LT(cut.face[i], 0);
        } else if (all.depth_mm[i] > 40.001f) { // beyond the plane: as before, 40 mm nearer
            ++same;
            EXPECT_EQ(cut.face[i], all.face[i]);
            EXPECT_NEAR(cut.depth_mm[i], all.depth_mm[i] - 40, 1e-4);
        } else if (all.depth_mm[i] < 39.999f) {
            ++behind;
            EXPECT_TRUE(cut.face[i] < 0 || cut.depth_mm[i] > 0);
        }
    }
    EXPECT_GT(same, 100u);
    EXPECT_GT(behind, 100u);
    const AgainstReference found = against(scene, within);
    EXPECT_EQ(std::accumulate(found.faults.begin(), found.faults.end(), uint64_t{0}), 0u);
}

TEST(orthographic, rays_are_parallel)
{
    // a pixel shows the same place from near and from far
    const std::shared_ptr<const Scene> scene = all_kinds().finish();
    const Frame near = traced(scene, parallel_camera({-1, 1, -1}, 24, 40), 64, 48);
    const Frame far = traced(scene, parallel_camera({-1, 1, -1}, 24, 4000), 64, 48);
    EXPECT_EQ(near.face, far.face);
    for (size_t i = 0; i < near.depth_mm.size(); ++i)
        if (near.face[i] >= 0) {
            EXPECT_NEAR(far.depth_mm[i] - near.depth_mm[i], 3960, 1e-3);
        }
}

TEST(orthographic, a_view_frames_what_it_shows_whole)
{
    // a box of 4 x 2 x 1 around (1, 2, 3)
    const Reach reach = [](const std::array<double, 3>& d) {
        return d[0] + 2 * d[1] + 3 * d[2] + 2 * std::abs(d[0]) + std::abs(d[1]) + 0.5 * std::abs(d[2]);
    };
    Camera camera;
    ASSERT_TRUE(standard_orthographic_view("top", reach, 1, 0, camera));
    EXPECT_NEAR(camera.orthographic_mm, 4 * 1.04, 1e-9) << "as wide as high";
    EXPECT_NEAR(camera.eye[0], 1, 1e-12);
    EXPECT_NEAR(camera.eye[1], 2, 1e-12);
    EXPECT_GT(camera.eye[2], 3.5) << "before the model";
    ASSERT_TRUE(standard_orthographic_view("front", reach, 4, 0, camera));
    EXPECT_NEAR(camera.orthographic_mm, 1.04, 1e-9);
    ASSERT_TRUE(standard_orthographic_view("front", reach, 4, 7, camera));
    EXPECT_EQ(camera.orthographic_mm, 7);
    EXPECT_FALSE(standard_orthographic_view("inside", reach, 1, 0, camera));
}

} // namespace
} // namespace trimray
