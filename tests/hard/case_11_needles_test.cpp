// Hard case 11: needles, patches ten thousand times as long as wide.
#include "format/leaf_geometry.h"
#include "tests/hard/closest_hits.h"
#include "tests/hard/nets.h"

#include <cmath>

namespace trimray::hard {
namespace {

constexpr double kAspect = 1e4;

/// Eight bicubic needles side by side, each 20 mm long and 0.002 mm wide, that bend and twist along their way.
std::shared_ptr<const Scene> needles(bool bent)
{
    TracedScene scene;
    for (int k = 0; k < 8; ++k)
        add_net(
            scene, 3, 3, false,
            [&](int i, int j) {
                const double along = 2 * i / 3.0 - 1, across = (j / 3.0 + k - 4) * 2 / kAspect;
                const double lift = bent ? 0.2 * std::sin(2 * along) + across * std::sin(3 * along) : 0;
                return NetPoint{0.9 * along, across + (bent ? 0.1 * along * along : 0), lift, 1};
            },
            1);
    return scene.finish();
}

/// How many boxes of its patch hold the middle of a leaf's box, in the mean; 1 where none overlaps another's middle.
double boxes_at_a_middle(const PackImage& image)
{
    uint64_t held = 0;
    for (const LeafRecord& leaf : image.leaves) {
        const Point3 middle = decode_leaf_box(leaf).center;
        for (const LeafRecord& other : image.leaves) {
            if (other.patch != leaf.patch)
                continue;
            const OrientedBox box = decode_leaf_box(other);
            bool inside = true;
            for (int i = 0; i < 3; ++i) {
                const Point3 d{middle[0] - box.center[0], middle[1] - box.center[1], middle[2] - box.center[2]};
                inside &= std::abs(dot3(d, box.axis[i])) <= box.half[i];
            }
            held += inside;
        }
    }
    return double(held) / double(image.leaves.size());
}

TEST(case_11, needles_are_hit_in_few_leaves_and_steps)
{
    for (const bool bent : {false, true}) {
        const auto scene = needles(bent);
        const PackImage& image = scene->pack.image;
        std::cout << (bent ? "bent" : "straight") << ", " << image.leaves.size() << " leaves, "
                  << boxes_at_a_middle(image) << " boxes of a patch at the middle of a leaf\n";
        EXPECT_LT(boxes_at_a_middle(image), 1.5);
        EXPECT_LE(image.leaves.size(), 8 * 64u);
        std::vector<View> views;
        const double middle_mm = bent ? 1.0 / 3 : 0; // S(0.5, 0.5) of the needles' bend, along y
        const auto look = [&](const std::array<double, 3>& eye, double height_mm) {
            Camera camera;
            camera.eye = {eye[0], eye[1] + middle_mm, eye[2]};
            camera.target = {0, middle_mm, 0};
            camera.up = {1, 0, 0};
            camera.fov_deg =
                114.59 * std::atan(0.5 * height_mm / std::sqrt(eye[0] * eye[0] + eye[1] * eye[1] + eye[2] * eye[2]));
            views.push_back({camera, 160, 120});
        };
        look({0.1, 0.2, 20}, 0.03); // across, a needle 8 pixels wide
        look({18, 0.5, 7}, 0.03);   // along
        look({0.1, 8, 4}, 0.01);    // from the side
        on_both_tracers(scene, views, [](const Score& score) {
            EXPECT_GT(score.hits, score.rays / 16) << score;
            EXPECT_EQ(score.false_misses, 0u) << score;
            EXPECT_EQ(score.false_hits, 0u) << score;
            EXPECT_LT(score.newton_steps, 12) << score;
        });
    }
}

} // namespace
} // namespace trimray::hard
