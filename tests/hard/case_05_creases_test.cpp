// Hard case 5: creases inside of a surface, where a knot's multiplicity is the degree, and knots that come oftener
// still.
#include "tests/hard/closest_hits.h"
#include "tests/spline_model.h"

#include <cmath>

namespace trimray::hard {
namespace {

/// A bicubic face of 100 mm by 100 mm over the given inner knots along u; zigzag along x. Knots of multiplicity 3 are
/// creases, of 4 cuts whose two sides have the same points.
CadModel zigzag(const std::vector<double>& inner_knots)
{
    CadFace face = spline_face({{0, 0}, {1, 1}});
    SplineSurface& s = face.surface.spline;
    s.degree_u = s.degree_v = 3;
    s.knots_u = {0, 0, 0, 0};
    s.knots_u.insert(s.knots_u.end(), inner_knots.begin(), inner_knots.end());
    s.knots_u.insert(s.knots_u.end(), 4, 1);
    s.knots_v = {0, 0, 0, 0, 0.5, 0.5, 0.5, 1, 1, 1, 1};
    s.count_u = int(s.knots_u.size()) - 4;
    s.count_v = int(s.knots_v.size()) - 4;
    const auto fold = [](double t, double period) { return std::abs(t / period - std::round(t / period)); };
    for (int i = 0; i < s.count_u; ++i) {
        // Greville points: folds of the net lie at the knots
        const double u = (s.knots_u[size_t(i) + 1] + s.knots_u[size_t(i) + 2] + s.knots_u[size_t(i) + 3]) / 3;
        for (int j = 0; j < s.count_v; ++j) {
            const double v = (s.knots_v[size_t(j) + 1] + s.knots_v[size_t(j) + 2] + s.knots_v[size_t(j) + 3]) / 3;
            s.control_points.push_back({100 * u - 50, 100 * v - 50, 40 * fold(u, 0.5) + 30 * fold(v, 1), 1});
        }
    }
    return model_of(face);
}

TEST(case_05, creases_are_borders_of_patches_without_a_crack)
{
    struct Case {
        std::vector<double> knots;
        size_t patches; // two rows of them: v has a triple knot
    };
    for (const Case& c : {Case{{0.25, 0.25, 0.25, 0.5, 0.5, 0.5, 0.75, 0.75, 0.75}, 8},
                          Case{{0.25, 0.25, 0.25, 0.25, 0.5, 0.5, 0.5, 0.5, 0.75}, 8}, // cuts
                          Case{{0.25, 0.25, 0.25, 0.2500000001, 0.5, 0.5, 0.5}, 8}}) { // a span that is nearly empty
        BuildReport report;
        const auto scene = converted(zigzag(c.knots), report);
        const PackImage& image = scene->pack.image;
        EXPECT_EQ(image.dropped.size(), 0u);
        EXPECT_EQ(image.patches.size(), c.patches);
        for (const PatchRecord& patch : image.patches)
            EXPECT_GT(patch.scale, 0.0f);
        std::vector<View> views;
        // whole; the crease along v; and a close-up of where creases cross, with pixels of 1e-3 mm
        for (const auto& [eye, fov] : {std::pair{std::array{30.0, -120.0, 90.0}, 55.0},
                                       {std::array{4.0, -90.0, 6.0}, 10.0},
                                       {std::array{10.0, -60.0, 120.0}, 0.08}}) {
            Camera camera;
            camera.eye = eye;
            camera.target = {0, 0, fov < 1 ? 15 : 0.0};
            camera.fov_deg = fov;
            views.push_back({camera, 192, 144});
        }
        on_both_tracers(scene, views, [](const Score& score) {
            EXPECT_GT(score.hits, score.rays / 4) << score;
            EXPECT_EQ(score.false_misses, 0u) << score;
            EXPECT_EQ(score.false_hits, 0u) << score;
            EXPECT_LT(score.depth_px, 0.5) << score;
        });
    }
}

} // namespace
} // namespace trimray::hard
