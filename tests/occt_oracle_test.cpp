// The oracle itself: a check that could not fail would prove nothing.
#include "tests/occt_models.h"
#include "tests/occt_oracle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <unistd.h>

namespace trimray {
namespace {

constexpr uint32_t kWidth = 160, kHeight = 120;

std::string model_path(const std::string& name)
{
    return std::string(TRIMRAY_TESTS_DIR) + "/models/" + name;
}

oracle::View outside_view(const oracle::Oracle& occt)
{
    return oracle::frame_box(occt.lo_mm(), occt.hi_mm(), {0.9, -1.3, 0.8}, {0, 0, 1}, double(kWidth) / kHeight, 30);
}

TEST(OcctOracle, HitsASphereWhereTheFormulaSays)
{
    std::string error;
    const auto occt = oracle::Oracle::load(model_path("revolved_sphere.step"), {}, error);
    ASSERT_TRUE(occt) << error;
    const oracle::View view = outside_view(*occt);
    const auto rays = oracle::view_rays(view, kWidth, kHeight);
    const auto hits = occt->cast(rays);
    oracle::Point center{};
    double radius = 0;
    for (int k = 0; k < 3; ++k)
        center[k] = (occt->lo_mm()[k] + occt->hi_mm()[k]) / 2;
    radius = (occt->hi_mm()[0] - occt->lo_mm()[0]) / 2;
    size_t hit_count = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
        // |o + t d - c| = r:  t = -b - sqrt(b^2 - q),  b = (o - c).d,  q = |o - c|^2 - r^2
        double b = 0, q = -radius * radius;
        for (int k = 0; k < 3; ++k) {
            const double oc = rays[i].origin[k] - center[k];
            b += oc * rays[i].direction[k];
            q += oc * oc;
        }
        const double root = b * b - q;
        if (std::abs(root) < 1e-4 * radius * radius)
            continue; // the rim
        ASSERT_EQ(hits[i].hit(), root > 0) << i;
        if (root > 0) {
            ++hit_count;
            ASSERT_NEAR(hits[i].distance_mm, -b - std::sqrt(root), 1e-4 * radius) << i;
        }
    }
    EXPECT_GT(hit_count, rays.size() / 10);
}

TEST(OcctOracle, CallsAHoleAndAFalseFaceUnexplained)
{
    std::string error;
    const auto occt = oracle::Oracle::load(model_path("nozzle.stp"), {}, error);
    ASSERT_TRUE(occt) << error;
    const auto rays = oracle::view_rays(outside_view(*occt), kWidth, kHeight);
    const auto hits = occt->cast(rays);
    std::vector<float> ours;
    for (const oracle::OracleHit& hit : hits)
        ours.push_back(float(hit.distance_mm));
    EXPECT_EQ(occt->compare(rays, ours, hits).agree, rays.size());

    // a hole of one pixel in the middle of a face, far from edges; a false face in the empty corner
    size_t holes = 0;
    for (size_t i = 0; i < rays.size() && holes < 20; i += 97)
        if (hits[i].hit()) {
            ours[i] = std::numeric_limits<float>::infinity();
            ++holes;
        }
    ASSERT_FALSE(hits[0].hit());
    ours[0] = float(occt->diagonal_mm());
    const oracle::Agreement agreement = occt->compare(rays, ours, hits);
    EXPECT_GT(holes, 3u);
    EXPECT_EQ(agreement.agree, rays.size() - holes - 1);
    EXPECT_EQ(agreement.unexplained(), holes + 1);
}

TEST(OcctModels, KeepTheirFacesInTheFile)
{
    const std::string path =
        (std::filesystem::temp_directory_path() / ("trimray_made_" + std::to_string(getpid()) + ".brep")).string();
    const auto faces = [&] {
        std::string error;
        const auto occt = oracle::Oracle::load(path, {}, error);
        std::filesystem::remove(path);
        return occt ? std::pair(occt->unique_faces(), occt->placed_faces()) : std::pair(size_t(0), size_t(0));
    };
    ASSERT_TRUE(oracle::write_swept_model(path));
    EXPECT_EQ(faces(), std::pair(size_t(4), size_t(4)));
    ASSERT_TRUE(oracle::write_left_handed_copy(model_path("nozzle.stp"), path));
    EXPECT_EQ(faces(), std::pair(size_t(14), size_t(14)));
    ASSERT_TRUE(oracle::write_placed_copies(model_path("sg1-c5-214.stp"), path));
    EXPECT_EQ(faces(), std::pair(size_t(16), size_t(48)));
}

} // namespace
} // namespace trimray
