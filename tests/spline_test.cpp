// Knots, basis functions and knot insertion, against their definitions and the CAD kernel's curves.
#include "preprocess/spline.h"
#include "tests/occt_surfaces.h"
#include "tests/random_surfaces.h"

#include <gtest/gtest.h>

namespace trimray {
namespace {

using test::RandomSurfaces;

TEST(find_span, returns_the_span_of_non_zero_length_that_holds_the_parameter)
{
    const std::vector<double> knots{0, 0, 0, 1, 1, 2, 3, 3, 3};
    EXPECT_EQ(find_span(knots, 2, 0), 2);
    EXPECT_EQ(find_span(knots, 2, 0.5), 2);
    EXPECT_EQ(find_span(knots, 2, 1), 4);
    EXPECT_EQ(find_span(knots, 2, 2.5), 5);
    EXPECT_EQ(find_span(knots, 2, 3), 5) << "the end belongs to the last span";
    EXPECT_EQ(find_span(knots, 2, -7), 2) << "parameters outside take the nearest span";
    EXPECT_EQ(find_span(knots, 2, 7), 5);
    const std::vector<double> unclamped{-2, -1, 0, 1, 1, 1, 2, 3, 4}; // degree 2, surface on [0, 2]
    EXPECT_EQ(find_span(unclamped, 2, 0), 2);
    EXPECT_EQ(find_span(unclamped, 2, 1), 5);
    EXPECT_EQ(find_span(unclamped, 2, 2), 5);
}

TEST(basis_functions, sum_to_one_and_their_derivatives_to_zero)
{
    RandomSurfaces random(1);
    for (int degree = 1; degree <= 25; ++degree) {
        const std::vector<double> knots = random.knots(degree, 5);
        for (int i = 0; i < 50; ++i) {
            const double t = random.uniform(knots.front(), knots.back());
            double n[26], d[26], sum = 0, slope = 0, largest = 0;
            basis_functions(knots, degree, find_span(knots, degree, t), t, n, d);
            for (int j = 0; j <= degree; ++j) {
                sum += n[j];
                slope += d[j];
                largest = std::max(largest, std::abs(d[j]));
                EXPECT_GE(n[j], 0);
            }
            EXPECT_NEAR(sum, 1, 1e-14);
            EXPECT_NEAR(slope, 0, 1e-13 * largest);
        }
    }
}

TEST(bezier_operator, leaves_the_curve_unchanged)
{
    // the kernel's own insertion of both ends up to full multiplicity gives the same control points
    RandomSurfaces random(2);
    for (int degree = 1; degree <= 11; ++degree) {
        for (int repeat = 0; repeat < 10; ++repeat) {
            const std::vector<double> knots = random.knots(degree, 4);
            const int count = int(knots.size()) - degree - 1;
            TColgp_Array1OfPnt poles(1, count);
            for (int i = 1; i <= count; ++i)
                poles(i) = gp_Pnt(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
            const test::DistinctKnots d = test::distinct(knots);
            const Handle(Geom_BSplineCurve) curve = new Geom_BSplineCurve(poles, d.values, d.multiplicities, degree);
            const int k = find_span(knots, degree, random.uniform(knots.front(), knots.back()));
            const double length = knots[k + 1] - knots[k];
            const bool cut = random.integer(0, 1) == 1;
            const double a = cut ? knots[k] + random.uniform(0.1, 0.4) * length : knots[k];
            const double b = cut ? knots[k + 1] - random.uniform(0.1, 0.4) * length : knots[k + 1];
            std::vector<double> matrix((degree + 1) * (degree + 1));
            bezier_operator(knots, degree, k, a, b, matrix.data());

            curve->InsertKnot(a, degree, 1e-12, false);
            curve->InsertKnot(b, degree, 1e-12, false);
            // the pole at `a` starts the piece: the last flat knot equal to a, less degree
            int last = 0;
            for (int i = 1; i <= curve->KnotSequence().Length(); ++i)
                if (curve->KnotSequence()(i) <= a + 1e-12)
                    last = i;
            for (int j = 0; j <= degree; ++j) {
                gp_XYZ ours(0, 0, 0);
                double row_sum = 0;
                for (int i = 0; i <= degree; ++i) {
                    const double e = matrix[j * (degree + 1) + i];
                    EXPECT_GE(e, 0);
                    row_sum += e;
                    ours += e * poles(k - degree + i + 1).XYZ();
                }
                EXPECT_NEAR(row_sum, 1, 1e-14);
                EXPECT_LE((ours - curve->Pole(last - degree + j).XYZ()).Modulus(), 5e-14);
            }
        }
    }
}

TEST(held_to_surface, follows_a_small_overshoot_and_stops_a_large_one)
{
    const std::vector<double> knots{0, 0, 0, 0, 0.9999, 1, 1, 1, 1}; // an end span of 1e-4
    EXPECT_EQ(held_to_surface(knots, 3, 0.5), 0.5);
    EXPECT_EQ(held_to_surface(knots, 3, 1 + 5e-7), 1 + 5e-7);
    EXPECT_NEAR(held_to_surface(knots, 3, 1.03), 1 + 1e-6, 1e-12);
    EXPECT_NEAR(held_to_surface(knots, 3, -5), -0.009999, 1e-12);
}

TEST(bezier_operator, continues_the_polynomial_outside_its_span)
{
    // a single span: the operator for [a, b] beyond it must give the Taylor values of t^3
    const std::vector<double> knots{0, 0, 0, 0, 1, 1, 1, 1};
    double matrix[16];
    bezier_operator(knots, 3, 3, -0.5, 1.5, matrix);
    const double cubic[4] = {0, 0, 0, 1}; // t^3 in Bezier form
    const auto value = [&](int row) {
        double sum = 0;
        for (int i = 0; i < 4; ++i)
            sum += matrix[row * 4 + i] * cubic[i];
        return sum;
    };
    EXPECT_NEAR(value(0), -0.125, 1e-15);
    EXPECT_NEAR(value(3), 3.375, 1e-14);
}

TEST(cut_spans, skips_zero_spans_and_cuts_at_the_domain)
{
    const std::vector<double> knots{0, 0, 0, 1, 1, 1, 2, 4, 4, 4}; // a jump at 1: multiplicity degree + 1
    const std::vector<SpanCut> all = cut_spans(knots, 2, 0, 0, 4);
    ASSERT_EQ(all.size(), 3u);
    EXPECT_EQ(all[1].a, 1);
    EXPECT_EQ(all[2].b, 4);
    const std::vector<SpanCut> some = cut_spans(knots, 2, 0, 0.5, 1.5);
    ASSERT_EQ(some.size(), 2u);
    EXPECT_EQ(some[0].a, 0.5);
    EXPECT_EQ(some[0].b, 1);
    EXPECT_EQ(some[1].b, 1.5);
    EXPECT_TRUE(cut_spans(knots, 2, 0, 5, 6).empty());
    EXPECT_EQ(cut_spans(knots, 2, 0, 1 - 1e-13, 2).size(), 1u) << "no sliver from rounding";
    EXPECT_EQ(cut_spans(knots, 2, 0, -1e-6, 4).front().a, -1e-6) << "a small overshoot is followed";
    EXPECT_EQ(cut_spans(knots, 2, 0, -3, 4).front().a, 0) << "a large one is not";
}

TEST(cut_spans, unrolls_periods_in_order)
{
    const std::vector<double> knots{0, 0, 1, 2, 3, 3};
    const std::vector<SpanCut> cuts = cut_spans(knots, 1, 3, 7.5, 10.5); // one period, 2.5 periods away
    ASSERT_EQ(cuts.size(), 4u);
    double at = 7.5;
    for (const SpanCut& cut : cuts) {
        EXPECT_DOUBLE_EQ(cut.a + cut.shift, at);
        at = cut.b + cut.shift;
    }
    EXPECT_DOUBLE_EQ(at, 10.5);
}

} // namespace
} // namespace trimray
