// Hard case 10: faces that lie on one another. Which one is seen is decided, and does not change with the camera.
#include "tests/hard/closest_hits.h"
#include "tests/hard/nets.h"

#include <cmath>
#include <numbers>

namespace trimray::hard {
namespace {

/// Two faces in the plane z = 1 mm: the second covers the first and more. Bezier ones have different parameters.
std::shared_ptr<const Scene> coplanar(bool bezier)
{
    TracedScene scene;
    for (const double half : {0.6, 0.8}) {
        if (bezier)
            add_net(scene, half < 0.7 ? 1 : 3, 2, false, [&](int i, int j) {
                return NetPoint{half * (2.0 * i / (half < 0.7 ? 1 : 3) - 1), half * (j - 1.0), 0.1, 1};
            });
        else
            scene.add(kKindPlane, 1, {0, 0, 0.1}, {half, half});
    }
    return scene.finish();
}

TEST(case_10, one_face_of_two_is_seen_whatever_the_camera)
{
    for (const bool bezier : {false, true}) {
        for (const auto& [name, tracer] : tracers_of(coplanar(bezier))) {
            uint64_t on_both = 0, second = 0;
            for (int turn = 0; turn < 12; ++turn) {
                RenderOptions options;
                options.width = options.height = name == "vulkan" ? 32 : 128;
                const double angle = turn * std::numbers::pi / 6 + 0.1;
                options.camera.eye = {20 * std::cos(angle), 20 * std::sin(angle), 3.0 + 2 * turn};
                options.camera.fov_deg = 40;
                options.shade = false;
                RenderStats stats;
                const Result<Frame> frame = tracer->render(options, stats);
                ASSERT_TRUE(frame.ok()) << frame.error().detail;
                const CameraRays rays = camera_rays(options.camera, options.width, options.height);
                for (uint32_t y = 0; y < options.height; ++y)
                    for (uint32_t x = 0; x < options.width; ++x) {
                        double along[3];
                        for (size_t i = 0; i < 3; ++i)
                            along[i] = rays.corner[i] + (x + 0.5) * rays.step_x[i] + (y + 0.5) * rays.step_y[i];
                        const double t = (1 - rays.eye[2]) / along[2];
                        const double far =
                            std::max(std::abs(rays.eye[0] + t * along[0]), std::abs(rays.eye[1] + t * along[1]));
                        if (t <= 0 || far > 5.999)
                            continue;
                        ++on_both;
                        second += frame->face[size_t(y) * options.width + x] != 0;
                    }
            }
            std::cout << (bezier ? "Bezier" : "planes") << ", " << name << ": " << second << " of " << on_both
                      << " rays see the second face\n";
            if (name == "plain")
                continue;
            EXPECT_GT(on_both, 1000u);
            EXPECT_EQ(second, 0u);
        }
    }
}

} // namespace
} // namespace trimray::hard
