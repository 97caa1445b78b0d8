// Seeded random surfaces of every kind, for tests: waves on a grid, random knots and weights, native surfaces in random
// frames.
#pragma once

#include "preprocess/import/cad_model.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace trimray::test {

class RandomSurfaces {
public:
    explicit RandomSurfaces(uint32_t seed) : rng_(seed) {}

    double uniform(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(rng_); }
    int integer(int lo, int hi) { return std::uniform_int_distribution<int>(lo, hi)(rng_); }

    /// Clamped flat knots over about [0, spans], with inner multiplicities 1 .. degree (C0 creases included).
    std::vector<double> knots(int degree, int spans)
    {
        std::vector<double> out(degree + 1, uniform(-1, 1));
        double t = out[0];
        for (int i = 1; i < spans; ++i) {
            t += uniform(0.2, 1.5);
            const int multiplicity = integer(0, 3) == 0 ? integer(1, degree) : 1;
            out.insert(out.end(), multiplicity, t);
        }
        out.insert(out.end(), degree + 1, t + uniform(0.2, 1.5));
        return out;
    }

    CadSurface spline(int degree_u, int degree_v, bool rational, int spans_u, int spans_v, double size_mm = 10)
    {
        CadSurface s;
        s.kind = kKindBezier;
        s.source_kind = "bspline";
        SplineSurface& b = s.spline;
        b.degree_u = degree_u;
        b.degree_v = degree_v;
        b.rational = rational;
        b.knots_u = knots(degree_u, spans_u);
        b.knots_v = knots(degree_v, spans_v);
        b.count_u = int(b.knots_u.size()) - degree_u - 1;
        b.count_v = int(b.knots_v.size()) - degree_v - 1;
        for (int i = 0; i < b.count_u; ++i) {
            for (int j = 0; j < b.count_v; ++j) {
                const double x = size_mm * (i + uniform(-0.3, 0.3)) / b.count_u;
                const double y = size_mm * (j + uniform(-0.3, 0.3)) / b.count_v;
                const double z = size_mm * uniform(-0.2, 0.2), w = rational ? std::exp(uniform(-1, 1)) : 1;
                b.control_points.push_back({w * x, w * y, w * z, w});
            }
        }
        s.natural_bounds = {{b.knots_u.front(), b.knots_v.front()}, {b.knots_u.back(), b.knots_v.back()}};
        return s;
    }

    CadFrame frame(double size_mm = 10)
    {
        // a random rotation from a quaternion; every second frame is left-handed
        double q[4], length = 0;
        for (double& c : q) {
            c = std::normal_distribution<double>()(rng_);
            length += c * c;
        }
        for (double& c : q)
            c /= std::sqrt(length);
        const auto [w, x, y, z] = q;
        CadFrame f;
        f.origin = {uniform(-size_mm, size_mm), uniform(-size_mm, size_mm), uniform(-size_mm, size_mm)};
        f.x = {1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)};
        f.y = {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)};
        f.z = {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)};
        if (integer(0, 1) == 1)
            f.y = {-f.y.x, -f.y.y, -f.y.z};
        return f;
    }

    CadSurface native(uint kind)
    {
        CadSurface s;
        s.kind = kind;
        s.source_kind = "native";
        s.frame = frame();
        s.radius = kind == kKindPlane ? 0 : uniform(0.1, 10);
        s.minor_radius = kind == kKindTorus ? uniform(0.1, 1.0) * s.radius : 0;
        s.half_angle = kind == kKindCone ? uniform(-1.4, 1.4) : 0;
        return s;
    }

    /// A rectangle in the parameters of a native surface, of every size up to the whole turn.
    Rect2d native_domain(uint kind)
    {
        constexpr double kPi = 3.14159265358979323846;
        Rect2d d;
        const double span = integer(0, 3) == 0 ? 2 * kPi : uniform(0.01, 2 * kPi);
        d.lo.x = kind == kKindPlane ? uniform(-20, 20) : uniform(-2 * kPi, 2 * kPi);
        d.hi.x = d.lo.x + span;
        if (kind == kKindSphere) {
            const double a = uniform(-kPi / 2, kPi / 2), b = uniform(-kPi / 2, kPi / 2);
            d.lo.y = integer(0, 2) == 0 ? -kPi / 2 : std::min(a, b);
            d.hi.y = integer(0, 2) == 0 ? kPi / 2 : std::max(a, b);
        } else {
            d.lo.y = uniform(-2 * kPi, 2 * kPi);
            d.hi.y = d.lo.y + (kind == kKindTorus && integer(0, 3) == 0 ? 2 * kPi : uniform(0.01, 2 * kPi));
        }
        return d;
    }

private:
    std::mt19937 rng_;
};

} // namespace trimray::test
