// Hard case 15: a pcurve that runs beside its edge's curve in space. The deviation is measured for each edge, reported,
// and the pcurve rebuilt where it is the pcurve that is wrong.
#include "preprocess/bezier_patch.h"
#include "preprocess/import/cad_import.h"
#include "preprocess/trims/trim_curve.h"
#include "preprocess/trims/trim_report.h"
#include "tests/occt_models.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <functional>
#include <numbers>
#include <unistd.h>

namespace trimray {
namespace {

constexpr double kRadius_mm = 5;

CadModel slanted_cylinder(double shift_u, double growth_mm)
{
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / fmt::format("trimray-case-15-{}.brep", getpid());
    EXPECT_TRUE(oracle::write_slanted_cylinder(shift_u, growth_mm, path));
    Result<CadModel> model = import_cad(path, {}, {});
    std::filesystem::remove(path);
    EXPECT_TRUE(model.ok());
    return model.ok() ? std::move(*model) : CadModel{};
}

/// The rim's use on the cylinder: its only edge that is neither seam nor at z = 0.
const CadEdgeUse& rim_of(const CadModel& model, const CadFace*& cylinder)
{
    for (const CadFace& face : model.parts[0].faces)
        for (const CadLoop& loop : face.loops)
            for (const CadEdgeUse& use : loop) {
                const Vec2d uv = curve_point(use.pcurve, 0.5 * (use.first + use.last));
                if (face.surface.kind == kKindCylinder && !use.seam && evaluate(face.surface, uv.x, uv.y).p.z > 1) {
                    cylinder = &face;
                    return use;
                }
            }
    ADD_FAILURE() << "no rim";
    static const CadEdgeUse none;
    return none;
}

/// Largest distance of the points of `curve`, over [0, 1], from the rim in space, by search.
double brute_force(const std::function<Vec3d(double)>& curve, double growth_mm)
{
    // the ellipse's axes: half lengths 5 and 5 sqrt(1.25), along y and (1, 0, 1/2) / sqrt(1.25)
    const double root = std::sqrt(1.25), minor = kRadius_mm + growth_mm, major = kRadius_mm * root + growth_mm;
    const auto distance = [&](Vec3d p, double s) {
        return std::hypot(p.x - major / root * std::cos(s), p.y - minor * std::sin(s),
                          p.z - 5 - 0.5 * major / root * std::cos(s));
    };
    constexpr int kSamples = 1000;
    constexpr double kStep = 2 * std::numbers::pi / kSamples;
    double worst = 0;
    for (int i = 0; i <= 500; ++i) {
        const Vec3d p = curve(i / 500.0);
        int nearest = 0;
        for (int k = 0; k < kSamples; ++k)
            if (distance(p, k * kStep) < distance(p, nearest * kStep))
                nearest = k;
        double lo = (nearest - 1) * kStep, hi = (nearest + 1) * kStep;
        for (int step = 0; step < 80; ++step) {
            const double a = lo + (hi - lo) / 3, b = hi - (hi - lo) / 3;
            (distance(p, a) < distance(p, b) ? hi : lo) = distance(p, a) < distance(p, b) ? b : a;
        }
        worst = std::max(worst, distance(p, 0.5 * (lo + hi)));
    }
    return worst;
}

double brute_force(const CadFace& face, const CadEdgeUse& use, double growth_mm)
{
    return brute_force(
        [&](double share) {
            const Vec2d uv = curve_point(use.pcurve, use.first + share * (use.last - use.first));
            return evaluate(face.surface, uv.x, uv.y).p;
        },
        growth_mm);
}

TEST(case_15, the_reported_deviation_is_the_real_one_and_the_pcurve_is_rebuilt)
{
    for (const double shift_u : {0.1, 1e-2, 1e-3, 1e-4, 2e-5}) {
        const double real = brute_force(
            [&](double share) {
                const double s = 2 * std::numbers::pi * share;
                return Vec3d{kRadius_mm * std::cos(s + shift_u), kRadius_mm * std::sin(s + shift_u),
                             5 + 2.5 * std::cos(s)};
            },
            0);
        const CadModel model = slanted_cylinder(shift_u, 0);
        const CadFace* cylinder = nullptr;
        const CadEdgeUse& rim = rim_of(model, cylinder);
        ASSERT_TRUE(cylinder);
        EXPECT_EQ(rim.state, PcurveState::Rebuilt) << shift_u;
        EXPECT_NEAR(rim.file_deviation_mm, real, 0.01 * real) << shift_u;
        const double left = brute_force(*cylinder, rim, 0);
        EXPECT_LE(left, 1e-5) << shift_u; // well below 1e-6 of the part's 20 mm
        EXPECT_NEAR(rim.deviation_mm, left, 0.1 * left + 1e-8) << shift_u;

        const DeviationReport report = gather_deviations(model);
        EXPECT_GE(report.above_tolerance, 1u);
        EXPECT_EQ(report.rebuilt, 1u);
        ASSERT_FALSE(report.worst.empty());
        EXPECT_EQ(report.worst[0].edge, rim.edge);
        EXPECT_EQ(report.worst[0].face_in_part, cylinder->face_in_part);
        EXPECT_NEAR(report.worst[0].file_deviation_mm, real, 0.01 * real);
    }
}

TEST(case_15, a_curve_off_the_surface_is_reported_and_the_pcurve_kept)
{
    for (const double growth_mm : {1e-1, 1e-3}) {
        const CadModel model = slanted_cylinder(0, growth_mm);
        const CadFace* cylinder = nullptr;
        const CadEdgeUse& rim = rim_of(model, cylinder);
        ASSERT_TRUE(cylinder);
        const double real = brute_force(*cylinder, rim, growth_mm);
        EXPECT_GT(real, 0.8 * growth_mm);
        EXPECT_EQ(rim.state, PcurveState::OffSurface);
        EXPECT_NEAR(rim.deviation_mm, real, 0.01 * real);
        EXPECT_EQ(rim.file_deviation_mm, 0);
    }
}

TEST(case_15, an_untouched_model_has_nothing_to_report)
{
    const DeviationReport report = gather_deviations(slanted_cylinder(0, 0));
    EXPECT_LE(report.largest_mm, 1e-6);
    EXPECT_EQ(report.rebuilt, 0u);
}

} // namespace
} // namespace trimray
