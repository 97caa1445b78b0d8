#include "preprocess/spline.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace trimray {

namespace {

// A span cut thinner than this share of the domain is not seen: uv_face in single precision is 60 times coarser.
constexpr double kSliverOfDomain = 1e-9;
// Loops may overshoot the surface's end by rounding in the file; the end span is continued by at most this share of it.
constexpr double kContinuedShareOfSpan = 0.01;

} // namespace

int find_span(std::span<const double> knots, int degree, double t)
{
    const auto first = knots.begin() + degree, last = knots.end() - degree - 1; // u_p and u_{n+1}
    const auto above = std::upper_bound(first, last, t);
    int k = static_cast<int>(above - knots.begin()) - 1;
    k = std::clamp(k, degree, static_cast<int>(knots.size()) - degree - 2);
    // at or beyond the ends the nearest span of non-zero length
    while (k > degree && !(knots[k] < knots[k + 1]))
        --k;
    while (k < static_cast<int>(knots.size()) - degree - 2 && !(knots[k] < knots[k + 1]))
        ++k;
    return k;
}

double held_to_surface(std::span<const double> knots, int degree, double t)
{
    const double first = knots[degree], last = knots[knots.size() - degree - 1];
    const int first_span = find_span(knots, degree, first), last_span = find_span(knots, degree, last);
    return std::clamp(t, first - kContinuedShareOfSpan * (knots[first_span + 1] - knots[first_span]),
                      last + kContinuedShareOfSpan * (knots[last_span + 1] - knots[last_span]));
}

void basis_functions(std::span<const double> knots, int degree, int k, double t, double* values, double* derivatives)
{
    double left[kMaxDegree + 1], right[kMaxDegree + 1];
    values[0] = 1;
    derivatives[0] = 0;
    for (int r = 1; r <= degree; ++r) {
        left[r] = t - knots[k + 1 - r];
        right[r] = knots[k + r] - t;
        if (r == degree) {
            // N'_{i,p} = p (N_{i,p-1} / (u_{i+p} - u_i) - N_{i+1,p-1} / (u_{i+p+1} - u_{i+1}))
            double before = 0;
            for (int i = 0; i < r; ++i) {
                const double here = degree * (values[i] / (right[i + 1] + left[r - i]));
                derivatives[i] = before - here;
                before = here;
            }
            derivatives[degree] = before;
        }
        double saved = 0;
        for (int i = 0; i < r; ++i) {
            const double share = values[i] / (right[i + 1] + left[r - i]); // >= span length: never 0/0
            values[i] = saved + right[i + 1] * share;
            saved = left[r - i] * share;
        }
        values[r] = saved;
    }
}

void bezier_operator(std::span<const double> knots, int degree, int k, double a, double b, double* operator_out)
{
    assert(knots[k] < knots[k + 1] && a < b && a < knots[k + 1] && "a span of non-zero length");
    const int p = degree, n = p + 1;
    double* row = operator_out;
    std::fill(row, row + n * n, 0.0);
    for (int i = 0; i < n; ++i)
        row[i * n + i] = 1;
    const auto blend = [&](double* out, const double* from, const double* to, double share) {
        for (int c = 0; c < n; ++c)
            out[c] = (1 - share) * from[c] + share * to[c];
    };
    // insert a, p times; row i then holds the last point of level p - i: the net right of a
    for (int r = 1; r <= p; ++r)
        for (int i = 0; i <= p - r; ++i) {
            const double lower = knots[k - p + i + r], upper = knots[k + 1 + i]; // lower <= u_k < u_{k+1} <= upper
            blend(row + i * n, row + i * n, row + (i + 1) * n, (a - lower) / (upper - lower));
        }
    // insert b, p times, with a^p, u_{k+1}, u_{k+2}, ... for knots; row r keeps the first point of level r
    for (int r = 1; r <= p; ++r)
        for (int i = p; i >= r; --i)
            blend(row + i * n, row + (i - 1) * n, row + i * n, (b - a) / (knots[k + 1 + i - r] - a));
}

std::vector<SpanCut> cut_spans(std::span<const double> knots, int degree, double period, double lo, double hi)
{
    std::vector<SpanCut> cuts;
    const int first = degree, last = static_cast<int>(knots.size()) - degree - 1; // u_first .. u_last is the surface
    const double sliver = kSliverOfDomain * (hi - lo);
    const auto cut_once = [&](double shift) {
        const int first_span = find_span(knots, degree, knots[first]);
        const int last_span = find_span(knots, degree, knots[last]);
        for (int k = first_span; k <= last_span; ++k) {
            const double length = knots[k + 1] - knots[k];
            if (!(length > 0))
                continue;
            const double from = lo - shift, to = hi - shift;
            double a = std::max(knots[k], from), b = std::min(knots[k + 1], to);
            if (period == 0 && k == first_span && from < a && a - from <= kContinuedShareOfSpan * length)
                a = from;
            if (period == 0 && k == last_span && to > b && to - b <= kContinuedShareOfSpan * length)
                b = to;
            const bool whole = a == knots[k] && b == knots[k + 1]; // a thin span of the file's own stays
            if (a < b && (whole || b - a > sliver))
                cuts.push_back({k, a, b, shift});
        }
    };
    if (period == 0) {
        cut_once(0);
        return cuts;
    }
    const double before = std::floor((lo - knots[first]) / period), after = std::floor((hi - knots[first]) / period);
    for (double turn = before; turn <= after; ++turn)
        cut_once(turn * period);
    return cuts;
}

} // namespace trimray
