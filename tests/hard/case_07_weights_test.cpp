// Hard case 7: weights far apart. A weight that is not positive is refused by the converter and the validator (tests
// append_patches.refuses_with_a_reason, pack.hostile_arrays_with_right_checksums_are_refused).
#include "tests/hard/closest_hits.h"
#include "tests/spline_model.h"

#include <cmath>
#include <random>

namespace trimray::hard {
namespace {

constexpr int kDegree = 3;

/// Hills of 12 mm whose weights lie in [10^-decades, 1]: drawn at random, or all light but for one inner point, or all
/// heavy but for one.
enum class Weights { Random, OneHeavy, OneLight };

CadModel hills(Weights weights, double decades)
{
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(0, 1);
    CadFace face = spline_face({{0, 0}, {1, 1}});
    SplineSurface& s = face.surface.spline;
    s.degree_u = s.degree_v = kDegree;
    s.count_u = s.count_v = kDegree + 1;
    s.rational = true;
    s.knots_u = s.knots_v = {0, 0, 0, 0, 1, 1, 1, 1};
    for (int i = 0; i <= kDegree; ++i)
        for (int j = 0; j <= kDegree; ++j) {
            const double z = 6 * uniform(random) - 3, drawn = std::pow(10, -decades * uniform(random));
            const bool one = i == 1 && j == 2;
            const double w = weights == Weights::Random              ? drawn
                             : one == (weights == Weights::OneHeavy) ? 1
                                                                     : std::pow(10, -decades);
            s.control_points.push_back({w * (12.0 * i / kDegree - 6), w * (12.0 * j / kDegree - 6), w * z, w});
        }
    return model_of(face);
}

struct Sweep {
    Weights weights;
    double decades;
    size_t pieces; // most that the patch is cut into
};

std::ostream& operator<<(std::ostream& out, const Sweep& sweep)
{
    const char* const names[] = {"random", "one heavy", "one light"};
    return out << names[int(sweep.weights)] << " within 10^-" << sweep.decades << " .. 1";
}

class case_07 : public testing::TestWithParam<Sweep> {};

TEST_P(case_07, weights_over_decades_cost_no_hit)
{
    const auto [weights, decades, pieces] = GetParam();
    BuildReport report;
    const auto scene = converted(hills(weights, decades), report);
    EXPECT_LE(scene->pack.image.patches.size(), pieces);
    EXPECT_TRUE(report.warnings.empty()) << report.warnings.front();
    std::vector<View> views;
    for (const std::array<double, 3> eye : {std::array{1.0, 2.0, 30.0}, std::array{-25.0, 7.0, 9.0}}) {
        Camera camera;
        camera.eye = eye;
        camera.fov_deg = 35;
        views.push_back({camera, 192, 144});
    }
    on_both_tracers(scene, views, [](const Score& score) {
        EXPECT_GT(score.hits, score.rays / 8) << score;
        EXPECT_EQ(score.false_misses, 0u) << score;
        EXPECT_LE(score.farthest_px, 0.01) << score; // of false hits
        EXPECT_LT(score.depth_px, 0.05) << score;
        EXPECT_LT(score.per_million(score.slack), 1200) << score;
    });
}

INSTANTIATE_TEST_SUITE_P(sweep, case_07,
                         testing::Values(Sweep{Weights::Random, 2, 4}, Sweep{Weights::Random, 4, 8},
                                         Sweep{Weights::Random, 6, 16}, Sweep{Weights::Random, 9, 24},
                                         Sweep{Weights::Random, 20, 80}, Sweep{Weights::OneHeavy, 2, 16},
                                         Sweep{Weights::OneHeavy, 3, 36}, Sweep{Weights::OneHeavy, 4, 56},
                                         Sweep{Weights::OneHeavy, 6, 128}, Sweep{Weights::OneHeavy, 9, 210},
                                         Sweep{Weights::OneHeavy, 12, 300}, Sweep{Weights::OneLight, 6, 2},
                                         Sweep{Weights::OneLight, 12, 2}));

} // namespace
} // namespace trimray::hard
