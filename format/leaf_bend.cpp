#include "format/leaf_bend.h"

#include "format/bend_hull.h"
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

constexpr int kMostPoints = int(kMaxDegree) + 1; // along one direction

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
    return sum(leaf_bend_by_side(patch, derivative_rounding(patch), lo, hi));
}

LeafBend sum(const std::array<LeafBend, 2>& by_side)
{
    return {by_side[0].along + by_side[1].along, by_side[0].across + by_side[1].across};
}

std::array<LeafBend, 2> leaf_bend_by_side(const Net& patch, const std::array<double, 2>& rounding,
                                          const std::array<double, 2>& lo, const std::array<double, 2>& hi)
{
    BendFrame f;
    Net net = patch;
    double middle[2]; // where it is in the reach
    for (int i = 0; i < 2; ++i) {
        f.half[i] = 0.5 * (hi[i] - lo[i]);
        const double c = lo[i] + f.half[i];
        const double from = std::max(c - kNewtonReach * f.half[i], -double(kNewtonOutside));
        const double to = std::min(c + kNewtonReach * f.half[i], 1 + double(kNewtonOutside));
        f.begin[i] = from - c;
        f.end[i] = to - c;
        f.per_side[i] = 1 / (to - from);
        middle[i] = (c - from) * f.per_side[i];
        net = part_of(net, i, from, to);
    }

    const int degree_u = net.count_u - 1, degree_v = net.count_v - 1;
    const Basis at_u(degree_u, middle[0]), at_v(degree_v, middle[1]);
    const Point4 p = sum_of(net, [&](int i, int j) { return at_u.value[i] * at_v.value[j]; });
    const Point4 p_u = sum_of(net, [&](int i, int j) { return at_u.slope[i] * at_v.value[j] * f.per_side[0]; });
    const Point4 p_v = sum_of(net, [&](int i, int j) { return at_u.value[i] * at_v.slope[j] * f.per_side[1]; });
    const double w = p[3];
    if (!(w > 0))
        return {};
    Point3& s = f.middle;
    Point3 u, v;
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
    const auto loss = [&](int i, int degree) {
        return double(HWY_NAMESPACE::loss_of(float(rounding[i]), patch_rounding(degree_u, degree_v), degree,
                                             float(lo[i]), float(hi[i])));
    };
    if (!(loss(0, degree_u) * std::sqrt(dot3(v, v)) + loss(1, degree_v) * f.r11 < kOneRoot * f.r11 * f.r22))
        return {};
    f.axis[1] = {rest[0] / f.r22, rest[1] / f.r22, rest[2] / f.r22};
    f.axis[2] = cross3(f.axis[0], f.axis[1]);

    return bend_over(net, f);
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
