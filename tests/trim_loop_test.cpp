// Pcurves to loops of monotone pieces: the same region within the tolerance, few pieces, shared ends, seams.
#include "preprocess/trim_loop.h"

#include "tests/trim_shapes.h"

#include <gtest/gtest.h>

namespace trimray {
namespace {

using namespace shapes;

SplineCurve2d line_curve(Vec2d a, Vec2d b)
{
    return {1, false, {0, 0, 1, 1}, {{a.x, a.y, 1}, {b.x, b.y, 1}}};
}

CadEdgeUse use_of(SplineCurve2d curve, bool reversed = false)
{
    CadEdgeUse use;
    use.first = curve.knots[curve.degree];
    use.last = curve.knots[curve.control_points.size()];
    use.pcurve = std::move(curve);
    use.reversed = reversed;
    return use;
}

CadLoop polygon_loop(const std::vector<Vec2d>& corners)
{
    CadLoop loop;
    for (size_t i = 0; i < corners.size(); ++i)
        loop.push_back(use_of(line_curve(corners[i], corners[(i + 1) % corners.size()])));
    return loop;
}

/// A full circle as the kernel writes it: a rational quadratic of four quadrants.
SplineCurve2d circle_curve(Vec2d c, double r, bool clockwise = false)
{
    const double h = std::sqrt(0.5);
    const double x[9] = {1, 1, 0, -1, -1, -1, 0, 1, 1}, y[9] = {0, 1, 1, 1, 0, -1, -1, -1, 0};
    SplineCurve2d curve{2, true, {0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4}, {}};
    for (int i = 0; i < 9; ++i) {
        const double w = i % 2 == 0 ? 1 : h;
        curve.control_points.push_back({w * (c.x + r * x[i]), w * (c.y + (clockwise ? -r : r) * y[i]), w});
    }
    return curve;
}

CadFace plane_face(std::vector<CadLoop> loops)
{
    CadFace face;
    face.surface.kind = kKindPlane;
    face.surface.natural_bounds = {{-1e100, -1e100}, {1e100, 1e100}};
    face.loops = std::move(loops);
    return face;
}

CadFace cylinder_face(double radius, std::vector<CadLoop> loops)
{
    CadFace face = plane_face(std::move(loops));
    face.surface.kind = kKindCylinder;
    face.surface.radius = radius;
    face.surface.period_u = 2 * M_PI;
    face.surface.natural_bounds = {{0, -1e100}, {2 * M_PI, 1e100}};
    return face;
}

std::vector<MonotonePiece> pieces_of(const TrimLoops& loops)
{
    std::vector<MonotonePiece> pieces;
    for (const uint32_t word : loops.pieces)
        pieces.push_back(load_piece(loops.points.data(), 0, word));
    return pieces;
}

/// Area inside by the even-odd rule, in uv_file units, by rows of a fine scan: for regions, whatever their loops.
double area_of(const TrimLoops& loops, int rows = 4000)
{
    const double width = loops.domain.hi.x - loops.domain.lo.x, height = loops.domain.hi.y - loops.domain.lo.y;
    if (loops.natural_border)
        return width * height;
    const std::vector<MonotonePiece> pieces = pieces_of(loops);
    double sum = 0;
    for (int r = 0; r < rows; ++r) {
        const double v = (r + 0.5) / rows;
        std::vector<double> crossings;
        for (const MonotonePiece& p : pieces)
            if (p.v_lo() <= v && v < p.v_hi())
                crossings.push_back(u_at_v(p, v));
        std::sort(crossings.begin(), crossings.end());
        for (size_t i = 0; i + 1 < crossings.size(); i += 2)
            sum += crossings[i + 1] - crossings[i];
    }
    return sum / rows * width * height;
}

void expect_sound(const TrimLoops& loops)
{
    // chains: consecutive pieces share a point by index, loops end where they begin, bit for bit
    const size_t count = loops.points.size() / 2;
    uint32_t loop_start = 0, next = 0;
    uint32_t closed = 0;
    for (size_t i = 0; i < loops.pieces.size(); ++i) {
        const uint32_t first = loops.pieces[i] >> 2;
        if (i == 0 || first != next) {
            EXPECT_EQ(first, i == 0 ? 0 : next + 1);
            loop_start = first;
        }
        next = first + ((loops.pieces[i] & kPieceCubic) != 0 ? 3 : 1);
        ASSERT_LT(next, count);
        const bool last = i + 1 == loops.pieces.size() || (loops.pieces[i + 1] >> 2) != next;
        if (last) {
            EXPECT_EQ(loops.points[2 * next], loops.points[2 * loop_start]);
            EXPECT_EQ(loops.points[2 * next + 1], loops.points[2 * loop_start + 1]);
            ++closed;
        }
    }
    EXPECT_EQ(closed, loops.loop_count);
    for (const MonotonePiece& p : pieces_of(loops))
        for (const double* c : {p.u, p.v}) {
            EXPECT_TRUE((c[0] <= c[1] && c[1] <= c[2] && c[2] <= c[3]) ||
                        (c[0] >= c[1] && c[1] >= c[2] && c[2] >= c[3]));
            EXPECT_GE(std::min(c[0], c[3]), 0);
            EXPECT_LE(std::max(c[0], c[3]), 1);
        }
}

TEST(trim_loop, a_plate_with_a_hole_keeps_its_area)
{
    const auto loops = build_trim_loops(
        plane_face({polygon_loop({{0, 0}, {10, 0}, {10, 5}, {0, 5}}), {use_of(circle_curve({4, 2}, 1))}}), {});
    ASSERT_TRUE(loops.ok());
    expect_sound(*loops);
    EXPECT_NEAR(area_of(*loops), 50 - M_PI, 1e-4);
    EXPECT_LE(loops->largest_deviation, 1e-6);
    EXPECT_FALSE(loops->had_open_loop);
    EXPECT_EQ(loops->loop_count, 2u);
}

TEST(trim_loop, a_disc_needs_three_cubics_a_quadrant_at_most)
{
    const auto loops = build_trim_loops(plane_face({{use_of(circle_curve({3, 3}, 2))}}), {});
    ASSERT_TRUE(loops.ok());
    expect_sound(*loops);
    EXPECT_NEAR(area_of(*loops), 4 * M_PI, 1e-4);
    EXPECT_LE(loops->pieces.size(), 12u);
    EXPECT_LE(loops->largest_deviation, 1e-6);
}

TEST(trim_loop, a_rectangle_is_its_domain_whatever_the_number_of_its_edges)
{
    const auto loops = build_trim_loops(
        plane_face({polygon_loop({{0, 0}, {3, 0}, {7, 1e-9}, {10, 0}, {10, 2}, {10, 5}, {5, 5}, {0, 5}, {1e-8, 3}})}),
        {});
    ASSERT_TRUE(loops.ok());
    EXPECT_TRUE(loops->natural_border);
    EXPECT_TRUE(loops->pieces.empty());
    EXPECT_NEAR(area_of(*loops), 50, 1e-6);
}

TEST(trim_loop, a_cylinder_with_its_seam_edges_is_its_domain)
{
    const double p = 2 * M_PI;
    CadLoop loop = polygon_loop({{0, 0}, {p, 0}, {p, 3}, {0, 3}});
    loop[1].seam = loop[3].seam = true;
    const auto loops = build_trim_loops(cylinder_face(2, {loop}), {});
    ASSERT_TRUE(loops.ok());
    EXPECT_TRUE(loops->natural_border);
    EXPECT_NEAR(area_of(*loops), 3 * p, 1e-6);
}

TEST(trim_loop, two_circles_around_a_cylinder_without_a_seam_bound_the_band_between)
{
    const double p = 2 * M_PI;
    for (const double start : {0.0, 1.0, 5.0}) {
        const CadLoop bottom{use_of(line_curve({0, 1}, {p, 1}))}, top{use_of(line_curve({start + p, 4}, {start, 4}))};
        const auto loops = build_trim_loops(cylinder_face(2, {bottom, top}), {});
        ASSERT_TRUE(loops.ok());
        EXPECT_TRUE(loops->natural_border);
        EXPECT_NEAR(area_of(*loops), 3 * p, 1e-6);
    }
}

TEST(trim_loop, a_hole_across_a_cylinders_seam_has_the_same_area_at_sixteen_rotations)
{
    const double p = 2 * M_PI;
    for (int i = 0; i < 16; ++i) {
        const double turn = p * i / 16;
        const auto seamed = build_trim_loops(cylinder_face(2, {polygon_loop({{0, 0}, {p, 0}, {p, 3}, {0, 3}}),
                                                               {use_of(circle_curve({turn, 1.5}, 1, true))}}),
                                             {});
        ASSERT_TRUE(seamed.ok());
        expect_sound(*seamed);
        EXPECT_NEAR(area_of(*seamed), 3 * p - M_PI, 2e-4) << i;
        EXPECT_NEAR(seamed->domain.hi.x - seamed->domain.lo.x, p, 1e-9);
        // and where only circles around bound the band
        const auto seamless = build_trim_loops(cylinder_face(2, {{use_of(line_curve({0, 0}, {p, 0}))},
                                                                 {use_of(line_curve({p, 3}, {0, 3}))},
                                                                 {use_of(circle_curve({turn, 1.5}, 1, true))}}),
                                               {});
        ASSERT_TRUE(seamless.ok());
        EXPECT_NEAR(area_of(*seamless), 3 * p - M_PI, 2e-4) << i;
    }
}

} // namespace
} // namespace trimray
