// What is doubtful about loops: found where it is, and only there.
#include "preprocess/trims/trim_check.h"
#include "preprocess/trims/trim_loop.h"
#include "tests/cad_faces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace trimray {
namespace {

std::vector<TrimFinding> findings_of(const CadFace& face)
{
    const auto loops = build_trim_loops(face, {});
    EXPECT_TRUE(loops.ok());
    return loops.ok() ? loops->findings : std::vector<TrimFinding>{};
}

size_t count(const std::vector<TrimFinding>& findings, TrimFindingKind kind)
{
    return static_cast<size_t>(
        std::count_if(findings.begin(), findings.end(), [&](const TrimFinding& f) { return f.kind == kind; }));
}

std::vector<CadLoop> nested()
{
    return {polygon_loop({{0, 0}, {10, 0}, {10, 10}, {0, 10}}),
            {use_of(circle_curve({5, 5}, 4, true))},
            {use_of(circle_curve({5, 5}, 2))},
            {use_of(circle_curve({1, 9}, 0.5, true))}};
}

TEST(trim_check, each_loop_that_is_turned_round_is_named)
{
    for (unsigned mask = 0; mask < 16; ++mask) {
        std::vector<CadLoop> loops = nested();
        for (size_t i = 0; i < loops.size(); ++i)
            if ((mask >> i & 1) != 0)
                loops[i] = turned(loops[i]);
        unsigned found = 0;
        for (const TrimFinding& finding : findings_of(plane_face(loops))) {
            EXPECT_EQ(finding.kind, TrimFindingKind::TurnedLoop);
            found |= 1u << finding.loop;
        }
        EXPECT_EQ(found, mask);
    }
}

TEST(trim_check, loops_around_a_cylinder_are_turned_where_their_face_lies_on_the_wrong_side)
{
    const CadLoop lower{use_of(line_curve({0, 0}, {2 * M_PI, 0}))}, upper{use_of(line_curve({2 * M_PI, 3}, {0, 3}))};
    EXPECT_TRUE(findings_of(cylinder_face(1, {lower, upper})).empty());
    const auto found = findings_of(cylinder_face(1, {lower, turned(upper)}));
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].kind, TrimFindingKind::TurnedLoop);
    EXPECT_EQ(found[0].loop, 1);
}

TEST(trim_check, holes_across_a_seam_are_nothing_to_report)
{
    // two circles around, and a hole that is wrapped into both ends of the period's window
    const CadLoop lower{use_of(line_curve({0, -2}, {2 * M_PI, -2}))}, upper{use_of(line_curve({2 * M_PI, 2}, {0, 2}))};
    for (int i = 0; i < 16; ++i) {
        const double at = 2 * M_PI * i / 16;
        EXPECT_TRUE(findings_of(cylinder_face(1, {lower, upper, {use_of(circle_curve({at, 0}, 0.7, true))}})).empty())
            << i;
        const auto found = findings_of(cylinder_face(1, {lower, upper, {use_of(circle_curve({at, 0}, 0.7))}}));
        ASSERT_EQ(found.size(), 1u) << i;
        EXPECT_EQ(found[0].kind, TrimFindingKind::TurnedLoop);
        EXPECT_EQ(found[0].loop, 2);
    }
}

TEST(trim_check, circles_touch_or_cross_by_the_distance_of_their_centres)
{
    // radii 1 and 2, around 3 apart; 20 mm of plate are one unit of uv_face
    const auto at = [](double distance) {
        return findings_of(plane_face({polygon_loop({{-10, -10}, {10, -10}, {10, 10}, {-10, 10}}),
                                       {use_of(circle_curve({0, 0}, 2, true))},
                                       {use_of(circle_curve({distance, 0.1}, 1, true))}}));
    };
    EXPECT_TRUE(at(3.1).empty());
    EXPECT_TRUE(at(3.01).empty());
    const double touching = std::sqrt(9 - 0.01);
    EXPECT_GE(count(at(touching), TrimFindingKind::TouchingLoops), 1u);
    for (const double distance : {2.99, 2.0, 1.1})
        EXPECT_EQ(count(at(distance), TrimFindingKind::CrossingLoops), 2u) << distance;
    EXPECT_EQ(count(at(0.5), TrimFindingKind::CrossingLoops), 0u);
}

TEST(trim_check, random_lines_cross_as_often_as_they_do)
{
    std::mt19937 rng(7);
    std::uniform_real_distribution<double> uniform(0.05, 0.95);
    const auto side = [](Vec2d a, Vec2d b, Vec2d p) { return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x); };
    for (int i = 0; i < 300; ++i) {
        std::vector<Vec2d> p;
        for (int k = 0; k < 5; ++k)
            p.push_back({uniform(rng), uniform(rng)});
        size_t crossings = 0;
        for (size_t a = 0; a < 5; ++a)
            for (size_t b = a + 2; b < 5; ++b) {
                const Vec2d a1 = p[a], a2 = p[a + 1], b1 = p[b], b2 = p[(b + 1) % 5];
                crossings += (b + 1) % 5 != a && side(a1, a2, b1) * side(a1, a2, b2) < 0 &&
                             side(b1, b2, a1) * side(b1, b2, a2) < 0;
            }
        const auto found = findings_of(plane_face({polygon_loop({{0, 0}, {1, 0}, {1, 1}, {0, 1}}), polygon_loop(p)}));
        EXPECT_EQ(count(found, TrimFindingKind::CrossingLoops) + count(found, TrimFindingKind::TouchingLoops),
                  crossings);
    }
}

TEST(trim_check, an_edge_walked_both_ways_is_no_contact)
{
    // a keyhole: the hole is reached along one edge, there and back
    CadLoop loop = polygon_loop({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
    CadLoop keyhole{use_of(line_curve({0, 0}, {0.4, 0.4})), use_of(line_curve({0.4, 0.4}, {0.4, 0.6})),
                    use_of(line_curve({0.4, 0.6}, {0.6, 0.4})), use_of(line_curve({0.6, 0.4}, {0.4, 0.4})),
                    use_of(line_curve({0, 0}, {0.4, 0.4}), true)};
    loop.insert(loop.end(), keyhole.begin(), keyhole.end());
    CadFace face = plane_face({loop});
    face.loops[0][8].edge = face.loops[0][4].edge;
    EXPECT_EQ(count(findings_of(face), TrimFindingKind::CrossingLoops), 0u);
}

} // namespace
} // namespace trimray
