// A patch record's surface from the single-precision numbers it holds, in double, straight from pack_layout.h: for
// tests and for measuring errors. Slow, and shares no code with the tracers.
#pragma once

#include "format/pack_layout.h"

#include <array>
#include <cmath>
#include <vector>

namespace trimray {

/// S(u, v) of a record in patch units, from the single-precision numbers it holds, in double. uv_patch.
inline std::array<double, 3> point_of(const PatchRecord& patch, const float* control_points, double u, double v)
{
    const double r = patch.param[0], cu = std::cos(u), su = std::sin(u);
    switch (patch.shape & 0xffu) {
    case kKindPlane:
        return {u, v, 0};
    case kKindCylinder:
        return {r * cu, r * su, v};
    case kKindCone: {
        const double a = std::atan(double(patch.param[1])), rho = r + v * std::sin(a);
        return {rho * cu, rho * su, v * std::cos(a)};
    }
    case kKindSphere:
        return {r * std::cos(v) * cu, r * std::cos(v) * su, r * std::sin(v)};
    case kKindTorus: {
        const double rho = r + patch.param[1] * std::cos(v);
        return {rho * cu, rho * su, patch.param[1] * std::sin(v)};
    }
    default:
        break;
    }
    // Bernstein sums
    const int p = int(patch.shape >> 8 & 0xffu), q = int(patch.shape >> 16 & 0xffu);
    const bool rational = (patch.shape & kShapeRational) != 0;
    const auto bernstein = [](int n, double t) {
        std::vector<double> b(n + 1);
        for (int i = 0; i <= n; ++i)
            b[i] = std::exp(std::lgamma(n + 1.0) - std::lgamma(i + 1.0) - std::lgamma(n - i + 1.0)) * std::pow(t, i) *
                   std::pow(1 - t, n - i);
        return b;
    };
    const std::vector<double> bu = bernstein(p, u), bv = bernstein(q, v);
    double sum[4] = {0, 0, 0, rational ? 0.0 : 1.0};
    const int floats = rational ? 4 : 3;
    for (int i = 0; i <= p; ++i)
        for (int j = 0; j <= q; ++j)
            for (int c = 0; c < floats; ++c)
                sum[c] += bu[i] * bv[j] * control_points[patch.first_control_point + (i * (q + 1) + j) * floats + c];
    return {sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]};
}

} // namespace trimray
