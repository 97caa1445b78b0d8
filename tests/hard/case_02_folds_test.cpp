// Hard case 2: two or three hits of one patch, close to each other, of which the nearest is lost.
#include "tests/hard/closest_hits.h"
#include "tests/hard/nets.h"

#include <cmath>

namespace trimray::hard {
namespace {

/// A cubic sheet folded over itself: along u its points go forth, back and forth again, `overhang` of their way, in
/// three layers about `gap` part units apart.
std::shared_ptr<const Scene> fold(double overhang, double gap)
{
    TracedScene scene;
    add_net(scene, 3, 3, false, [&](int i, int j) {
        const double x[4] = {-0.6, 0.6 * overhang, -0.6 * overhang, 0.6};
        const double z[4] = {-1.5 * gap, -0.5 * gap, 0.5 * gap, 1.5 * gap};
        const double v = j / 3.0;
        return NetPoint{x[i], 1.2 * v - 0.6, z[i] + 0.2 * v * v, 1};
    });
    return scene.finish();
}

std::vector<View> around(uint32_t side)
{
    std::vector<View> views;
    // along the layers' normals, slant, and nearly along the layers
    for (const std::array<double, 3> eye :
         {std::array{0.5, -1.0, 40.0}, std::array{25.0, -9.0, 25.0}, std::array{-38.0, 4.0, 5.0}}) {
        Camera camera;
        camera.eye = eye;
        camera.target = {0, 0, 1};
        camera.fov_deg = 22;
        views.push_back({camera, side, side});
    }
    return views;
}

TEST(case_02, of_three_hits_the_nearest_is_seen)
{
    for (const double overhang : {0.5, 1.0, 1.6}) // x turns back where it is more than 1/3
        for (const double gap : {0.3, 0.003}) {
            std::cout << "overhang " << overhang << ", gap " << gap << "; ";
            on_both_tracers(fold(overhang, gap), around(128), [](const Score& score) {
                EXPECT_GT(score.hits, score.rays / 8) << score;
                EXPECT_EQ(score.false_misses, 0u) << score;
                EXPECT_EQ(score.false_hits, 0u) << score;
            });
        }
}

} // namespace
} // namespace trimray::hard
