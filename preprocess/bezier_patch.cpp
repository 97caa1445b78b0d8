#include "preprocess/bezier_patch.h"

#include "preprocess/spline.h"
#include "preprocess/vec3d.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace trimray {
namespace {

// Weights that differ by less are equal but for the rounding of the operators (at most 26 terms).
constexpr double kEqualWeights = 4e-15;

using Point4 = std::array<double, 4>;

/// The Bezier operators of one direction, one after the other.
struct Direction {
    int degree = 1;
    std::vector<SpanCut> cuts;
    std::vector<double> operators; // (degree + 1)^2 each

    const double* matrix(size_t cut) const { return &operators[cut * (degree + 1) * (degree + 1)]; }
};

Direction make_direction(const std::vector<double>& knots, int degree, double period, double lo, double hi)
{
    Direction d{degree, cut_spans(knots, degree, period, lo, hi), {}};
    const size_t size = size_t(degree + 1) * (degree + 1);
    d.operators.resize(d.cuts.size() * size);
    for (size_t i = 0; i < d.cuts.size(); ++i)
        bezier_operator(knots, degree, d.cuts[i].k, d.cuts[i].a, d.cuts[i].b, &d.operators[i * size]);
    return d;
}

/// out = sum_i row[i] points[i * stride], skipping the zeros that knots of full multiplicity leave.
inline Point4 combine(const double* row, int count, const Point4* points, size_t stride)
{
    Point4 out{0, 0, 0, 0};
    for (int i = 0; i < count; ++i) {
        const double e = row[i];
        if (e == 0)
            continue;
        const Point4& p = points[i * stride];
        for (int c = 0; c < 4; ++c)
            out[c] += e * p[c];
    }
    return out;
}

bool weights_are_equal(const std::vector<Point4>& points)
{
    double lo = points[0][3], hi = lo;
    for (const Point4& p : points) {
        lo = std::min(lo, p[3]);
        hi = std::max(hi, p[3]);
    }
    return hi - lo <= kEqualWeights * std::abs(hi);
}

/// A patch whose weights are all w is polynomial: its points are divided by w.
void drop_equal_weights(BezierPatch& patch)
{
    if (!patch.rational || !weights_are_equal(patch.control_points) || patch.control_points[0][3] == 0)
        return;
    for (Point4& p : patch.control_points)
        p = {p[0] / p[3], p[1] / p[3], p[2] / p[3], 1};
    patch.rational = false;
}

} // namespace

Vec3d ControlBox::centre() const
{
    return 0.5 * (lo + hi);
}

double ControlBox::half_diagonal() const
{
    return 0.5 * norm(hi - lo);
}

ControlBox control_box(std::span<const std::array<double, 4>> points)
{
    constexpr double kInf = std::numeric_limits<double>::infinity();
    ControlBox box{{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}};
    for (const auto& [x, y, z, w] : points) {
        box.lo = {std::min(box.lo.x, x / w), std::min(box.lo.y, y / w), std::min(box.lo.z, z / w)};
        box.hi = {std::max(box.hi.x, x / w), std::max(box.hi.y, y / w), std::max(box.hi.z, z / w)};
    }
    return box;
}

std::vector<BezierPatch> decompose(const CadSurface& surface, const Rect2d& domain)
{
    const SplineSurface& s = surface.spline;
    assert(s.degree_u <= int(kMaxDegree) && s.degree_v <= int(kMaxDegree) && "the kernel's own limit");
    assert(s.control_points.size() == size_t(s.count_u) * s.count_v && "a full net");
    const Direction u = make_direction(s.knots_u, s.degree_u, surface.period_u, domain.lo.x, domain.hi.x);
    const Direction v = make_direction(s.knots_v, s.degree_v, surface.period_v, domain.lo.y, domain.hi.y);
    std::vector<BezierPatch> patches;
    if (u.cuts.empty() || v.cuts.empty())
        return patches;
    patches.reserve(u.cuts.size() * v.cuts.size());

    // columns of the net that some span of v needs
    int first_column = s.count_v, last_column = 0;
    for (const SpanCut& cut : v.cuts) {
        first_column = std::min(first_column, cut.k - s.degree_v);
        last_column = std::max(last_column, cut.k);
    }
    const int columns = last_column - first_column + 1, nu = s.degree_u + 1, nv = s.degree_v + 1;
    std::vector<Point4> strip(size_t(nu) * columns); // Bezier along u, B-spline along v
    for (size_t i = 0; i < u.cuts.size(); ++i) {
        const SpanCut& cu = u.cuts[i];
        const Point4* net = &s.control_points[size_t(cu.k - s.degree_u) * s.count_v + first_column];
        for (int row = 0; row < nu; ++row)
            for (int column = 0; column < columns; ++column)
                strip[size_t(row) * columns + column] =
                    combine(u.matrix(i) + row * nu, nu, net + column, size_t(s.count_v));
        for (size_t j = 0; j < v.cuts.size(); ++j) {
            const SpanCut& cv = v.cuts[j];
            BezierPatch& patch = patches.emplace_back();
            patch.degree_u = s.degree_u;
            patch.degree_v = s.degree_v;
            patch.rational = s.rational;
            patch.domain = {{cu.a + cu.shift, cv.a + cv.shift}, {cu.b + cu.shift, cv.b + cv.shift}};
            patch.control_points.resize(size_t(nu) * nv);
            for (int row = 0; row < nu; ++row) {
                const Point4* from = &strip[size_t(row) * columns + (cv.k - s.degree_v - first_column)];
                for (int column = 0; column < nv; ++column)
                    patch.control_points[size_t(row) * nv + column] = combine(v.matrix(j) + column * nv, nv, from, 1);
            }
            drop_equal_weights(patch);
        }
    }
    return patches;
}

} // namespace trimray
