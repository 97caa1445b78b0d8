#include "format/trim_reference.h"
#include "tests/trim_shapes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

namespace trimray {
namespace {

using namespace shapes;

const Loop kBorder = polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}});

TEST(trim_reference, agrees_with_the_closed_form_of_rectangular_holes)
{
    PackImage image;
    std::vector<Loop> loops = {kBorder};
    for (const float x : {0.125f, 0.375f, 0.625f})
        for (const float y : {0.25f, 0.5f})
            loops.push_back(polygon({{x, y}, {x + 0.125f, y}, {x + 0.125f, y + 0.0625f}, {x, y + 0.0625f}}));
    add_face(image, loops);
    const TrimReference reference(image);
    std::mt19937 rng(1);
    for (int i = 0; i < 1000000; ++i) {
        // a third of the points on a grid that the holes' sides lie on
        const bool on_grid = i % 3 == 0;
        const double u = on_grid ? (rng() % 64) / 64.0 : rng() * 0x1p-32,
                     v = on_grid ? (rng() % 64) / 64.0 : rng() * 0x1p-32;
        bool in_hole = false;
        for (const double x : {0.125, 0.375, 0.625})
            for (const double y : {0.25, 0.5})
                in_hole |= x <= u && u < x + 0.125 && y <= v && v < y + 0.0625; // half-open
        ASSERT_EQ(reference.inside(0, u, v), !in_hole) << u << " " << v;
    }
}

TEST(trim_reference, agrees_with_the_closed_form_of_a_parabola)
{
    // u = 0.75 t, v = 0.75 t^2, closed by two lines: the control points are floats without rounding
    Loop loop;
    loop.points = {{0, 0}, {0.25f, 0}, {0.5f, 0.25f}, {0.75f, 0.75f}, {0, 0.75f}, {0, 0}};
    loop.cubic = {true, false, false};
    PackImage image;
    add_face(image, {loop});
    add_face(image, {reversed(loop)});
    const TrimReference reference(image);
    std::mt19937 rng(2);
    for (int i = 0; i < 1000000; ++i) {
        const double u = 0.8 * rng() * 0x1p-32;
        // every other point within 1e-14 of the curve, where rounding is all there is to get wrong
        const double away = i % 2 == 0 ? 0.5 * (rng() * 0x1p-32 - 0.5)
                                       : std::copysign(2e-15 + 1e-14 * rng() * 0x1p-32, int(i % 4) - 2.0);
        const double v = std::max(u * u / 0.75 + away, 0.0);
        if (std::abs(v - u * u / 0.75) < 1e-15)
            continue;
        const bool inside = v < 0.75 && v > u * u / 0.75;
        ASSERT_EQ(reference.inside(0, u, v), inside) << u << " " << v;
        ASSERT_EQ(reference.inside(1, u, v), inside) << u << " " << v;
    }
}

TEST(trim_reference, agrees_with_a_circle_as_far_as_cubics_are_one)
{
    PackImage image;
    add_face(image, {kBorder, circle(0.5, 0.5, 0.375, 0.25, 4)});
    const TrimReference reference(image);
    constexpr double kFromCircle = 1e-6; // 16 cubics miss a circle by 1e-7 of its radius, and their points are floats
    std::mt19937 rng(3);
    for (int i = 0; i < 300000; ++i) {
        const double u = rng() * 0x1p-32, v = rng() * 0x1p-32;
        const double r = std::hypot((u - 0.5) / 0.375, (v - 0.5) / 0.25);
        if (std::abs(r - 1) < kFromCircle)
            continue;
        ASSERT_EQ(reference.inside(0, u, v), r > 1) << u << " " << v;
    }
    // the nearest point of the circle seen as a circle of radius 30
    const UvMap map{0, 120, 80, 0};
    for (int i = 0; i < 2000; ++i) {
        const double u = 0.15 + 0.7 * rng() * 0x1p-32, v = 0.3 + 0.4 * rng() * 0x1p-32;
        const double to_circle = std::abs(std::hypot((u - 0.5) * 80, (v - 0.5) * 120) - 30);
        const double to_border = std::min({80 * u, 80 * (1 - u), 120 * v, 120 * (1 - v)});
        ASSERT_NEAR(reference.distance(0, u, v, map), std::min(to_circle, to_border), 1e-4) << u << " " << v;
    }
}

TEST(trim_reference, agrees_with_the_tests_own_crossing_count)
{
    PackImage image;
    add_face(image, {kBorder, gear(0.5, 0.5, 0.3, 0.25, 100), star(0.1, 0.1, 0.09, 0.02, 5)});
    add_face(image, {polygon({{0, 0}, {1, 1}, {1, 0}, {0, 1}})});
    std::mt19937 rng(4);
    while (image.faces.size() < 50)
        add_face(image, {random_loop(rng, 3 + static_cast<int>(rng() % 60)), random_loop(rng, 5)});
    const TrimReference reference(image);
    size_t asked = 0, skipped = 0;
    for (uint f = 0; f < image.faces.size(); ++f) {
        const std::vector<MonotonePiece> pieces = pieces_of(image, f);
        for (int i = 0; i < 5000; ++i) {
            const MonotonePiece& near = pieces[rng() % pieces.size()];
            // anywhere, at the height of a piece's end, or near a piece
            const double t = rng() * 0x1p-32;
            float u = static_cast<float>(rng() * 0x1p-32), v = static_cast<float>(rng() * 0x1p-32);
            if (i % 4 == 1)
                v = static_cast<float>(near.v[i % 8 < 4 ? 0 : 3]);
            if (i % 4 == 2) {
                u = static_cast<float>(bezier3(near.u, t));
                v = static_cast<float>(bezier3(near.v, t));
            }
            u = std::clamp(u, 0.0f, kUvBelowOne);
            v = std::clamp(v, 0.0f, kUvBelowOne);
            ++asked;
            if (reference.inside(f, u, v) == exact_inside(pieces, u, v))
                continue;
            ASSERT_LT(reference.distance(f, u, v, UvMap{}), 1e-14) << "face " << f << ": " << u << " " << v;
            ++skipped;
        }
    }
    EXPECT_GE(asked, 250000u);
    EXPECT_LT(skipped, asked / 1000); // points that lie on a curve but for the rounding of a double
}

TEST(trim_reference, measures_distances_as_plain_search_does)
{
    PackImage image;
    std::mt19937 rng(5);
    for (int f = 0; f < 20; ++f)
        add_face(image, {random_loop(rng, 12)});
    const TrimReference reference(image);
    for (uint f = 0; f < image.faces.size(); ++f) {
        const std::vector<MonotonePiece> pieces = pieces_of(image, f);
        for (int i = 0; i < 100; ++i) {
            const double u = rng() * 0x1p-32, v = rng() * 0x1p-32;
            const double expected = exact_distance(pieces, u, v, 3, 7);
            EXPECT_NEAR(reference.distance(f, u, v, UvMap{3, 0, 0, 7}), expected, 1e-5 * expected + 1e-9);
        }
    }
}

TEST(trim_reference, a_natural_border_is_inside_everywhere_and_no_pieces_nowhere)
{
    PackImage image;
    image.faces.resize(2);
    image.faces[0].flags = kFaceNaturalBorder;
    const TrimReference reference(image);
    EXPECT_TRUE(reference.inside(0, 0.3, 0.4));
    EXPECT_FALSE(reference.inside(1, 0.3, 0.4));
    EXPECT_EQ(reference.distance(1, 0.3, 0.4, UvMap{}), std::numeric_limits<double>::infinity());
}

} // namespace
} // namespace trimray
