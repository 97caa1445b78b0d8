// Loops moved outwards: the old border and what lies within its growth are inside, the new one is near, and loops stay
// closed and monotone.
#include "preprocess/build_pack.h"

#include "preprocess/bezier_patch.h"
#include "tests/cad_faces.h"
#include "tests/trim_shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

namespace trimray {
namespace {

constexpr double kPi = std::numbers::pi;

/// A cubic B-spline with its end points doubled thrice.
SplineCurve2d spline_curve(const std::vector<Vec2d>& points)
{
    SplineCurve2d curve;
    curve.degree = 3;
    const int spans = static_cast<int>(points.size()) - 3;
    for (int i = -3; i <= spans + 3; ++i)
        curve.knots.push_back(std::clamp(i, 0, spans));
    for (const Vec2d& p : points)
        curve.control_points.push_back({p.x, p.y, 1});
    return curve;
}

/// A face of loops; every use is an edge of its own, with one gap to its neighbour.
CadFace face_of(const std::vector<std::vector<SplineCurve2d>>& loops, double gap_mm)
{
    CadFace face;
    face.surface.natural_bounds = {{-1e100, -1e100}, {1e100, 1e100}};
    uint32_t edge = 0;
    for (const std::vector<SplineCurve2d>& curves : loops) {
        CadLoop& loop = face.loops.emplace_back();
        for (const SplineCurve2d& curve : curves) {
            CadEdgeUse& use = loop.emplace_back();
            use.pcurve = curve;
            use.first = curve.knots[curve.degree];
            use.last = curve.knots[curve.control_points.size()];
            use.edge = edge++;
            use.gap_mm = gap_mm;
        }
    }
    return face;
}

std::vector<SplineCurve2d> polygon(const std::vector<Vec2d>& corners)
{
    std::vector<SplineCurve2d> curves;
    for (size_t i = 0; i < corners.size(); ++i)
        curves.push_back(line_curve(corners[i], corners[(i + 1) % corners.size()]));
    return curves;
}

/// The trims of a face in uv_file.
struct Region {
    std::vector<MonotonePiece> pieces;
    TrimLoops loops;

    /// As a tracer answers: what lies beyond the domain by its slack is on its border.
    bool inside(double u, double v) const
    {
        const Rect2d& d = loops.domain;
        const auto held = [](double x, double lo, double hi) {
            constexpr double kWithin = 1e-9; // of the domain: off its border, where a crossing count decides
            const double slack = (x < lo || x > hi) ? double(kDomainSlack) : 0;
            if (x < lo - slack * (hi - lo) || x > hi + slack * (hi - lo))
                return std::nan("");
            return std::clamp(x, lo + kWithin * (hi - lo), hi - kWithin * (hi - lo));
        };
        const double at_u = held(u, d.lo.x, d.hi.x), at_v = held(v, d.lo.y, d.hi.y);
        if (std::isnan(at_u) || std::isnan(at_v))
            return false;
        return loops.natural_border || shapes::exact_inside(pieces, at_u, at_v);
    }
    /// Points of the border, `each` of every piece, with the direction there.
    template <class Visit>
    void walk(int each, Visit visit) const
    {
        for (const MonotonePiece& p : pieces)
            for (int i = 0; i < each; ++i) {
                const double t = (i + 0.5) / each, e = 1e-4;
                visit(Vec2d{bezier3(p.u, t), bezier3(p.v, t)},
                      Vec2d{bezier3(p.u, t + e) - bezier3(p.u, t - e), bezier3(p.v, t + e) - bezier3(p.v, t - e)});
            }
    }
};

std::vector<TrimFinding> not_grown(const std::vector<TrimFinding>& findings)
{
    std::vector<TrimFinding> found;
    std::copy_if(findings.begin(), findings.end(), std::back_inserter(found),
                 [](const TrimFinding& finding) { return finding.kind == TrimFindingKind::NotGrown; });
    return found;
}

Region region_of(const CadFace& face, bool grow)
{
    Region region;
    const Result<TrimLoops> built = build_trim_loops(face, {.grow = grow});
    if (!built.ok()) {
        ADD_FAILURE() << built.error().detail;
        return region;
    }
    region.loops = *built;
    const Rect2d& d = region.loops.domain;
    for (const uint32_t word : region.loops.pieces) {
        MonotonePiece p = load_piece(region.loops.points.data(), 0, word);
        for (int i = 0; i < 4; ++i) {
            p.u[i] = d.lo.x + p.u[i] * (d.hi.x - d.lo.x);
            p.v[i] = d.lo.y + p.v[i] * (d.hi.y - d.lo.y);
        }
        region.pieces.push_back(p);
    }
    if (region.loops.natural_border)
        for (const auto& [a, b] : {std::pair(d.lo, Vec2d{d.hi.x, d.lo.y}), std::pair(Vec2d{d.hi.x, d.lo.y}, d.hi),
                                   std::pair(d.hi, Vec2d{d.lo.x, d.hi.y}), std::pair(Vec2d{d.lo.x, d.hi.y}, d.lo)}) {
            MonotonePiece p;
            for (int i = 0; i < 4; ++i) {
                p.u[i] = a.x + (b.x - a.x) * i / 3;
                p.v[i] = a.y + (b.y - a.y) * i / 3;
            }
            region.pieces.push_back(p);
        }
    return region;
}

/// Old and new border, both 0 to `reach` growths apart, on a plane (uv_file in mm).
void expect_grown(const std::vector<std::vector<SplineCurve2d>>& loops, double gap_mm, double reach,
                  const std::string& name, double least = 0.95)
{
    const CadFace face = face_of(loops, gap_mm);
    const Region before = region_of(face, false), after = region_of(face, true);
    EXPECT_GE(after.loops.largest_growth_mm, gap_mm) << name;
    EXPECT_EQ(not_grown(after.loops.findings).size(), 0u) << name;
    int left_out = 0, walked = 0;
    before.walk(37, [&](Vec2d p, Vec2d d) {
        const double s = least * gap_mm / std::hypot(d.x, d.y);
        for (const double side : {-s, 0.0, s}) {
            ++walked;
            left_out += !after.inside(p.x - side * d.y, p.y + side * d.x);
        }
    });
    EXPECT_EQ(left_out, 0) << name << ": of " << walked << " points within the growth of the old border";
    double farthest = 0;
    after.walk(37,
               [&](Vec2d p, Vec2d) { farthest = std::max(farthest, shapes::exact_distance(before.pieces, p.x, p.y)); });
    EXPECT_LE(farthest, reach * gap_mm) << name;
    for (const MonotonePiece& p : after.pieces)
        for (const double* c : {p.u, p.v})
            EXPECT_TRUE((c[0] <= c[1] && c[1] <= c[2] && c[2] <= c[3]) ||
                        (c[0] >= c[1] && c[1] >= c[2] && c[2] >= c[3]))
                << name;
}

TEST(trim_grow, borders_move_outwards_by_their_growth_whatever_their_shape)
{
    const std::vector<Vec2d> square{{0, 0}, {10, 0}, {10, 10}, {0, 10}};
    const std::vector<Vec2d> arrow{{0, 0}, {10, 1}, {4, 4}, {1, 10}};
    const std::vector<Vec2d> l_shape{{0, 0}, {10, 0}, {10, 4}, {4, 4}, {4, 10}, {0, 10}};
    const std::vector<Vec2d> spike{{0, 0}, {10, 0}, {0, 0.5}};
    const std::vector<Vec2d> s_curve{{0, 0}, {4, 3}, {6, -3}, {10, 0}, {12, 5},
                                     {7, 9}, {3, 6}, {0, 9},  {-3, 4}, {0, 0}};
    for (const double gap_mm : {1e-4, 1e-3, 1e-2}) {
        expect_grown({polygon(square)}, gap_mm, 1.5, "square");
        expect_grown({polygon(l_shape)}, gap_mm, 1.5, "L");
        expect_grown({polygon(arrow)}, gap_mm, 2.1, "arrow");
        expect_grown({polygon(spike)}, gap_mm, 2.1, "spike");
        expect_grown({{circle_curve({3, 4}, 2)}}, gap_mm, 1.5, "disc");
        expect_grown({{spline_curve(s_curve)}}, gap_mm, 1.6, "curve");
        expect_grown({polygon(square), {circle_curve({5, 5}, 2)}, polygon({{1, 1}, {2.5, 1}, {1, 3}})}, gap_mm, 2.5,
                     "square with holes");
    }
}

TEST(trim_grow, loops_grow_outwards_whichever_way_they_run)
{
    const std::vector<Vec2d> outer{{0, 0}, {10, 1}, {9, 8}, {1, 10}}, hole{{4, 4}, {6, 4}, {5, 6}};
    for (int ways = 0; ways < 4; ++ways) {
        std::vector<Vec2d> a = outer, b = hole;
        if (ways & 1)
            std::reverse(a.begin(), a.end());
        if (ways & 2)
            std::reverse(b.begin(), b.end());
        expect_grown({polygon(a), polygon(b)}, 1e-3, 2.5, "way " + std::to_string(ways));
    }
}

TEST(trim_grow, a_joint_of_one_direction_moves_straight_outwards_whatever_the_rounding)
{
    // sides of three collinear lines each, turned by all sorts of angles
    for (int turn = 0; turn < 200; ++turn) {
        const double angle = 0.0314 * turn;
        std::vector<Vec2d> corners;
        for (int side = 0; side < 4; ++side) {
            const double at = angle + 0.5 * kPi * side;
            for (const double along : {-1.0, -0.3, 0.4})
                corners.push_back(
                    {5 * (std::cos(at) - along * std::sin(at)), 5 * (std::sin(at) + along * std::cos(at))});
        }
        expect_grown({polygon(corners)}, 1e-3, 1.5, "turned by " + std::to_string(angle));
    }
}

TEST(trim_grow, a_cusp_gets_a_blunt_end)
{
    // between a line and the circle that it touches: both leave the corner in one direction
    const double h = std::sqrt(0.5);
    const SplineCurve2d arc{2, true, {0, 0, 0, 1, 1, 1}, {{5, 5, 1}, {5 * h, 0, h}, {0, 0, 1}}};
    expect_grown({{line_curve({0, 0}, {5, 0}), line_curve({5, 0}, {5, 5}), arc}}, 1e-3, 2.1, "cusp");
}

TEST(trim_grow, a_rectangle_stays_its_domain)
{
    const Region grown = region_of(face_of({polygon({{0, 0}, {10, 0}, {10, 5}, {0, 5}})}, 1e-3), true);
    EXPECT_TRUE(grown.loops.natural_border);
    const double slack_mm = double(kDomainSlack) * 10; // the tracers' own part
    EXPECT_NEAR(grown.loops.domain.lo.x, -1e-3, slack_mm);
    EXPECT_NEAR(grown.loops.domain.hi.x, 10 + 1e-3, slack_mm);
    EXPECT_NEAR(grown.loops.domain.hi.y, 5 + 1e-3, slack_mm);
    // nothing but rounding: the tracers' slack is enough
    const Region exact = region_of(face_of({polygon({{0, 0}, {10, 0}, {10, 5}, {0, 5}})}, 0), true);
    EXPECT_EQ(exact.loops.domain.lo.x, 0);
    EXPECT_EQ(exact.loops.domain.hi.x, 10);
}

TEST(trim_grow, seams_and_poles_stay_and_a_closed_surface_keeps_its_period)
{
    CadFace face = face_of({polygon({{0, 0}, {2 * kPi, 0}, {2 * kPi, 3}, {0, 3}})}, 1e-2);
    face.surface = cylinder_surface(2);
    face.loops[0][1].seam = face.loops[0][3].seam = true;
    const Region cylinder = region_of(face, true);
    EXPECT_TRUE(cylinder.loops.natural_border);
    EXPECT_EQ(cylinder.loops.domain.lo.x, 0);
    EXPECT_EQ(cylinder.loops.domain.hi.x, 2 * kPi);
    EXPECT_LT(cylinder.loops.domain.lo.y, -0.9e-2);

    face.surface = sphere_surface(2);
    for (CadEdgeUse& use : face.loops[0])
        for (auto& p : use.pcurve.control_points)
            p[1] = p[1] == 0 ? 0.3 : kPi / 2;
    face.loops[0][2].degenerate = true;
    const Region cap = region_of(face, true);
    EXPECT_TRUE(cap.loops.natural_border);
    EXPECT_EQ(cap.loops.domain.hi.y, kPi / 2);
    EXPECT_LT(cap.loops.domain.lo.y, 0.3 - 0.9e-2 / 2);

    // almost the whole period, not closed by a seam: no farther than the period
    CadFace open = face_of({polygon({{0, 0}, {2 * kPi - 1e-3, 0}, {2 * kPi - 1e-3, 3}, {0, 3}})}, 1e-2);
    open.surface = cylinder_surface(2);
    const Region band = region_of(open, true);
    EXPECT_TRUE(band.loops.natural_border);
    EXPECT_LE(band.loops.domain.hi.x - band.loops.domain.lo.x, 2 * kPi * (1 + 1e-15));
    EXPECT_LT(band.loops.domain.lo.x, 0);
}

TEST(trim_grow, growth_is_measured_on_the_surface)
{
    // a strip near the pole: the same length on the sphere is more of u there
    CadFace face = face_of({polygon({{1, 1.0}, {2, 1.0}, {2, 1.4}, {1, 1.4}})}, 1e-3);
    face.surface = sphere_surface(5);
    const Rect2d d = region_of(face, true).loops.domain;
    EXPECT_GE(1 - d.lo.x, 0.97e-3 / (5 * std::cos(1.4)));
    EXPECT_GE(1.0 - d.lo.y, 0.97e-3 / 5);
}

TEST(trim_grow, a_line_to_a_pole_does_not_move_far)
{
    CadFace face = face_of({polygon({{0, 0}, {1.5, 0}, {1.5, kPi / 2}, {0, kPi / 2}})}, 1e-3);
    face.surface = sphere_surface(5);
    face.loops[0][2].degenerate = true;
    const Rect2d d = region_of(face, true).loops.domain;
    EXPECT_LE(-d.lo.x, 10 * 1e-3 / 5);
    EXPECT_GE(-d.lo.x, 0.97e-3 / 5);
    EXPECT_EQ(d.hi.y, kPi / 2);
}

TEST(trim_grow, a_spline_is_continued_by_a_hair_beyond_its_knots)
{
    CadFace face = face_of({polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}})}, 1e-3);
    face.surface.kind = kKindBezier;
    SplineSurface& s = face.surface.spline;
    s.degree_u = s.degree_v = 2;
    s.count_u = s.count_v = 3;
    s.knots_u = s.knots_v = {0, 0, 0, 1, 1, 1};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            s.control_points.push_back({10.0 * i, 10.0 * j, i == 1 && j == 1 ? 6.0 : 0.0, 1});
    face.surface.natural_bounds = {{0, 0}, {1, 1}};
    const Region grown = region_of(face, true);
    EXPECT_TRUE(grown.loops.natural_border);
    EXPECT_NEAR(grown.loops.domain.lo.x, -1e-3 / 20, 1.1e-5);
    EXPECT_LT(grown.loops.domain.lo.x, -3e-5);
    // a gap as wide as the surface stops at a hundredth of the end span
    for (CadEdgeUse& use : face.loops[0])
        use.gap_mm = 5;
    EXPECT_NEAR(region_of(face, true).loops.domain.lo.x, -0.01, 1e-9);
}

TEST(trim_grow, a_surface_that_cannot_be_continued_keeps_its_border_and_is_reported)
{
    CadFace face = face_of({polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}})}, 50);
    face.surface.kind = kKindBezier;
    SplineSurface& s = face.surface.spline;
    s.degree_u = 2;
    s.count_u = 3;
    s.count_v = 2;
    s.rational = true;
    s.knots_u = {0, 0, 0, 1, 1, 1};
    s.knots_v = {0, 0, 1, 1};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 2; ++j) {
            const double w = i == 2 ? 1e-3 : 1; // falls to 0 within a hundredth of the span beyond its end
            s.control_points.push_back({10.0 * i * w, 10.0 * j * w, 0, w});
        }
    face.surface.natural_bounds = {{0, 0}, {1, 1}};
    CadModel model;
    model.parts.resize(1);
    model.parts[0].faces = {face};
    model.parts[0].edges.resize(4);
    BuildOptions options;
    options.compact = true;
    BuildReport report;
    const PackImage image = build_pack(model, options, report);
    ASSERT_EQ(image.faces.size(), 1u);
    EXPECT_EQ(image.faces[0].domain_hi[0], 1);
    ASSERT_EQ(report.trim_findings.size(), 1u);
    EXPECT_EQ(report.trim_findings[0].finding.kind, TrimFindingKind::NotGrown);
    EXPECT_EQ(report.trim_findings[0].finding.reason, NotGrownReason::Surface);
}

TEST(trim_grow, what_has_no_outside_stays_and_is_reported)
{
    const CadFace eight = face_of({polygon({{0, 0}, {10, 10}, {10, 0}, {0, 10}})}, 1e-3);
    const Region crossed = region_of(eight, true);
    ASSERT_EQ(not_grown(crossed.loops.findings).size(), 1u);
    EXPECT_EQ(not_grown(crossed.loops.findings)[0].reason, NotGrownReason::CrossesItself);
    EXPECT_EQ(crossed.loops.points, region_of(eight, false).loops.points);

    const CadFace pierced =
        face_of({polygon({{0, 0}, {10, 0}, {10, 10}, {0, 10}}), {circle_curve({5, 5}, 1e-2)}}, 0.05);
    const Region hole = region_of(pierced, true);
    ASSERT_EQ(not_grown(hole.loops.findings).size(), 1u);
    const TrimFinding narrow = not_grown(hole.loops.findings)[0];
    EXPECT_EQ(narrow.reason, NotGrownReason::NoRoom);
    EXPECT_EQ(narrow.loop, 1);
    EXPECT_LT(std::hypot(narrow.uv_file.x - 5, narrow.uv_file.y - 5), 2e-2);
    EXPECT_EQ(finding_detail(narrow).find("loop 1 at u "), 0u) << finding_detail(narrow);
    EXPECT_FALSE(hole.inside(5, 5));
}

TEST(trim_grow, an_edge_walked_to_and_fro_stays)
{
    CadFace face = face_of({polygon({{0, 0}, {10, 0}, {10, 10}, {5, 10}, {5, 5}, {5, 10}, {0, 10}})}, 1e-3);
    face.loops[0][4].edge = face.loops[0][3].edge; // a cut into the face: one edge, used twice
    const Region cut = region_of(face, true);
    for (int i = 1; i < 100; ++i)
        for (const double off : {-1.3e-3, -2e-4, 3e-4, 1.1e-3})
            EXPECT_TRUE(cut.inside(5 + off, 5 + 0.05 * i)) << i << " " << off;
}

} // namespace
} // namespace trimray
