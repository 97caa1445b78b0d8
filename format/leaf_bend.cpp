#include "format/leaf_bend.h"

#include "format/leaf_geometry.h"
#include "shaders/shared/newton_reach.h"

#include <algorithm>
#include <cmath>

namespace trimray {
namespace {

using HWY_NAMESPACE::kNewtonOutside;
using HWY_NAMESPACE::kNewtonReach;
using HWY_NAMESPACE::kOneRoot;
using HWY_NAMESPACE::patch_rounding;

constexpr int kMostPoints = int(kMaxDegree) + 2; // along one direction, degree raised by one

/// (y_1, y_2, z, w, y_1 of the plane, y_2 of the plane): see raised.
using Point6 = std::array<double, 6>;

/// A polynomial over [0, 1]^2 in scaled Bernstein form: coefficients times both binomials. Then to raise the degree and
/// to multiply is to add shifted coefficients, and the binomials leave a quotient of two coefficients.
/// Source: Farouki & Rajan 1988.
struct Scaled {
    int count_u = 0, count_v = 0;
    Point6 at[kMostPoints][kMostPoints]; // [0, count_u) x [0, count_v); only that is ever set
};

void binomials(int degree, double (&row)[kMostPoints])
{
    row[0] = 1;
    for (int i = 1; i <= degree; ++i)
        row[i] = row[i - 1] * (degree - i + 1) / i;
}

/// to = scale d/du or d/dv from. With C_i = binomial(n, i) c_i the derivative is (i + 1) C_(i+1) - (n - i) C_i.
void derive(const Scaled& from, int direction, double scale, Scaled& to)
{
    const int step_u = direction == 0, step_v = direction == 1;
    to.count_u = std::max(from.count_u - step_u, 1);
    to.count_v = std::max(from.count_v - step_v, 1);
    const int degree = (direction == 0 ? from.count_u : from.count_v) - 1;
    for (int i = 0; i < to.count_u; ++i) {
        for (int j = 0; j < to.count_v; ++j) {
            const int k = direction == 0 ? i : j;
            for (int c = 0; c < 4; ++c)
                to.at[i][j][c] =
                    degree == 0
                        ? 0
                        : scale * ((k + 1) * from.at[i + step_u][j + step_v][c] - (degree - k) * from.at[i][j][c]);
        }
    }
}

/// Raises the degrees until the counts are these: multiplies by (1 - t) + t.
void raise_to(Scaled& net, int count_u, int count_v)
{
    for (; net.count_u < count_u; ++net.count_u) {
        for (int j = 0; j < net.count_v; ++j) {
            net.at[net.count_u][j] = net.at[net.count_u - 1][j];
            for (int i = net.count_u - 1; i > 0; --i)
                for (int c = 0; c < 4; ++c)
                    net.at[i][j][c] += net.at[i - 1][j][c];
        }
    }
    for (; net.count_v < count_v; ++net.count_v) {
        for (int i = 0; i < net.count_u; ++i) {
            net.at[i][net.count_v] = net.at[i][net.count_v - 1];
            for (int j = net.count_v - 1; j > 0; --j)
                for (int c = 0; c < 4; ++c)
                    net.at[i][j][c] += net.at[i][j - 1][c];
        }
    }
}

/// The derivative at the leaf's middle and the leaf's place in its reach.
struct Frame {
    Point3 axis[3]; // q_1, q_2, n
    double r11 = 0, r12 = 0, r22 = 0;
    double half[2] = {};               // the leaf's half sides, uv_patch
    double begin[2] = {}, end[2] = {}; // the reach less the middle
};

/// Raises both degrees by one and sets the last two components to w times the linear map R (u - c) of the reach.
void raise_with_plane(Scaled& net, const Frame& f)
{
    for (int i = net.count_u; i >= 0; --i) {
        for (int j = net.count_v; j >= 0; --j) {
            const auto before = [&](int k, int l, int c) {
                const int row = i - k, column = j - l;
                return row >= 0 && row < net.count_u && column >= 0 && column < net.count_v ? net.at[row][column][c]
                                                                                            : 0.0;
            };
            const double w00 = before(0, 0, 3), w10 = before(1, 0, 3), w01 = before(0, 1, 3), w11 = before(1, 1, 3);
            const double u_w = f.begin[0] * (w00 + w01) + f.end[0] * (w10 + w11);
            const double v_w = f.begin[1] * (w00 + w10) + f.end[1] * (w01 + w11);
            Point6 p;
            for (int c = 0; c < 4; ++c)
                p[c] = before(0, 0, c) + before(1, 0, c) + before(0, 1, c) + before(1, 1, c);
            p[4] = f.r11 * u_w + f.r12 * v_w;
            p[5] = f.r22 * v_w;
            net.at[i][j] = p;
        }
    }
    ++net.count_u;
    ++net.count_v;
}

double square(double x, double y)
{
    return x * x + y * y;
}

/// Square of the largest singular value.
double squared_norm(const double (&m)[2][2])
{
    const double sum = square(m[0][0], m[0][1]) + square(m[1][0], m[1][1]);
    const double det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    return 0.5 * (sum + std::sqrt(std::max(0.0, sum * sum - 4 * det * det)));
}

void keep_largest(double& largest, double value)
{
    largest = std::max(largest, value);
}

/// The polynomials of the homogeneous surface over the reach, moved to S_c and turned into the frame, in uv_patch.
struct SecondOrder {
    Scaled value, u, v, uu, uv, vv;
};

/// Bounds of |D^2 y[d, .]| and |D^2 z[d, .]| added up over the leaf's two half sides d, where (y, z) is the surface in
/// the frame as a function of y = R (u - c): D is the derivative by that, D y_c = 1 and D z_c = 0.
/// With y = p / w, z = q / w
///     D^2 y[d, .] = (D^2 p[d, .] - w_d D y - y_d D w - y D^2 w[d, .]) / w
/// and D y = 1 + (at most slope), y = (its linear part) + (at most off): what comes from 1 and the linear part is one
/// polynomial, bounded by its hull, what comes from the rest is of third order. The same for z with 0 in their place.
std::array<LeafBend, 2> bend_of(const SecondOrder& s, const Frame& f, bool rational)
{
    // squares, but for off_across and grows_by
    double off = 0, slope = 0, off_across = 0, slope_across = 0; // |y - R (u - c)|, |D y - 1|, |z|, |D z|
    double grows = 0, grows_by[2] = {}, turns[2] = {};           // |D w| / w, |w_d| / w, |D^2 w[d, .]| / w
    double along[2] = {}, across[2] = {};
    // steps d from the middle: along half a side, in R
    const double step[2][2] = {{f.half[0] * f.r11, 0}, {f.half[1] * f.r12, f.half[1] * f.r22}};
    const double shear = f.r12 / f.r11;
    for (int i = 0; i < s.value.count_u; ++i) {
        for (int j = 0; j < s.value.count_v; ++j) {
            const Point6 &p = s.value.at[i][j], &u = s.u.at[i][j], &v = s.v.at[i][j];
            const Point6* second[2][2] = {{&s.uu.at[i][j], &s.uv.at[i][j]}, {&s.uv.at[i][j], &s.vv.at[i][j]}};
            if (!(p[3] > 0))
                return {};
            const double per_w = 1 / p[3];
            // D by R's columns: D_1 = d_u / r11, D_2 = (d_v - r12 / r11 d_u) / r22
            const double first = per_w / f.r11, other = per_w / f.r22;
            const auto d1 = [&](const Point6& of_u, int c) { return of_u[c] * first; };
            const auto d2 = [&](const Point6& of_u, const Point6& of_v, int c) {
                return (of_v[c] - shear * of_u[c]) * other;
            };
            double dw[2] = {0, 0};
            if (rational) {
                dw[0] = d1(u, 3);
                dw[1] = d2(u, v, 3);
                keep_largest(grows, square(dw[0], dw[1]));
                keep_largest(off, per_w * per_w * square(p[0] - p[4], p[1] - p[5]));
                keep_largest(off_across, per_w * std::abs(p[2]));
                keep_largest(slope_across, square(d1(u, 2), d2(u, v, 2)));
                const double m[2][2] = {{d1(u, 0) - 1 - d1(u, 4), d2(u, v, 0) - d2(u, v, 4)},
                                        {d1(u, 1) - d1(u, 5), d2(u, v, 1) - 1 - d2(u, v, 5)}};
                keep_largest(slope, squared_norm(m));
            }
            for (int d = 0; d < 2; ++d) {
                const Point6 &of_u = *second[d][0], &of_v = *second[d][1];
                const double h = f.half[d];
                double m[2][2];
                for (int c = 0; c < 2; ++c) {
                    m[c][0] = h * d1(of_u, c);
                    m[c][1] = h * d2(of_u, of_v, c);
                }
                if (rational) {
                    const double w_d = h * per_w * (d == 0 ? u : v)[3];
                    for (int c = 0; c < 2; ++c) {
                        m[c][0] -= step[d][c] * dw[0] + h * d1(of_u, 4 + c);
                        m[c][1] -= step[d][c] * dw[1] + h * d2(of_u, of_v, 4 + c);
                        m[c][c] -= w_d;
                    }
                    keep_largest(grows_by[d], std::abs(w_d));
                    keep_largest(turns[d], h * h * square(d1(of_u, 3), d2(of_u, of_v, 3)));
                }
                keep_largest(along[d], squared_norm(m));
                keep_largest(across[d], h * h * square(d1(of_u, 2), d2(of_u, of_v, 2)));
            }
        }
    }
    for (double* squared :
         {&off, &slope, &slope_across, &grows, &turns[0], &turns[1], &along[0], &along[1], &across[0], &across[1]})
        *squared = std::sqrt(*squared);
    slope += off * grows; // D y = (D p - y D w) / w
    slope_across += off_across * grows;
    std::array<LeafBend, 2> bend;
    for (int d = 0; d < 2; ++d) {
        const double of_slope = grows_by[d] + std::hypot(step[d][0], step[d][1]) * grows;
        bend[d].along = along[d] + of_slope * slope + turns[d] * off;
        bend[d].across = across[d] + of_slope * slope_across + turns[d] * off_across;
    }
    return bend;
}

/// Sum over the net of weight (i, j) times its points.
template <class Weight>
Point4 sum_of(const Net& net, Weight weight)
{
    Point4 sum{};
    for (int i = 0; i < net.count_u; ++i)
        for (int j = 0; j < net.count_v; ++j)
            for (int c = 0; c < 4; ++c)
                sum[c] += weight(i, j) * net.points[size_t(i) * net.count_v + j][c];
    return sum;
}

/// Bernstein polynomials of a degree at t, and their derivatives.
struct Basis {
    double value[kMostPoints], slope[kMostPoints];
    Basis(int degree, double t)
    {
        value[0] = 1;
        slope[0] = 0;
        for (int k = 1; k <= degree; ++k) {
            if (k == degree)
                for (int i = 0; i <= k; ++i)
                    slope[i] = degree * ((i > 0 ? value[i - 1] : 0) - (i < k ? value[i] : 0));
            value[k] = t * value[k - 1];
            for (int i = k - 1; i > 0; --i)
                value[i] = (1 - t) * value[i] + t * value[i - 1];
            value[0] *= 1 - t;
        }
    }
};

} // namespace

LeafBend leaf_bend(const Net& patch, const std::array<double, 2>& lo, const std::array<double, 2>& hi)
{
    return sum(leaf_bend_by_side(patch, lo, hi));
}

LeafBend sum(const std::array<LeafBend, 2>& by_side)
{
    return {by_side[0].along + by_side[1].along, by_side[0].across + by_side[1].across};
}

std::array<LeafBend, 2> leaf_bend_by_side(const Net& patch, const std::array<double, 2>& lo,
                                          const std::array<double, 2>& hi)
{
    Frame f;
    Net net = patch;
    double per_side[2], middle[2]; // of the reach: 1 / side, and where the leaf's middle is
    for (int i = 0; i < 2; ++i) {
        f.half[i] = 0.5 * (hi[i] - lo[i]);
        const double c = lo[i] + f.half[i];
        const double from = std::max(c - kNewtonReach * f.half[i], -double(kNewtonOutside));
        const double to = std::min(c + kNewtonReach * f.half[i], 1 + double(kNewtonOutside));
        f.begin[i] = from - c;
        f.end[i] = to - c;
        per_side[i] = 1 / (to - from);
        middle[i] = (c - from) * per_side[i];
        net = part_of(net, i, from, to);
    }
    const bool rational = net.rational();

    const int degree_u = net.count_u - 1, degree_v = net.count_v - 1;
    const Basis at_u(degree_u, middle[0]), at_v(degree_v, middle[1]);
    const Point4 p = sum_of(net, [&](int i, int j) { return at_u.value[i] * at_v.value[j]; });
    const Point4 p_u = sum_of(net, [&](int i, int j) { return at_u.slope[i] * at_v.value[j] * per_side[0]; });
    const Point4 p_v = sum_of(net, [&](int i, int j) { return at_u.value[i] * at_v.slope[j] * per_side[1]; });
    const double w = p[3];
    if (!(w > 0))
        return {};
    Point3 s, u, v;
    for (int c = 0; c < 3; ++c) {
        s[c] = p[c] / w;
        u[c] = (p_u[c] - p_u[3] * s[c]) / w;
        v[c] = (p_v[c] - p_v[3] * s[c]) / w;
    }
    // Gram & Schmidt
    f.r11 = std::sqrt(dot3(u, u));
    if (!(f.r11 > 0))
        return {};
    f.axis[0] = {u[0] / f.r11, u[1] / f.r11, u[2] / f.r11};
    f.r12 = dot3(f.axis[0], v);
    const Point3 rest{v[0] - f.r12 * f.axis[0][0], v[1] - f.r12 * f.axis[0][1], v[2] - f.r12 * f.axis[0][2]};
    f.r22 = std::sqrt(dot3(rest, rest));
    if (!(f.r22 > 0))
        return {};
    // where rounding turns the plane that much no ray is proved anything
    const std::array<double, 2> most = derivative_rounding(patch);
    const auto loss = [&](int i, int degree) {
        return double(HWY_NAMESPACE::loss_of(float(most[i]), patch_rounding(degree_u, degree_v), degree, float(lo[i]),
                                             float(hi[i])));
    };
    if (!(loss(0, degree_u) * std::sqrt(dot3(v, v)) + loss(1, degree_v) * f.r11 < kOneRoot * f.r11 * f.r22))
        return {};
    f.axis[1] = {rest[0] / f.r22, rest[1] / f.r22, rest[2] / f.r22};
    f.axis[2] = cross3(f.axis[0], f.axis[1]);

    SecondOrder nets;
    double share_u[kMostPoints], share_v[kMostPoints];
    binomials(degree_u, share_u);
    binomials(degree_v, share_v);
    nets.value.count_u = net.count_u;
    nets.value.count_v = net.count_v;
    for (int i = 0; i < net.count_u; ++i) {
        for (int j = 0; j < net.count_v; ++j) {
            const Point4& from = net.points[size_t(i) * net.count_v + j];
            const double share = share_u[i] * share_v[j];
            const Point3 moved{from[0] - from[3] * s[0], from[1] - from[3] * s[1], from[2] - from[3] * s[2]};
            for (int c = 0; c < 3; ++c)
                nets.value.at[i][j][c] = share * dot3(moved, f.axis[c]);
            nets.value.at[i][j][3] = share * from[3];
        }
    }
    derive(nets.value, 0, per_side[0], nets.u);
    derive(nets.value, 1, per_side[1], nets.v);
    derive(nets.u, 0, per_side[0], nets.uu);
    derive(nets.u, 1, per_side[1], nets.uv);
    derive(nets.v, 1, per_side[1], nets.vv);
    for (Scaled* net_of : {&nets.u, &nets.v, &nets.uu, &nets.uv, &nets.vv})
        raise_to(*net_of, net.count_u, net.count_v);
    if (rational)
        for (Scaled* net_of : {&nets.value, &nets.u, &nets.v, &nets.uu, &nets.uv, &nets.vv})
            raise_with_plane(*net_of, f);
    return bend_of(nets, f, rational);
}

std::array<double, 2> derivative_rounding(const Net& patch)
{
    double ratio[2] = {1, 1}; // of the weights of two neighbours along u, v
    const auto weight = [&](int i, int j) { return patch.points[size_t(i) * patch.count_v + j][3]; };
    const auto compare = [](double& most, double a, double b) { most = std::max({most, a / b, b / a}); };
    for (int i = 0; i < patch.count_u; ++i) {
        for (int j = 0; j < patch.count_v; ++j) {
            if (i > 0)
                compare(ratio[0], weight(i, j), weight(i - 1, j));
            if (j > 0)
                compare(ratio[1], weight(i, j), weight(i, j - 1));
        }
    }
    const int degree[2] = {patch.count_u - 1, patch.count_v - 1};
    const double of_point = 2 * patch_rounding(degree[0], degree[1]), of_weight = patch.rational() ? 2 : 1;
    const auto bound = [&](int i) { return std::min(of_point * degree[i] * of_weight * ratio[i], kMostRounding); };
    return {bound(0), bound(1)};
}

} // namespace trimray
