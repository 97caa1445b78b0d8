// Pcurves to loops of monotone pieces: the same region within the tolerance, few pieces, shared ends, seams.
#include "preprocess/trims/trim_loop.h"

#include "tests/cad_faces.h"
#include "tests/trim_shapes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trimray {
namespace {

using namespace shapes;

/// Loops as the pcurves say, to compare with what is known of them.
constexpr TrimOptions kNotGrown{.grow = false};

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
        const uint32_t first = loops.pieces[i] >> kPiecePointShift;
        if (i == 0 || first != next) {
            EXPECT_EQ(first, i == 0 ? 0 : next + 1);
            loop_start = first;
        }
        next = first + ((loops.pieces[i] & kPieceCubic) != 0 ? 3 : 1);
        ASSERT_LT(next, count);
        const bool last = i + 1 == loops.pieces.size() || (loops.pieces[i + 1] >> kPiecePointShift) != next;
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
        plane_face({polygon_loop({{0, 0}, {10, 0}, {10, 5}, {0, 5}}), {use_of(circle_curve({4, 2}, 1))}}), kNotGrown);
    ASSERT_TRUE(loops.ok());
    expect_sound(*loops);
    EXPECT_NEAR(area_of(*loops), 50 - M_PI, 1e-4);
    EXPECT_LE(loops->largest_deviation, 1e-6);
    EXPECT_FALSE(loops->had_open_loop);
    EXPECT_EQ(loops->loop_count, 2u);
}

TEST(trim_loop, a_disc_needs_three_cubics_a_quadrant_at_most)
{
    const auto loops = build_trim_loops(plane_face({{use_of(circle_curve({3, 3}, 2))}}), kNotGrown);
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
        kNotGrown);
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
    const auto loops = build_trim_loops(cylinder_face(2, {loop}), kNotGrown);
    ASSERT_TRUE(loops.ok());
    EXPECT_TRUE(loops->natural_border);
    EXPECT_NEAR(area_of(*loops), 3 * p, 1e-6);
}

TEST(trim_loop, two_circles_around_a_cylinder_without_a_seam_bound_the_band_between)
{
    const double p = 2 * M_PI;
    for (const double start : {0.0, 1.0, 5.0}) {
        const CadLoop bottom{use_of(line_curve({0, 1}, {p, 1}))}, top{use_of(line_curve({start + p, 4}, {start, 4}))};
        const auto loops = build_trim_loops(cylinder_face(2, {bottom, top}), kNotGrown);
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
                                             kNotGrown);
        ASSERT_TRUE(seamed.ok());
        expect_sound(*seamed);
        EXPECT_NEAR(area_of(*seamed), 3 * p - M_PI, 2e-4) << i;
        EXPECT_NEAR(seamed->domain.hi.x - seamed->domain.lo.x, p, 1e-9);
        // and where only circles around bound the band
        const auto seamless = build_trim_loops(cylinder_face(2, {{use_of(line_curve({0, 0}, {p, 0}))},
                                                                 {use_of(line_curve({p, 3}, {0, 3}))},
                                                                 {use_of(circle_curve({turn, 1.5}, 1, true))}}),
                                               kNotGrown);
        ASSERT_TRUE(seamless.ok());
        EXPECT_NEAR(area_of(*seamless), 3 * p - M_PI, 2e-4) << i;
    }
}

/// A clamped cubic B-spline of `segments` segments through samples of a function (Hermite, C1: double knots).
template <class Point, class Slope>
SplineCurve2d many_segments(int segments, Point point, Slope slope, double noise = 0)
{
    std::mt19937 rng(11);
    std::uniform_real_distribution<double> uniform(-noise, noise);
    SplineCurve2d curve{3, false, {0, 0, 0, 0}, {}};
    const double h = 1.0 / segments;
    for (int i = 0; i <= segments; ++i) {
        const double t = i * h;
        Vec2d p = point(t);
        const Vec2d d = slope(t);
        p.x += i > 0 && i < segments ? uniform(rng) : 0;
        p.y += i > 0 && i < segments ? uniform(rng) : 0;
        if (i > 0)
            curve.control_points.push_back({p.x - h / 3 * d.x, p.y - h / 3 * d.y, 1});
        if (i == 0 || i == segments)
            curve.control_points.push_back({p.x, p.y, 1});
        if (i < segments)
            curve.control_points.push_back({p.x + h / 3 * d.x, p.y + h / 3 * d.y, 1});
        if (i > 0)
            curve.knots.insert(curve.knots.end(), i < segments ? 2 : 4, t);
    }
    return curve;
}

TEST(trim_loop, a_curve_of_a_hundred_thousand_segments_becomes_few_pieces_within_the_tolerance)
{
    for (const double noise : {0.0, 1e-7}) {
        const auto wave = [](double t) { return Vec2d{10 * t, std::sin(9 * t)}; };
        const auto slope = [](double t) { return Vec2d{10, 9 * std::cos(9 * t)}; };
        CadLoop loop{use_of(many_segments(100000, wave, slope, noise))};
        for (const CadEdgeUse& use : polygon_loop({wave(1), {10, 5}, {0, 5}, {0, 0}}))
            loop.push_back(use);
        loop.pop_back();
        const auto loops = build_trim_loops(plane_face({loop}), kNotGrown);
        ASSERT_TRUE(loops.ok());
        expect_sound(*loops);
        EXPECT_LE(loops->pieces.size(), 40u) << "noise " << noise;
        EXPECT_LE(loops->largest_deviation, 1e-6);
        // the area under the wave is known, and the curve itself lies on the pieces
        const double under = 10 * (1 - std::cos(9.0)) / 9;
        EXPECT_NEAR(area_of(*loops), 50 - under, 1e-3);
        const std::vector<MonotonePiece> pieces = pieces_of(*loops);
        const Vec2d lo = loops->domain.lo, size{loops->domain.hi.x - lo.x, loops->domain.hi.y - lo.y};
        for (int i = 0; i <= 2000; ++i) {
            const Vec2d p = wave(i / 2000.0);
            EXPECT_LE(exact_distance(pieces, (p.x - lo.x) / size.x, (p.y - lo.y) / size.y, size.x, size.y), 1.3e-5)
                << "at " << i;
        }
    }
}

TEST(trim_loop, collinear_segments_become_one_line)
{
    const auto line = [](double t) { return Vec2d{8 * t, 3 * t}; };
    const auto slope = [](double) { return Vec2d{8, 3}; };
    CadLoop loop{use_of(many_segments(50000, line, slope, 1e-9))};
    loop.push_back(use_of(line_curve({8, 3}, {6, 5})));
    loop.push_back(use_of(line_curve({6, 5}, {4, 7})));
    loop.push_back(use_of(line_curve({4, 7}, {0, 0})));
    const auto loops = build_trim_loops(plane_face({loop}), kNotGrown);
    ASSERT_TRUE(loops.ok());
    expect_sound(*loops);
    EXPECT_EQ(loops->pieces.size(), 3u);
}

TEST(trim_loop, circles_of_every_size_stay_within_the_tolerance)
{
    for (const double radius : {4.9, 1.0, 0.1, 0.01, 0.001}) {
        const auto loops = build_trim_loops(
            plane_face({polygon_loop({{0, 0}, {10, 0}, {10, 10}, {0, 10}}), {use_of(circle_curve({5, 5}, radius))}}),
            kNotGrown);
        ASSERT_TRUE(loops.ok());
        expect_sound(*loops);
        for (const MonotonePiece& p : pieces_of(*loops)) {
            if (!p.cubic)
                continue;
            for (int i = 0; i <= 50; ++i) {
                const double r = std::hypot(bezier3(p.u, i / 50.0) - 0.5, bezier3(p.v, i / 50.0) - 0.5);
                EXPECT_NEAR(r, radius / 10, 1.2e-6) << "radius " << radius; // and the rounding of floats
            }
        }
    }
}

TEST(trim_loop, uses_out_of_order_and_turned_around_are_put_right)
{
    std::mt19937 rng(2);
    const std::vector<Vec2d> corners = {{0, 0}, {4, 1}, {7, 0}, {9, 3}, {6, 6}, {5, 3}, {2, 5}, {-1, 3}};
    const double area = area_of(*build_trim_loops(plane_face({polygon_loop(corners)}), kNotGrown));
    for (int i = 0; i < 50; ++i) {
        CadLoop loop = polygon_loop(corners);
        std::shuffle(loop.begin(), loop.end(), rng);
        for (CadEdgeUse& use : loop)
            use.reversed = rng() % 2 == 0;
        const auto loops = build_trim_loops(plane_face({loop}), kNotGrown);
        ASSERT_TRUE(loops.ok());
        expect_sound(*loops);
        EXPECT_FALSE(loops->had_open_loop);
        EXPECT_NEAR(area_of(*loops), area, 1e-6);
    }
}

TEST(trim_loop, gaps_are_closed_and_reported)
{
    for (const double gap : {1e-12, 1e-8, 1e-6, 9e-6, 1e-4, 1e-3, 1e-2}) {
        CadLoop loop = polygon_loop({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
        loop[1] = use_of(line_curve({1, gap}, {1 - gap, 1}));
        const auto loops = build_trim_loops(plane_face({loop}), kNotGrown);
        ASSERT_TRUE(loops.ok());
        expect_sound(*loops);
        EXPECT_NEAR(loops->largest_gap, gap, 1e-3 * gap + 1e-15);
        EXPECT_EQ(loops->had_open_loop, gap > 1e-5) << gap;
        EXPECT_NEAR(area_of(*loops), 1, gap + 1e-6);
    }
}

TEST(trim_loop, ends_within_the_tolerance_meet_where_their_curves_do)
{
    constexpr double kTolerance = 0.05;
    // sides of a square that end beyond its corners, or before them, or one of each
    for (const double at_start : {-0.04, 0.03})
        for (const double at_end : {-0.02, 0.04}) {
            const std::vector<Vec2d> corners{{0, 0}, {10, 1}, {9, 11}, {-1, 10}};
            CadLoop loop;
            for (size_t i = 0; i < 4; ++i) {
                const Vec2d a = corners[i], b = corners[(i + 1) % 4];
                const auto at = [&](double t) { return Vec2d{a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)}; };
                loop.push_back(use_of(line_curve(at(at_start / 10), at(1 + at_end / 10))));
            }
            CadFace face = plane_face({loop});
            face.tolerance_mm = kTolerance;
            const auto loops = build_trim_loops(face, kNotGrown);
            ASSERT_TRUE(loops.ok());
            expect_sound(*loops);
            EXPECT_FALSE(loops->had_open_loop);
            EXPECT_EQ(loops->pieces.size(), 4u);
            EXPECT_NEAR(area_of(*loops), 101, 1e-4) << at_start << " " << at_end;
        }
    // two half discs' arcs that run on past each other: a lens of two circles of radius 5, 6 apart
    const auto arc = [](Vec2d c, double from, double to) {
        const double middle = 0.5 * (from + to), w = std::cos(0.5 * (to - from));
        return SplineCurve2d{2,
                             true,
                             {0, 0, 0, 1, 1, 1},
                             {{c.x + 5 * std::cos(from), c.y + 5 * std::sin(from), 1},
                              {w * c.x + 5 * std::cos(middle), w * c.y + 5 * std::sin(middle), w},
                              {c.x + 5 * std::cos(to), c.y + 5 * std::sin(to), 1}}};
    };
    const double half = std::acos(0.6), beyond = 0.008;
    CadFace lens = plane_face({{use_of(arc({-3, 0}, -half - beyond, half + beyond)),
                                use_of(arc({3, 0}, M_PI - half - beyond, M_PI + half + beyond))}});
    lens.tolerance_mm = kTolerance;
    const auto loops = build_trim_loops(lens, kNotGrown);
    ASSERT_TRUE(loops.ok());
    expect_sound(*loops);
    EXPECT_FALSE(loops->had_open_loop);
    EXPECT_NEAR(area_of(*loops), 50 * half - 24, 1e-3);
}

TEST(trim_loop, a_side_that_turns_back_on_itself_is_one_side)
{
    for (const bool grow : {false, true}) {
        CadFace face = plane_face({polygon_loop({{0, 0}, {6, 0}, {5, 0}, {10, 0}, {10, 5}, {0, 5}})});
        for (CadEdgeUse& use : face.loops[0])
            use.gap_mm = 1e-3;
        const auto loops = build_trim_loops(face, {.grow = grow});
        ASSERT_TRUE(loops.ok());
        EXPECT_TRUE(loops->natural_border);
        EXPECT_EQ(loops->findings.size(), 0u);
    }
}

CadFace sphere_face(std::vector<CadLoop> loops)
{
    CadFace face = plane_face(std::move(loops));
    face.surface = sphere_surface(3);
    return face;
}

TEST(trim_loop, a_circle_around_a_sphere_bounds_the_cap_on_its_left)
{
    const double p = 2 * M_PI, pole = M_PI / 2;
    const auto north = build_trim_loops(sphere_face({{use_of(line_curve({0, 0.3}, {p, 0.3}))}}), kNotGrown);
    ASSERT_TRUE(north.ok());
    EXPECT_TRUE(north->natural_border);
    EXPECT_NEAR(area_of(*north), p * (pole - 0.3), 1e-9);
    const auto south = build_trim_loops(sphere_face({{use_of(line_curve({p, 0.3}, {0, 0.3}))}}), kNotGrown);
    ASSERT_TRUE(south.ok());
    EXPECT_NEAR(area_of(*south), p * (pole + 0.3), 1e-9);
}

TEST(trim_loop, a_sphere_of_seams_and_poles_is_its_domain_with_or_without_the_poles_edges)
{
    const double p = 2 * M_PI, h = M_PI / 2;
    CadLoop loop = polygon_loop({{p, -h}, {p, h}, {0, h}, {0, -h}});
    loop[0].seam = loop[2].seam = true;
    loop[1].degenerate = loop[3].degenerate = true;
    const auto whole = build_trim_loops(sphere_face({loop}), kNotGrown);
    ASSERT_TRUE(whole.ok());
    EXPECT_TRUE(whole->natural_border);
    const auto bare = build_trim_loops(sphere_face({{loop[0], loop[2]}}), kNotGrown);
    ASSERT_TRUE(bare.ok());
    EXPECT_TRUE(bare->natural_border);
    EXPECT_FALSE(bare->had_open_loop); // a pole is one point
    EXPECT_NEAR(area_of(*bare), p * 2 * h, 1e-9);
}

TEST(trim_loop, a_hole_alone_on_a_closed_surface_leaves_the_rest_of_it)
{
    const double whole = 2 * M_PI * M_PI;
    for (const double at : {0.0, 3.0}) { // across the seam, and not
        const auto loops = build_trim_loops(sphere_face({{use_of(circle_curve({at, 0.1}, 0.5, true))}}), kNotGrown);
        ASSERT_TRUE(loops.ok());
        expect_sound(*loops);
        EXPECT_NEAR(area_of(*loops), whole - M_PI * 0.25, 1e-4);
        const auto patch = build_trim_loops(sphere_face({{use_of(circle_curve({at, 0.1}, 0.5))}}), kNotGrown);
        ASSERT_TRUE(patch.ok());
        EXPECT_NEAR(area_of(*patch), M_PI * 0.25, 1e-4);
    }
}

CadFace torus_face(double radius, double minor_radius, std::vector<CadLoop> loops)
{
    CadFace face = plane_face(std::move(loops));
    face.surface = torus_surface(radius, minor_radius);
    return face;
}

TEST(trim_loop, a_torus_with_one_of_its_seams_is_whole_however_many_edges_the_seam_has)
{
    const double p = 2 * M_PI;
    for (const bool along_v : {true, false})
        for (const int edges : {1, 2, 3})
            for (int first = 0; first < 2 * edges; ++first) {
                const auto at = [&](double across, double along) {
                    return along_v ? Vec2d{across, along} : Vec2d{p - across, along};
                };
                const auto swapped = [&](Vec2d q) { return along_v ? q : Vec2d{q.y, q.x}; };
                CadLoop loop; // up at the far end, down at the near one
                for (int i = 0; i < edges; ++i)
                    loop.push_back(
                        use_of(line_curve(swapped(at(p, p * i / edges)), swapped(at(p, p * (i + 1) / edges)))));
                for (int i = edges; i-- > 0;)
                    loop.push_back(
                        use_of(line_curve(swapped(at(0, p * i / edges)), swapped(at(0, p * (i + 1) / edges))), true));
                std::rotate(loop.begin(), loop.begin() + first, loop.end());
                CadFace face = torus_face(5, 1, {loop});
                for (CadEdgeUse& use : face.loops[0]) {
                    const auto& c = use.pcurve.control_points;
                    const double along = along_v ? std::min(c[0][1], c[1][1]) : std::min(c[0][0], c[1][0]);
                    use.seam = true;
                    use.edge = static_cast<uint32_t>(std::lround(along * edges / p));
                }
                const auto whole = build_trim_loops(face, kNotGrown);
                ASSERT_TRUE(whole.ok()) << along_v << " " << edges << " " << first;
                EXPECT_TRUE(whole->natural_border) << along_v << " " << edges << " " << first;
                EXPECT_TRUE(whole->findings.empty()) << along_v << " " << edges << " " << first;
                EXPECT_NEAR(area_of(*whole), p * p, 1e-9);
            }
}

TEST(trim_loop, a_cut_into_a_cylinder_along_its_seam_leaves_it_whole)
{
    const double p = 2 * M_PI;
    CadFace face = cylinder_face(2, {{use_of(line_curve({0, 0}, {p, 0})), use_of(line_curve({p, 0}, {p, 1})),
                                      use_of(line_curve({0, 0}, {0, 1}), true)},
                                     {use_of(line_curve({p, 3}, {0, 3}))}});
    for (const size_t i : {1, 2}) {
        face.loops[0][i].seam = true;
        face.loops[0][i].edge = 7;
    }
    const auto loops = build_trim_loops(face, kNotGrown);
    ASSERT_TRUE(loops.ok()) << loops.error().detail;
    EXPECT_FALSE(loops->had_open_loop);
    EXPECT_NEAR(area_of(*loops), 3 * p, 1e-6);
}

TEST(trim_loop, a_band_around_a_torus_lies_on_the_side_its_circles_say)
{
    const double p = 2 * M_PI;
    CadFace face = torus_face(5, 1, {{use_of(line_curve({0, 1}, {p, 1}))}, {use_of(line_curve({p, 2.5}, {0, 2.5}))}});
    const auto inner = build_trim_loops(face, kNotGrown);
    ASSERT_TRUE(inner.ok());
    EXPECT_NEAR(area_of(*inner), p * 1.5, 1e-9);
    for (CadLoop& loop : face.loops)
        loop[0].reversed = true;
    const auto outer = build_trim_loops(face, kNotGrown);
    ASSERT_TRUE(outer.ok());
    EXPECT_NEAR(area_of(*outer), p * (p - 1.5), 1e-9);
    // around the small way
    face.loops = {{use_of(line_curve({1, 0}, {1, p}))}, {use_of(line_curve({2, p}, {2, 0}))}};
    const auto other = build_trim_loops(face, kNotGrown);
    ASSERT_TRUE(other.ok());
    EXPECT_NEAR(area_of(*other), p * (p - 1), 1e-9); // left of the upward circle at u = 1, right of u = 2
}

TEST(trim_loop, the_inner_sheet_of_a_spindle_torus_between_its_poles_is_its_domain)
{
    // R + r cos v = 0 at both ends: the circles there have no length, the widest one lies between
    const double lo = 2 * M_PI / 3, hi = 4 * M_PI / 3;
    const CadFace face = torus_face(1, 2, {polygon_loop({{M_PI, lo}, {2 * M_PI, lo}, {2 * M_PI, hi}, {M_PI, hi}})});
    const Result<TrimLoops> loops = build_trim_loops(face, kNotGrown);
    ASSERT_TRUE(loops.ok()) << loops.error().detail;
    EXPECT_TRUE(loops->natural_border);
    EXPECT_DOUBLE_EQ(loops->domain.hi.x - loops->domain.lo.x, M_PI);
    EXPECT_DOUBLE_EQ(loops->domain.hi.y - loops->domain.lo.y, hi - lo);
}

TEST(trim_loop, a_thread_of_many_turns_is_wrapped_into_one)
{
    const double p = 2 * M_PI, turns = 5, pitch = 1, width = 0.4;
    const auto loops = build_trim_loops(
        cylinder_face(
            2, {polygon_loop({{0, 0}, {turns * p, turns * pitch}, {turns * p, turns * pitch + width}, {0, width}})}),
        kNotGrown);
    ASSERT_TRUE(loops.ok());
    expect_sound(*loops);
    EXPECT_NEAR(loops->domain.hi.x - loops->domain.lo.x, p, 1e-9);
    EXPECT_NEAR(area_of(*loops), turns * p * width, 1e-3);
}

TEST(trim_loop, a_loop_that_crosses_itself_is_filled_by_even_odd)
{
    const auto eight = build_trim_loops(plane_face({polygon_loop({{0, 0}, {2, 2}, {2, 0}, {0, 2}})}), kNotGrown);
    ASSERT_TRUE(eight.ok());
    EXPECT_NEAR(area_of(*eight), 2, 1e-6);
}

TEST(trim_loop, every_orientation_of_nested_loops_is_the_same_region)
{
    for (int mask = 0; mask < 8; ++mask) {
        std::vector<CadLoop> loops = {polygon_loop({{0, 0}, {10, 0}, {10, 10}, {0, 10}}),
                                      {use_of(circle_curve({5, 5}, 4))},
                                      {use_of(circle_curve({5, 5}, 2))}};
        for (int i = 0; i < 3; ++i)
            if ((mask >> i & 1) != 0)
                loops[static_cast<size_t>(i)] = turned(loops[static_cast<size_t>(i)]);
        const auto built = build_trim_loops(plane_face(loops), kNotGrown);
        ASSERT_TRUE(built.ok());
        expect_sound(*built);
        EXPECT_NEAR(area_of(*built), 100 - 12 * M_PI, 1e-3);
    }
}

TEST(trim_loop, what_cannot_bound_a_face_is_refused_with_a_reason)
{
    const auto detail = [](const CadFace& face) {
        const auto loops = build_trim_loops(face, kNotGrown);
        EXPECT_FALSE(loops.ok());
        if (!loops.ok()) {
            EXPECT_EQ(loops.error().code, ErrorCode::InvalidTrim);
        }
        return loops.ok() ? std::string() : loops.error().detail;
    };
    EXPECT_THAT(detail(plane_face({})), testing::HasSubstr("natural bounds"));
    EXPECT_THAT(detail(plane_face({polygon_loop({{0, 0}, {1, 1}})})), testing::HasSubstr("no area"));
    EXPECT_THAT(detail(plane_face({polygon_loop({{0, 0}, {1, 0}, {2, 0}})})), testing::HasSubstr("no area"));
    EXPECT_THAT(detail(plane_face({polygon_loop({{0, 0}, {1, NAN}, {1, 1}})})), testing::HasSubstr("not finite"));
    EXPECT_THAT(detail(plane_face({polygon_loop({{0, 0}, {1, INFINITY}, {1, 1}})})), testing::HasSubstr("not finite"));
    CadFace bad = plane_face({polygon_loop({{0, 0}, {1, 0}, {1, 1}})});
    bad.loops[0][1].pcurve.knots.pop_back();
    EXPECT_THAT(detail(bad), testing::HasSubstr("knots"));
    EXPECT_THAT(detail(cylinder_face(1, {{use_of(line_curve({0, 0}, {2 * M_PI, 0}))}})), testing::HasSubstr("no area"));
    EXPECT_THAT(detail(cylinder_face(1, {{use_of(line_curve({0, 0}, {4 * M_PI, 1}))}})),
                testing::HasSubstr("more than once"));
}

} // namespace
} // namespace trimray
