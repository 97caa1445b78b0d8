// Piecewise polynomial interpolation of smooth functions at Chebyshev-Lobatto nodes, in Bernstein form: how surfaces
// and pcurves that are no splines become splines in their own parameters. Errors are measured between the nodes.
#include "preprocess/import/cad_import_kernel.h"
#include "preprocess/vec3d.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace trimray::kernel {
namespace {

constexpr int kMaxSpans = 128; // a direction; beyond it the function is not smooth
constexpr int kTriedDegrees[] = {1, 2, 3, 5};

/// Nodes on [0,1], ends included, and the matrix that turns values there into Bernstein coefficients.
struct Interpolation {
    int degree = 1;
    std::vector<double> nodes;
    std::vector<double> to_bernstein; // (degree + 1)^2, row-major
};

double bernstein(int degree, int i, double t)
{
    double binomial = 1;
    for (int k = 0; k < i; ++k)
        binomial = binomial * (degree - k) / (k + 1);
    return binomial * std::pow(t, i) * std::pow(1 - t, degree - i);
}

Interpolation make_interpolation(int degree)
{
    Interpolation result;
    result.degree = degree;
    const int n = degree + 1;
    for (int i = 0; i < n; ++i)
        result.nodes.push_back(0.5 - 0.5 * std::cos(std::numbers::pi * i / degree));
    // invert B_ij = Bernstein_j(node_i) by Gauss-Jordan with row pivoting; n <= 6, condition below 1e3
    std::vector<double> a(static_cast<size_t>(n) * 2 * n, 0.0);
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j)
            a[i * 2 * n + j] = bernstein(degree, j, result.nodes[i]);
        a[i * 2 * n + n + i] = 1;
    }
    for (int c = 0; c < n; ++c) {
        int pivot = c;
        for (int r = c + 1; r < n; ++r)
            if (std::abs(a[r * 2 * n + c]) > std::abs(a[pivot * 2 * n + c]))
                pivot = r;
        for (int k = 0; k < 2 * n; ++k)
            std::swap(a[c * 2 * n + k], a[pivot * 2 * n + k]);
        const double scale = 1 / a[c * 2 * n + c];
        for (int k = 0; k < 2 * n; ++k)
            a[c * 2 * n + k] *= scale;
        for (int r = 0; r < n; ++r) {
            const double factor = a[r * 2 * n + c];
            if (r != c && factor != 0)
                for (int k = 0; k < 2 * n; ++k)
                    a[r * 2 * n + k] -= factor * a[c * 2 * n + k];
        }
    }
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            result.to_bernstein.push_back(a[i * 2 * n + n + j]);
    return result;
}

const Interpolation& interpolation(int degree)
{
    static const std::array<Interpolation, 6> table = [] {
        std::array<Interpolation, 6> t;
        for (int d = 1; d <= 5; ++d)
            t[d] = make_interpolation(d);
        return t;
    }();
    return table[degree];
}

/// Bernstein coefficients of the interpolant of values at the nodes.
std::vector<Vec3d> coefficients(const Interpolation& scheme, const std::vector<Vec3d>& values)
{
    const int n = scheme.degree + 1;
    std::vector<Vec3d> result(n);
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            result[i] = result[i] + scheme.to_bernstein[i * n + j] * values[j];
    // the end nodes are the ends: no rounding there, so neighbouring spans share their border bit for bit
    result.front() = values.front();
    result.back() = values.back();
    return result;
}

Vec3d evaluate(const std::vector<Vec3d>& bezier, double t)
{
    Vec3d sum;
    for (size_t i = 0; i < bezier.size(); ++i)
        sum = sum + bernstein(static_cast<int>(bezier.size()) - 1, static_cast<int>(i), t) * bezier[i];
    return sum;
}

/// Largest distance between `f` on [a,b] and its interpolant, at three points between each two nodes.
double interpolation_error(const Interpolation& scheme, const std::function<Vec3d(double)>& f, double a, double b)
{
    std::vector<Vec3d> values;
    for (const double node : scheme.nodes)
        values.push_back(f(std::lerp(a, b, node)));
    const std::vector<Vec3d> bezier = coefficients(scheme, values);
    double worst = 0;
    for (size_t i = 0; i + 1 < scheme.nodes.size(); ++i)
        for (const double s : {0.25, 0.5, 0.75}) {
            const double t = std::lerp(scheme.nodes[i], scheme.nodes[i + 1], s);
            const double error = norm(evaluate(bezier, t) - f(std::lerp(a, b, t)));
            if (!(error <= worst)) // also true for NaN, which no span cures
                worst = std::isnan(error) ? 1e300 : error;
        }
    return worst;
}

/// Degree and breaks of one direction, so that `error_on(scheme, a, b)` is below the tolerance on every span.
struct Spans {
    int degree = 1;
    std::vector<double> breaks;
    bool reached = false;
};

Spans choose_spans(const std::vector<double>& breaks, double tolerance,
                   const std::function<double(const Interpolation&, double, double)>& error_on)
{
    for (const int degree : kTriedDegrees) {
        const Interpolation& scheme = interpolation(degree);
        const bool last_try = degree == kTriedDegrees[std::size(kTriedDegrees) - 1];
        Spans spans{degree, {breaks.front()}, true};
        std::vector<double> todo(breaks.rbegin(), breaks.rend() - 1); // right ends, nearest last
        while (!todo.empty()) {
            const double a = spans.breaks.back(), b = todo.back();
            const bool room = spans.breaks.size() + todo.size() <= kMaxSpans;
            if (error_on(scheme, a, b) > tolerance) {
                spans.reached = false;
                if (!last_try)
                    break;
                if (room && b - a > 1e-9 * (std::abs(a) + std::abs(b))) {
                    spans.reached = true;
                    todo.push_back(0.5 * (a + b));
                    continue;
                }
                return spans;
            }
            spans.breaks.push_back(b);
            todo.pop_back();
        }
        if (spans.reached)
            return spans;
    }
    return {};
}

/// Flat knots with full multiplicity: every span is a Bezier piece.
std::vector<double> bezier_knots(const Spans& spans)
{
    std::vector<double> knots;
    for (size_t i = 0; i < spans.breaks.size(); ++i) {
        const bool end = i == 0 || i + 1 == spans.breaks.size();
        knots.insert(knots.end(), spans.degree + (end ? 1 : 0), spans.breaks[i]);
    }
    return knots;
}

/// Parameters of all control-point columns' nodes: shared span ends appear once.
std::vector<double> all_nodes(const Spans& spans)
{
    const Interpolation& scheme = interpolation(spans.degree);
    std::vector<double> nodes{spans.breaks.front()};
    for (size_t i = 0; i + 1 < spans.breaks.size(); ++i)
        for (int k = 1; k <= spans.degree; ++k)
            nodes.push_back(k == spans.degree ? spans.breaks[i + 1]
                                              : std::lerp(spans.breaks[i], spans.breaks[i + 1], scheme.nodes[k]));
    return nodes;
}

/// Replaces the values at nodes along one line of the net by control points, span by span.
void nodes_to_control_points(const Interpolation& scheme, std::vector<Vec3d>& line)
{
    for (size_t first = 0; first + 1 < line.size(); first += scheme.degree) {
        const auto begin = line.begin() + static_cast<std::ptrdiff_t>(first);
        const std::vector<Vec3d> bezier = coefficients(scheme, {begin, begin + scheme.degree + 1});
        std::copy(bezier.begin(), bezier.end(), begin);
    }
}

/// Lines along which a direction's error is measured: the other direction's breaks and quarter points between them.
std::vector<double> probe_lines(const std::vector<double>& breaks)
{
    std::vector<double> lines;
    for (size_t i = 0; i + 1 < breaks.size(); ++i)
        for (const double s : {0.0, 0.3, 0.6})
            lines.push_back(std::lerp(breaks[i], breaks[i + 1], s));
    lines.push_back(breaks.back());
    // enough lines to meet every feature, few enough that a hundred knots do not make a hundred thousand evaluations
    constexpr size_t kMaxLines = 24;
    if (lines.size() > kMaxLines) {
        std::vector<double> thinned;
        for (size_t i = 0; i < kMaxLines; ++i)
            thinned.push_back(lines[i * (lines.size() - 1) / (kMaxLines - 1)]);
        return thinned;
    }
    return lines;
}

/// The middles between neighbouring nodes.
std::vector<double> middles(const Interpolation& scheme)
{
    std::vector<double> result;
    for (size_t i = 0; i + 1 < scheme.nodes.size(); ++i)
        result.push_back(std::midpoint(scheme.nodes[i], scheme.nodes[i + 1]));
    return result;
}

} // namespace

Result<SplineSurface> approximate_surface(const SampledSurface& source, double tolerance_mm, double& deviation_mm)
{
    // half of the tolerance for each direction: the tensor interpolant's error is about their sum
    const double share = 0.5 * tolerance_mm;
    const std::vector<double> lines_v = probe_lines(source.breaks_v), lines_u = probe_lines(source.breaks_u);
    const Spans spans_u = choose_spans(source.breaks_u, share, [&](const Interpolation& scheme, double a, double b) {
        double worst = 0;
        for (const double v : lines_v)
            worst = std::max(worst, interpolation_error(
                                        scheme, [&](double u) { return source.point(u, v); }, a, b));
        return worst;
    });
    const Spans spans_v = choose_spans(source.breaks_v, share, [&](const Interpolation& scheme, double a, double b) {
        double worst = 0;
        for (const double u : lines_u)
            worst = std::max(worst, interpolation_error(
                                        scheme, [&](double v) { return source.point(u, v); }, a, b));
        return worst;
    });
    if (!spans_u.reached || !spans_v.reached)
        return Error{ErrorCode::UnsupportedSurface, "surface",
                     "is not smooth enough to be approximated within the tolerance"};

    const std::vector<double> nodes_u = all_nodes(spans_u), nodes_v = all_nodes(spans_v);
    SplineSurface spline;
    spline.degree_u = spans_u.degree;
    spline.degree_v = spans_v.degree;
    spline.count_u = static_cast<int>(nodes_u.size());
    spline.count_v = static_cast<int>(nodes_v.size());
    spline.knots_u = bezier_knots(spans_u);
    spline.knots_v = bezier_knots(spans_v);
    std::vector<std::vector<Vec3d>> rows(nodes_u.size());
    for (size_t i = 0; i < nodes_u.size(); ++i) {
        for (const double v : nodes_v)
            rows[i].push_back(source.point(nodes_u[i], v));
        nodes_to_control_points(interpolation(spans_v.degree), rows[i]);
    }
    spline.control_points.resize(nodes_u.size() * nodes_v.size());
    std::vector<Vec3d> column(nodes_u.size());
    for (size_t j = 0; j < nodes_v.size(); ++j) {
        for (size_t i = 0; i < nodes_u.size(); ++i)
            column[i] = rows[i][j];
        nodes_to_control_points(interpolation(spans_u.degree), column);
        for (size_t i = 0; i < nodes_u.size(); ++i)
            spline.control_points[i * nodes_v.size() + j] = {column[i].x, column[i].y, column[i].z, 1.0};
    }

    // the deviation that is reported: measured in every piece, midway between nodes, where it is about largest
    deviation_mm = 0;
    const int p = spans_u.degree, q = spans_v.degree;
    const std::vector<double> middles_u = middles(interpolation(p)), middles_v = middles(interpolation(q));
    for (size_t a = 0; a + 1 < spans_u.breaks.size(); ++a)
        for (size_t b = 0; b + 1 < spans_v.breaks.size(); ++b)
            for (const double s : middles_u)
                for (const double t : middles_v) {
                    Vec3d sum;
                    for (int i = 0; i <= p; ++i)
                        for (int j = 0; j <= q; ++j) {
                            const auto& c = spline.control_points[(a * p + i) * nodes_v.size() + b * q + j];
                            sum = sum + bernstein(p, i, s) * bernstein(q, j, t) * Vec3d{c[0], c[1], c[2]};
                        }
                    const Vec3d exact = source.point(std::lerp(spans_u.breaks[a], spans_u.breaks[a + 1], s),
                                                     std::lerp(spans_v.breaks[b], spans_v.breaks[b + 1], t));
                    deviation_mm = std::max(deviation_mm, norm(sum - exact));
                }
    if (!(deviation_mm <= 4 * tolerance_mm))
        return Error{ErrorCode::UnsupportedSurface, "surface", "its approximation misses the tolerance between nodes"};
    return spline;
}

Result<SplineCurve2d> approximate_curve2d(const std::function<Vec2d(double)>& point, std::vector<double> breaks,
                                          double tolerance)
{
    const auto lifted = [&](double t) {
        const Vec2d p = point(t);
        return Vec3d{p.x, p.y, 0};
    };
    const Spans spans = choose_spans(breaks, tolerance, [&](const Interpolation& scheme, double a, double b) {
        return interpolation_error(scheme, lifted, a, b);
    });
    if (!spans.reached)
        return Error{ErrorCode::InvalidTrim, "pcurve", "is not smooth enough to be approximated"};
    std::vector<Vec3d> line;
    for (const double t : all_nodes(spans))
        line.push_back(lifted(t));
    nodes_to_control_points(interpolation(spans.degree), line);
    SplineCurve2d curve;
    curve.degree = spans.degree;
    curve.knots = bezier_knots(spans);
    for (const Vec3d& p : line)
        curve.control_points.push_back({p.x, p.y, 1.0});
    return curve;
}

} // namespace trimray::kernel
