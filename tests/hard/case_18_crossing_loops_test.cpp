// Hard case 18: loops that cross or touch themselves or each other. One rule, even-odd, decides what is inside; where
// they meet is reported.
#include "preprocess/trims/trim_loop.h"
#include "tests/cad_faces.h"
#include "tests/hard/trim_modes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>

namespace trimray::hard {
namespace {

bool in_circle(double u, double v, double centre_u, double centre_v, double radius)
{
    return std::hypot(u - centre_u, v - centre_v) < radius;
}

/// The unit square with figures cut out: a figure-eight of four lines that crosses itself at (0.25, 0.75); two circles
/// tangent from outside at (0.7, 0.8); one within another, tangent at (0.05, 0.25); two that overlap around (0.7, 0.3).
CadFace plate_with_figures()
{
    const auto circle = [](double u, double v, double radius) {
        return CadLoop{use_of(circle_curve({u, v}, radius, true))};
    };
    return plane_face({polygon_loop({{0, 0}, {1, 0}, {1, 1}, {0, 1}}),
                       polygon_loop({{0.1, 0.65}, {0.4, 0.85}, {0.4, 0.65}, {0.1, 0.85}}), circle(0.6, 0.8, 0.1),
                       circle(0.8, 0.8, 0.1), circle(0.25, 0.25, 0.2), circle(0.15, 0.25, 0.1), circle(0.65, 0.3, 0.12),
                       circle(0.75, 0.3, 0.12)});
}

/// The same by the rule: each lobe of the figure-eight is walked around once, so it is cut out; of a circle in a circle
/// the ring is, and of two that overlap what lies in one only.
bool plate(double u, double v)
{
    const bool eight = std::abs(u - 0.25) < 0.15 && std::abs(v - 0.75) < std::abs(u - 0.25) / 1.5;
    const bool outside = in_circle(u, v, 0.6, 0.8, 0.1) || in_circle(u, v, 0.8, 0.8, 0.1);
    const bool ring = in_circle(u, v, 0.25, 0.25, 0.2) != in_circle(u, v, 0.15, 0.25, 0.1);
    const bool overlap = in_circle(u, v, 0.65, 0.3, 0.12) != in_circle(u, v, 0.75, 0.3, 0.12);
    return !eight && !outside && !ring && !overlap;
}

TEST(case_18, every_mode_fills_by_the_rule)
{
    const auto loops = build_trim_loops(plate_with_figures(), {});
    ASSERT_TRUE(loops.ok());
    TrimmedPlane plane = trimmed_plane(loops->points, loops->pieces, loops->loop_count);
    plane.truth = plate;
    // the whole, and where loops meet: a pixel there is 1/16000 of the plate
    const std::vector<PlaneView> views = {{},
                                          {0.25, 0.75, 0.01},
                                          {0.7, 0.8, 0.01},
                                          {0.05, 0.25, 0.01},
                                          {0.7, 0.3 + std::sqrt(0.12 * 0.12 - 0.05 * 0.05), 0.01}};
    constexpr double kTolerance = 2e-6; // of the plate: trims as stored keep to 1e-6 of their pcurves, then rounding
    const int tested = in_every_trim_mode(plane, views, [&](const TrimWay& way, size_t view, const TrimErrors& errors) {
        EXPECT_GT(errors.inside, 100) << way.name; // between the tangent circles there is little
        if (way.exact()) {
            EXPECT_LE(errors.farthest_px, kTolerance / views[view].size * views[view].pixels) << way.name;
        } else {
            EXPECT_LE(errors.farthest_texels, plane.face().sdf_band_texels) << way.name;
        }
    });
    EXPECT_GE(tested, 4); // the CPU tracer has every way
}

TEST(case_18, what_meets_is_reported_where_it_does)
{
    const auto loops = build_trim_loops(plate_with_figures(), {.grow = false}); // the curves themselves
    ASSERT_TRUE(loops.ok());
    const double lens = std::sqrt(0.12 * 0.12 - 0.05 * 0.05);
    const struct {
        TrimFindingKind kind;
        Vec2d at;
        int loop, other;
    } expected[] = {{TrimFindingKind::CrossingLoops, {0.25, 0.75}, 1, 1},
                    {TrimFindingKind::TouchingLoops, {0.7, 0.8}, 2, 3},
                    {TrimFindingKind::TouchingLoops, {0.05, 0.25}, 4, 5},
                    {TrimFindingKind::CrossingLoops, {0.7, 0.3 + lens}, 6, 7},
                    {TrimFindingKind::CrossingLoops, {0.7, 0.3 - lens}, 6, 7}};
    std::array<bool, 5> found{};
    for (const TrimFinding& finding : loops->findings) {
        bool known = false;
        for (size_t i = 0; i < found.size(); ++i) {
            // tangent circles run beside each other within 1e-6 for sqrt(r 1e-6) of their length
            const double near = expected[i].kind == TrimFindingKind::CrossingLoops ? 1e-5 : 1e-3;
            const bool here =
                finding.kind == expected[i].kind && std::min(finding.loop, finding.other) == expected[i].loop &&
                std::max(finding.loop, finding.other) == expected[i].other &&
                std::hypot(finding.uv_file.x - expected[i].at.x, finding.uv_file.y - expected[i].at.y) < near;
            found[i] |= here;
            known |= here;
        }
        EXPECT_TRUE(known) << finding_name(finding.kind) << ": " << finding_detail(finding);
    }
    for (size_t i = 0; i < found.size(); ++i)
        EXPECT_TRUE(found[i]) << i;
}

} // namespace
} // namespace trimray::hard
