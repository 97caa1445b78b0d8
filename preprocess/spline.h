// B-spline arithmetic in double: spans, basis functions, and knot insertion down to one span's Bezier form.
// Source: Piegl & Tiller, The NURBS Book (A2.1, A2.3, A5.1); Borden et al. 2011 for the operator form.
#pragma once

#include "preprocess/import/cad_model.h"

#include <span>
#include <vector>

namespace trimray {

/// Returns k with knots[k] <= t < knots[k + 1], clamped to the spans of non-zero length in knots[degree] ..
/// knots[count]. Shapes: count + degree + 1 knots. Source: Piegl & Tiller A2.1.
int find_span(std::span<const double> knots, int degree, double t);

/// Writes the degree + 1 basis functions that are non-zero on span k, and their first derivatives, at t. Outside the
/// span the span's polynomials are continued. Source: Piegl & Tiller A2.3 with n = 1.
void basis_functions(std::span<const double> knots, int degree, int k, double t, double* values, double* derivatives);

/// Writes the operator E that turns the span's control points into the Bezier points of [a, b]:
///   b_j = sum_i E[j * (degree + 1) + i] P_{k - degree + i}
/// by inserting a, then b, until each has multiplicity `degree` (A5.1 on unit vectors). Rows sum to 1 and are
/// non-negative for a, b in the span; outside it the span's polynomial is continued.
/// Domain: knots[k] < knots[k + 1], a < b, a < knots[k + 1].
void bezier_operator(std::span<const double> knots, int degree, int k, double a, double b, double* operator_out);

/// Returns t, held to where the surface may be continued: a hundredth of its end spans beyond their ends. Farther out
/// the end spans' polynomials soon mean nothing. Domain: any finite t; not for periodic directions.
double held_to_surface(std::span<const double> knots, int degree, double t);

/// The part [a, b] of span k that a domain sees; `shift` (whole periods) takes it into the domain.
struct SpanCut {
    int k = 0;
    double a = 0, b = 0, shift = 0;
};

/// Returns the spans of non-zero length within [lo, hi], in order, cut at its ends. `period` 0: not periodic.
std::vector<SpanCut> cut_spans(std::span<const double> knots, int degree, double period, double lo, double hi);

} // namespace trimray
