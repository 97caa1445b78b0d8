#include "format/leaf_bend.h"

#include "format/leaf_geometry.h"

#include <algorithm>
#include <cmath>

namespace trimray {
namespace {

// Rounding of nets cut and multiplied in double, of their largest point, with room.
constexpr double kRounding = 1e-12;

/// A net of vectors of 4.
using Vectors = Net;

double binomial(int n, int k)
{
    double b = 1;
    for (int i = 1; i <= k; ++i)
        b = b * (n - k + i) / i;
    return b;
}

/// The net of a product of a vector net and the fourth coordinate of another, degree by degree the sum.
/// Source: Farouki & Rajan 1988.
Vectors times_weight(const Vectors& a, const Net& b)
{
    const int pa = a.count_u - 1, qa = a.count_v - 1, pb = b.count_u - 1, qb = b.count_v - 1;
    Vectors product{pa + pb + 1, qa + qb + 1, {}};
    product.points.assign(size_t(product.count_u) * product.count_v, Point4{});
    for (int i = 0; i <= pa; ++i)
        for (int j = 0; j <= qa; ++j)
            for (int k = 0; k <= pb; ++k)
                for (int l = 0; l <= qb; ++l) {
                    const double share = binomial(pa, i) * binomial(pb, k) / binomial(pa + pb, i + k) *
                                         binomial(qa, j) * binomial(qb, l) / binomial(qa + qb, j + l) *
                                         b.points[size_t(k) * b.count_v + l][3];
                    Point4& p = product.points[size_t(i + k) * product.count_v + j + l];
                    for (int c = 0; c < 4; ++c)
                        p[c] += share * a.points[size_t(i) * a.count_v + j][c];
                }
    return product;
}

/// d/du or d/dv over the net's own [0, 1].
Vectors derivative(const Net& net, int direction)
{
    Vectors d{net.count_u - (direction == 0), net.count_v - (direction == 1), {}};
    const int degree = direction == 0 ? d.count_u : d.count_v;
    for (int i = 0; i < d.count_u; ++i)
        for (int j = 0; j < d.count_v; ++j) {
            const Point4& a = net.points[size_t(i) * net.count_v + j];
            const Point4& b = net.points[size_t(i + (direction == 0)) * net.count_v + j + (direction == 1)];
            Point4 p;
            for (int c = 0; c < 4; ++c)
                p[c] = degree * (b[c] - a[c]);
            d.points.push_back(p);
        }
    return d;
}

/// Degree raised by one. Source: Piegl & Tiller 5.36.
Vectors elevated(const Vectors& net, int direction)
{
    Vectors up{net.count_u + (direction == 0), net.count_v + (direction == 1), {}};
    const int n = direction == 0 ? net.count_u : net.count_v; // degree + 1
    for (int i = 0; i < up.count_u; ++i)
        for (int j = 0; j < up.count_v; ++j) {
            const int k = direction == 0 ? i : j;
            const auto at = [&](int index) -> const Point4& {
                return direction == 0 ? net.points[size_t(index) * net.count_v + j]
                                      : net.points[size_t(i) * net.count_v + index];
            };
            Point4 p{};
            for (int c = 0; c < 4; ++c)
                p[c] = (k > 0 ? double(k) / n * at(k - 1)[c] : 0) + (k < n ? (1 - double(k) / n) * at(k)[c] : 0);
            up.points.push_back(p);
        }
    return up;
}

/// S_u or S_v as vectors over a positive scalar: numerator, and the least value of what divides it.
struct Quotient {
    Vectors above;
    Net below; // its fourth coordinate; empty: 1
};

Quotient tangent(const Net& net, int direction, bool rational)
{
    Quotient q{derivative(net, direction), {}};
    if (!rational) {
        for (Point4& p : q.above.points)
            for (int c = 0; c < 3; ++c)
                p[c] /= net.points[0][3];
        return q;
    }
    // (P / w)' = (P' w - P w') / w^2
    Vectors a = times_weight(q.above, net);
    const Vectors b = times_weight(net, q.above);
    for (size_t i = 0; i < a.points.size(); ++i)
        for (int c = 0; c < 3; ++c)
            a.points[i][c] -= b.points[i][c];
    q.above = elevated(a, direction);
    q.below = times_weight(net, net);
    return q;
}

Point3 value(const Quotient& q, const std::array<double, 2>& at)
{
    const auto point = [](const Net& net, const std::array<double, 2>& t) {
        // de Casteljau's end point: the lower part's last
        const Net part = part_of(part_of(net, 0, 0, std::max(t[0], 1e-300)), 1, 0, std::max(t[1], 1e-300));
        return part.points.back();
    };
    const Point4 a = point(q.above, at);
    const double w = q.below.points.empty() ? 1 : point(q.below, at)[3];
    return {a[0] / w, a[1] / w, a[2] / w};
}

/// The largest of |x - value| along the plane and across it, by the hull.
struct Off {
    double along = 0, across = 0;
};

Off farthest(const Quotient& q, const Point3& from, const std::array<Point3, 3>& axes)
{
    double least = 1, largest = 0;
    if (!q.below.points.empty()) {
        least = std::numeric_limits<double>::infinity();
        for (const Point4& w : q.below.points)
            least = std::min(least, w[3]);
    }
    Off off;
    for (size_t i = 0; i < q.above.points.size(); ++i) {
        const double w = q.below.points.empty() ? 1 : q.below.points[i][3];
        Point3 d;
        for (int c = 0; c < 3; ++c) {
            d[c] = q.above.points[i][c] - w * from[c];
            largest = std::max(largest, std::abs(q.above.points[i][c]));
        }
        off.along = std::max(off.along, std::hypot(dot3(d, axes[0]), dot3(d, axes[1])));
        off.across = std::max(off.across, std::abs(dot3(d, axes[2])));
    }
    if (!(least > 0))
        return {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    return {(off.along + kRounding * largest) / least, (off.across + kRounding * largest) / least};
}

} // namespace

LeafBend leaf_bend(const Net& patch, const std::array<double, 2>& lo, const std::array<double, 2>& hi,
                   const std::array<double, 2>& at)
{
    const Net net = part_of(part_of(patch, 0, lo[0], hi[0]), 1, lo[1], hi[1]);
    const bool rational = net.rational();
    const Quotient du = tangent(net, 0, rational), dv = tangent(net, 1, rational);
    const std::array<double, 2> local{(at[0] - lo[0]) / (hi[0] - lo[0]), (at[1] - lo[1]) / (hi[1] - lo[1])};
    const Point3 u = value(du, local), v = value(dv, local);
    // Gram & Schmidt
    const double r11 = std::sqrt(dot3(u, u));
    if (!(r11 > 0))
        return {};
    const Point3 q0{u[0] / r11, u[1] / r11, u[2] / r11};
    const double r12 = dot3(q0, v);
    const Point3 rest{v[0] - r12 * q0[0], v[1] - r12 * q0[1], v[2] - r12 * q0[2]};
    const double r22 = std::sqrt(dot3(rest, rest));
    if (!(r22 > 0))
        return {};
    const Point3 q1{rest[0] / r22, rest[1] / r22, rest[2] / r22};
    const std::array<Point3, 3> axes{q0, q1, cross3(q0, q1)};

    // columns of D: e_u / r11 and (e_v - r12 / r11 e_u) / r22
    const Off off_u = farthest(du, u, axes), off_v = farthest(dv, v, axes);
    const double shear = std::abs(r12) / r11;
    const auto norm = [&](double of_u, double of_v) { return std::hypot(of_u / r11, (of_v + shear * of_u) / r22); };
    return {norm(off_u.along, off_v.along), norm(off_u.across, off_v.across)};
}

} // namespace trimray
