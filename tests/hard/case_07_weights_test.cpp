// Hard case 7: weights far apart. A weight that is not positive is refused by the converter and the validator (tests
// append_patches.refuses_with_a_reason, pack.hostile_arrays_with_right_checksums_are_refused).
#include "tests/hard/closest_hits.h"
#include "tests/hard/nets.h"

#include <cmath>
#include <random>

namespace trimray::hard {
namespace {

constexpr int kDegree = 3;

/// Hills whose weights lie in [10^-decades, 1]: drawn at random, or all light but for one inner point, or all heavy but
/// for one.
enum class Weights { Random, OneHeavy, OneLight };

std::shared_ptr<const Scene> hills(Weights weights, double decades)
{
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(0, 1);
    TracedScene scene;
    add_net(scene, kDegree, kDegree, true, [&](int i, int j) {
        const double z = 0.6 * uniform(random) - 0.3, drawn = std::pow(10, -decades * uniform(random));
        const bool one = i == 1 && j == 2;
        const double w = weights == Weights::Random              ? drawn
                         : one == (weights == Weights::OneHeavy) ? 1
                                                                 : std::pow(10, -decades);
        return NetPoint{1.2 * i / kDegree - 0.6, 1.2 * j / kDegree - 0.6, z, w};
    });
    return scene.finish();
}

struct Sweep {
    Weights weights;
    double decades;
    double missed; // most false misses a million rays; more than 0: what falls short
};

std::ostream& operator<<(std::ostream& out, const Sweep& sweep)
{
    const char* const names[] = {"random", "one heavy", "one light"};
    return out << names[int(sweep.weights)] << " within 10^-" << sweep.decades << " .. 1";
}

class case_07 : public testing::TestWithParam<Sweep> {};

TEST_P(case_07, weights_over_decades_cost_few_hits)
{
    const auto [weights, decades, missed] = GetParam();
    const auto scene = hills(weights, decades);
    std::vector<View> views;
    for (const std::array<double, 3> eye : {std::array{1.0, 2.0, 30.0}, std::array{-25.0, 7.0, 9.0}}) {
        Camera camera;
        camera.eye = eye;
        camera.fov_deg = 35;
        views.push_back({camera, 192, 144});
    }
    on_both_tracers(scene, views, [missed = missed](const Score& score) {
        EXPECT_GT(score.hits, score.rays / 8) << score;
        EXPECT_LE(score.per_million(score.false_misses), missed) << score;
        EXPECT_LT(score.depth_px, 0.05) << score;
    });
}

INSTANTIATE_TEST_SUITE_P(sweep, case_07,
                         testing::Values(Sweep{Weights::Random, 2, 0}, Sweep{Weights::Random, 4, 0},
                                         Sweep{Weights::Random, 6, 0}, Sweep{Weights::Random, 9, 14000},
                                         Sweep{Weights::OneHeavy, 2, 0}, Sweep{Weights::OneHeavy, 3, 0},
                                         Sweep{Weights::OneHeavy, 4, 0}, Sweep{Weights::OneHeavy, 6, 58000},
                                         Sweep{Weights::OneLight, 6, 0}, Sweep{Weights::OneLight, 12, 0}));

} // namespace
} // namespace trimray::hard
