// Rays through the whole chain (file, model, pack bytes, tracer) against the CAD kernel's own intersections: the CPU
// tracer's, and those of the reference that the tracers are measured with.
#include "tests/occt_models.h"
#include "tests/occt_oracle.h"
#include "tests/traced_file.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace trimray {
namespace {

constexpr uint32_t kWidth = 160, kHeight = 120;
constexpr double kFovDeg = 30;
constexpr double kRequiredShare = 0.9999;
constexpr size_t kListed = 10;

std::string model_path(const std::string& name)
{
    return std::string(TRIMRAY_TESTS_DIR) + "/models/" + name;
}

/// Two views from outside, along no axis and no diagonal.
std::vector<oracle::View> views(const oracle::Oracle& occt)
{
    std::vector<oracle::View> result;
    for (const oracle::Point& towards : {oracle::Point{0.9, -1.3, 0.8}, oracle::Point{-1.1, 0.7, -0.6}})
        result.push_back(
            oracle::frame_box(occt.lo_mm(), occt.hi_mm(), towards, {0, 0, 1}, double(kWidth) / kHeight, kFovDeg));
    return result;
}

std::vector<float> depths(Tracer& tracer, const oracle::View& view)
{
    RenderOptions options;
    options.width = kWidth;
    options.height = kHeight;
    options.camera = {view.eye, view.target, view.up, view.fov_deg};
    options.trim = TrimMode::Exact;
    options.shade = false;
    options.error_px = 1e-4f; // the dial for speed turned down: what is left is ours to explain
    return picture(tracer, options).depth_mm;
}

std::string describe(const oracle::Agreement& agreement)
{
    std::string text;
    size_t listed = 0;
    for (const oracle::Disagreement& d : agreement.disagreements) {
        if (++listed > kListed)
            break;
        text += fmt::format(
            "  pixel ({}, {}): ours {} mm, kernel {} mm, {}: {}; face {} ({}), |n.d| {:.3g}, edge at {:.3g} "
            "mm of tolerance {:.3g}\n",
            d.ray % kWidth, d.ray / kWidth, d.ours_mm, d.oracle_mm, cause_name(d.cause), d.why, d.face, d.surface,
            d.cos_incidence, d.edge_distance_mm, d.edge_tolerance_mm);
    }
    return text;
}

/// Counts of one tracer's rays over all views.
struct Counted {
    std::unique_ptr<Tracer> tracer;
    size_t rays = 0, agree = 0;
    std::string listed;
};

void expect_agreement(const std::string& path)
{
    std::string error;
    const auto occt = oracle::Oracle::load(path, {}, error);
    ASSERT_TRUE(occt) << path << ": " << error;
    const auto scene = scene_of_file(path);
    ASSERT_TRUE(scene);
    auto cpu = make_cpu_tracer(scene);
    ASSERT_TRUE(cpu.ok()) << cpu.error().detail;
    std::array<Counted, 2> both;
    both[0].tracer = std::move(*cpu);
    both[1].tracer = make_reference_tracer(scene);
    for (const oracle::View& view : views(*occt)) {
        const std::vector<oracle::Ray> view_rays = oracle::view_rays(view, kWidth, kHeight);
        const std::vector<oracle::OracleHit> hits = occt->cast(view_rays);
        for (Counted& counted : both) {
            const std::string where = path + ", " + counted.tracer->device_name();
            const std::vector<float> ours = depths(*counted.tracer, view);
            ASSERT_EQ(ours.size(), size_t(kWidth) * kHeight);
            const oracle::Agreement agreement = occt->compare(view_rays, ours, hits);
            EXPECT_GT(agreement.both_hit, agreement.rays / 50) << where << ": the view shows nothing";
            EXPECT_EQ(agreement.unexplained(), 0u) << where << "\n" << describe(agreement);
            counted.rays += agreement.rays;
            counted.agree += agreement.agree;
            counted.listed += describe(agreement);
        }
    }
    for (const Counted& counted : both)
        EXPECT_GE(double(counted.agree), kRequiredShare * double(counted.rays))
            << path << ", " << counted.tracer->device_name() << ": " << counted.rays - counted.agree << " of "
            << counted.rays << " rays disagree\n"
            << counted.listed;
}

class RaysAgainstOcct : public testing::TestWithParam<const char*> {};

TEST_P(RaysAgainstOcct, AgreeOnHitMissAndDepth)
{
    expect_agreement(model_path(GetParam()));
}

INSTANTIATE_TEST_SUITE_P(RealModels, RaysAgainstOcct,
                         testing::Values("nozzle.stp",                      // tori, cones, rational B-splines
                                         "nozzle.igs",                      // the same as an IGES solid
                                         "unit_sphere.stp",                 // octants with poles, metres
                                         "revolved_sphere.step",            // a whole sphere
                                         "io1-cm-214.stp",                  // planes, cylinders, tori
                                         "sg1-c5-214.stp",                  // planes, cylinders, cones
                                         "red_cube_blue_cylinder.step",     // two bodies, metres
                                         "mayo_332_file.stp",               // cones with their apexes
                                         "NIST_MBE_PMI_11.stp",             // rational B-splines
                                         "NIST_MBE_PMI_3.stp",              // inches, rational B-splines
                                         "abc_00000050.step",               // three roots, metres
                                         "D150WithGuides_wing.igs",         // polynomial B-splines
                                         "M6-1x12-countersunk-screw.step"), // revolutions, degree 13
                         [](const testing::TestParamInfo<const char*>& info) {
                             std::string name = info.param;
                             for (char& c : name)
                                 c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
                             return name;
                         });

TEST(RaysAgainstOcctMade, AgreeOnSweptAndOffsetSurfaces)
{
    const TemporaryFile file("swept.brep");
    ASSERT_TRUE(oracle::write_swept_model(file.path));
    expect_agreement(file.path);
}

TEST(RaysAgainstOcctMade, AgreeOnAConeThatIsNearlyFlat)
{
    const TemporaryFile file("flat_cone.brep");
    ASSERT_TRUE(oracle::write_flat_cone(file.path));
    expect_agreement(file.path);
}

TEST(RaysAgainstOcctMade, AgreeOnLeftHandedAxisSystems)
{
    const TemporaryFile file("left_handed.brep");
    ASSERT_TRUE(oracle::write_left_handed_copy(model_path("nozzle.stp"), file.path));
    expect_agreement(file.path);
}

TEST(RaysAgainstOcctMade, AgreeOnInstancesTurnedAndMirrored)
{
    const TemporaryFile file("placed.brep");
    ASSERT_TRUE(oracle::write_placed_copies(model_path("sg1-c5-214.stp"), file.path));
    expect_agreement(file.path);
}

} // namespace
} // namespace trimray
