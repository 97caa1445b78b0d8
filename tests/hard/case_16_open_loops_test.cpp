// Hard case 16: loops that do not close. Ends that nearly meet are moved together, wider gaps are closed by a straight
// line and reported; either way the area is off by no more than the gap calls for.
#include "preprocess/trims/trim_chain.h"
#include "preprocess/trims/trim_loop.h"
#include "tests/cad_faces.h"
#include "tests/hard/trim_modes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace trimray::hard {
namespace {

constexpr double kRadius = 0.2, kSide = 0.2;
constexpr double kLeastOpenGap = 1e-5; // of the domain: ten times the tolerance of trims; nearer ends are moved

/// The unit square with three holes, each with one gap: a square one of whose sides ends early, an arc that ends early,
/// and a square one of whose sides lies aside. All gaps are `gap` long.
CadFace plate_with_gaps(double gap)
{
    CadLoop early = polygon_loop({{0.1, 0.1}, {0.1, 0.1 + kSide}, {0.1 + kSide, 0.1 + kSide}, {0.1 + kSide, 0.1}});
    early[1] = use_of(line_curve({0.1, 0.1 + kSide}, {0.1 + kSide - gap, 0.1 + kSide}));
    // |C'| = sqrt(2) r where a quadrant begins
    CadLoop arc{use_of(circle_curve({0.7, 0.3}, kRadius, true))};
    arc[0].first = gap / (std::sqrt(2.0) * kRadius);
    CadLoop aside = polygon_loop({{0.2, 0.6}, {0.2, 0.6 + kSide}, {0.2 + kSide, 0.6 + kSide}, {0.2 + kSide, 0.6}});
    aside[2] = use_of(line_curve({0.2 + kSide + gap, 0.6 + kSide}, {0.2 + kSide + gap, 0.6}));
    return plane_face({polygon_loop({{0, 0}, {1, 0}, {1, 1}, {0, 1}}), early, arc, aside});
}

bool closed_plate(double u, double v)
{
    const bool early = u > 0.1 && u < 0.1 + kSide && v > 0.1 && v < 0.1 + kSide;
    const bool arc = std::hypot(u - 0.7, v - 0.3) < kRadius;
    const bool aside = u > 0.2 && u < 0.2 + kSide && v > 0.6 && v < 0.6 + kSide;
    return !early && !arc && !aside;
}

/// The wrong area that the gaps call for: none along a side, a segment of chord g off a circle (g^3 / 12 r, half as
/// much again for its higher terms and the chord's parameter), a strip aside; and the trims' own tolerance, 1e-6.
double bound(double gap)
{
    return 1.5 * gap * gap * gap / (12 * kRadius) + gap * kSide + 1e-6;
}

/// Area by Green's theorem; holes run clockwise.
double area_of(const TrimLoops& loops)
{
    std::vector<CurvePiece> pieces;
    for (const uint32_t word : loops.pieces) {
        const MonotonePiece m = load_piece(loops.points.data(), 0, word);
        CurvePiece& piece = pieces.emplace_back();
        piece.cubic = m.cubic;
        for (int i = 0; i < 4; ++i)
            piece.p[i] = {m.u[i], m.v[i]};
    }
    return signed_area(pieces);
}

TEST(case_16, the_wrong_area_is_bounded_by_the_gap)
{
    const double closed = 1 - 2 * kSide * kSide - M_PI * kRadius * kRadius;
    for (const double gap : {1e-12, 1e-10, 1e-8, 1e-6, 5e-6, 1e-4, 1e-3, 1e-2}) {
        const auto loops =
            build_trim_loops(plate_with_gaps(gap), {.grow = false}); // the gap alone, without the borders' growth
        ASSERT_TRUE(loops.ok());
        EXPECT_EQ(loops->loop_count, 4u);
        EXPECT_LE(std::abs(area_of(*loops) - closed), bound(gap)) << gap;
        EXPECT_EQ(loops->had_open_loop, gap > kLeastOpenGap) << gap;
        size_t open = 0;
        for (const TrimFinding& finding : loops->findings) {
            EXPECT_EQ(finding.kind, TrimFindingKind::OpenLoop);
            EXPECT_NEAR(finding.gap_mm, gap, 0.02 * gap); // the arc's speed is its first one
            ++open;
        }
        // the side that lies aside leaves a gap at both its ends
        EXPECT_EQ(open, gap > kLeastOpenGap ? 4u : 0u) << gap;
    }
}

TEST(case_16, no_mode_shows_more_than_the_gap)
{
    constexpr double kRounding_px = 0.01;
    for (const double gap : {1e-12, 1e-6, 1e-4, 1e-2}) {
        const auto loops = build_trim_loops(plate_with_gaps(gap), {});
        ASSERT_TRUE(loops.ok());
        TrimmedPlane plane = trimmed_plane(loops->points, loops->pieces, loops->loop_count);
        plane.truth = closed_plate;
        const PlaneView view;
        const double gap_px = gap / view.size * view.pixels;
        const int tested = in_every_trim_mode(plane, {view}, [&](const TrimWay& way, size_t, const TrimErrors& errors) {
            EXPECT_GT(errors.inside, 10000);
            // wrong pixels lie in the strip beside the side that lies aside, or in the segment of the arc
            const double off_px = way.exact() ? kRounding_px
                                              : plane.face().sdf_band_texels * view.pixels / view.size /
                                                    (plane.face().sdf_size & 0xffffu);
            EXPECT_LE(errors.farthest_px, gap_px + off_px) << way.name << ", gap " << gap;
            if (way.exact()) {
                const double per_pixel = view.pixels / view.size;
                EXPECT_LE(errors.wrong, bound(gap) * per_pixel * per_pixel + (gap > 1e-3 ? kSide * per_pixel : 0))
                    << way.name << ", gap " << gap;
            }
        });
        EXPECT_GE(tested, 4); // the CPU tracer has every way
    }
}

} // namespace
} // namespace trimray::hard
