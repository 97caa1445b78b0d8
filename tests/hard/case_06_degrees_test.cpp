// Hard case 6: patches of high degree in single precision. What the shared formula loses is compared with the bound by
// which the tracers widen patches (patch_rounding).
#include "format/bezier_reference.h"
#include "runtime/cpu_evaluate.h"
#include "shaders/shared/language.h"
#include "shaders/shared/patch_newton.h"
#include "tests/hard/closest_hits.h"
#include "tests/hard/nets.h"

#include <cmath>
#include <random>

HWY_BEFORE_NAMESPACE();
namespace trimray {
namespace HWY_NAMESPACE {
namespace {

constexpr int kDegrees[] = {1, 3, 7, 11, 15, 25};

/// Largest distance of S in lanes from S in double over random points, patch units: of a net with |q| <= 1, whose
/// smallest box has a side of 1 at least.
double largest_error(int degree, bool rational)
{
    std::mt19937 random(static_cast<unsigned>(2 * degree + rational));
    std::uniform_real_distribution<double> uniform(-1, 1);
    TracedScene scene;
    const PatchRecord& patch = hard::add_net(scene, degree, degree, rational, [&](int i, int j) {
        return hard::NetPoint{i / double(degree) - 0.5, j / double(degree) - 0.5, 0.7 * uniform(random),
                              std::pow(10, uniform(random) - 1)};
    });
    const reference::BezierReference exact(patch, scene.image.control_points.data(), 0, 0);
    FetchSource source{};
    source.control_points = scene.image.control_points.data();
    const Evaluate evaluate = find_evaluate(patch.shape);
    double largest = 0;
#ifdef __SANITIZE_ADDRESS__
    constexpr int kPackets = 50; // the whole search is a plain build's
#else
    constexpr int kPackets = 2000;
#endif
    for (int n = 0; n < kPackets; ++n) {
        alignas(64) float u[kLanes], v[kLanes], p[3][kLanes];
        for (int i = 0; i < kLanes; ++i) {
            u[i] = static_cast<float>(0.5 + 0.5 * uniform(random));
            v[i] = static_cast<float>(0.5 + 0.5 * uniform(random));
        }
        const SurfacePoint s = evaluate(source, patch.first_control_point, degree, degree, real2(load(u), load(v)));
        store(s.p.x, p[0]);
        store(s.p.y, p[1]);
        store(s.p.z, p[2]);
        for (int i = 0; i < kLanes; ++i) {
            const reference::Vec3 at = exact.evaluate(double(u[i]), double(v[i])).p;
            largest = std::max(largest,
                               std::hypot(double(p[0][i]) - at[0], double(p[1][i]) - at[1], double(p[2][i]) - at[2]));
        }
    }
    return largest;
}

TEST(case_06, single_precision_loses_less_than_the_tracers_allow_for)
{
    for (const bool rational : {false, true})
        for (const int degree : kDegrees) {
            const double error = largest_error(degree, rational);
            const double bound = double(patch_rounding(degree, degree));
            std::cout << (rational ? "rational" : "polynomial") << ", degree " << degree << ": " << error << ", bound "
                      << bound << "\n";
            EXPECT_LT(error, bound) << degree;
        }
}

TEST(case_06, patches_of_degree_25_are_hit_as_others)
{
    for (const int degree : kDegrees) {
        TracedScene scene;
        scene.add_wave(degree, {0, 0, 0}, degree == 1 ? 0.3f : 0.6f, 0.7);
        std::vector<hard::View> views;
        for (const std::array<double, 3> eye : {std::array{1.0, 2.0, 40.0}, std::array{-35.0, 7.0, 9.0}}) {
            Camera camera;
            camera.eye = eye;
            camera.fov_deg = 25;
            views.push_back({camera, 160, 120});
        }
        std::cout << "degree " << degree << ": ";
        hard::on_tracer(false, scene.finish(), views, [](const hard::Score& score) {
            EXPECT_GT(score.hits, score.rays / 8) << score;
            EXPECT_EQ(score.false_misses, 0u) << score;
            EXPECT_EQ(score.false_hits, 0u) << score;
            EXPECT_LT(score.depth_px, 0.05) << score;
        });
    }
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace trimray
HWY_AFTER_NAMESPACE();
