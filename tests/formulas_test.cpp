// The shared formulas, in lanes, against long double.
#include "runtime/cpu_evaluate.h"
#include "shaders/shared/edge.h"
#include "shaders/shared/language.h"
#include "shaders/shared/precision.h"
#include "shaders/shared/quadric.h"
#include "shaders/shared/torus.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <utility>
#include <vector>

HWY_BEFORE_NAMESPACE();
namespace trimray {
namespace HWY_NAMESPACE {
namespace {

struct Lanes {
    alignas(64) float at[kLanes];
};
Lanes values(real a)
{
    Lanes lanes;
    store(a, lanes.at);
    return lanes;
}

TEST(formulas, angle_of_is_the_angle)
{
    std::mt19937 random(1);
    std::normal_distribution<float> any;
    double worst = 0;
    for (int k = 0; k < 20000; ++k) {
        Lanes x, y;
        for (int i = 0; i < kLanes; ++i) {
            x.at[i] = any(random) * std::ldexp(1.0f, int(random() % 40) - 20);
            y.at[i] = any(random) * std::ldexp(1.0f, int(random() % 40) - 20);
        }
        const Lanes angle = values(angle_of(load(x.at), load(y.at)));
        for (int i = 0; i < kLanes; ++i)
            worst = std::max(worst, std::abs(double(angle.at[i]) - std::atan2(double(y.at[i]), double(x.at[i]))));
    }
    EXPECT_LT(worst, 3e-7);
    EXPECT_EQ(values(angle_of(real(0.0f), real(0.0f))).at[0], 0.0f);
    EXPECT_EQ(values(angle_of(real(1.0f), real(0.0f))).at[0], 0.0f);
    EXPECT_FLOAT_EQ(values(angle_of(real(-1.0f), real(0.0f))).at[0], kPi);
    EXPECT_FLOAT_EQ(values(angle_of(real(0.0f), real(-2.0f))).at[0], -kPi / 2);
}

struct RandomRays {
    std::mt19937 random{5};
    Lanes o[3], d[3];

    void next(float reach)
    {
        std::uniform_real_distribution<float> any(-reach, reach), unit(-1, 1);
        for (int i = 0; i < kLanes; ++i) {
            for (int c = 0; c < 3; ++c) {
                o[c].at[i] = any(random);
                d[c].at[i] = unit(random);
            }
        }
    }
    real3 origin() const { return real3(load(o[0].at), load(o[1].at), load(o[2].at)); }
    real3 direction() const { return real3(load(d[0].at), load(d[1].at), load(d[2].at)); }
};

/// Roots of a t^2 + 2 b t + c = 0 in order.
std::vector<long double> quadratic(long double a, long double b, long double c)
{
    const long double discriminant = b * b - a * c;
    if (discriminant < 0)
        return {};
    const long double q = -(b + (b < 0 ? -1 : 1) * std::sqrt(discriminant));
    std::vector<long double> roots{q / a, c / q};
    std::sort(roots.begin(), roots.end());
    return roots;
}

/// Lanes whose discriminant is within rounding of zero may go either way; the others must agree to `tolerance`.
void compare_pair(const RootPair& found, int lane, const std::vector<long double>& expected, double tolerance,
                  bool tangent, long double speed)
{
    const float t0 = values(found.t0).at[lane], t1 = values(found.t1).at[lane];
    if (tangent)
        return;
    ASSERT_EQ(t0 < kHuge, !expected.empty());
    if (expected.empty())
        return;
    EXPECT_LE(std::abs(t0 - expected[0]) * speed, tolerance * (1 + std::abs(expected[0]) * speed));
    EXPECT_LE(std::abs(t1 - expected[1]) * speed, tolerance * (1 + std::abs(expected[1]) * speed));
}

TEST(formulas, roots_of_quadrics_agree_with_long_double)
{
    RandomRays rays;
    const long double r = 0.8125L, k = 0.375L; // exact in single precision
    int compared = 0;
    for (int n = 0; n < 2000; ++n) {
        rays.next(2);
        const RootPair cylinder = cylinder_roots(float(r), rays.origin(), rays.direction());
        const RootPair sphere = sphere_roots(float(r), rays.origin(), rays.direction());
        const RootPair cone = cone_roots(float(r), float(k), rays.origin(), rays.direction());
        for (int i = 0; i < kLanes; ++i) {
            const long double x = rays.o[0].at[i], y = rays.o[1].at[i], z = rays.o[2].at[i];
            const long double dx = rays.d[0].at[i], dy = rays.d[1].at[i], dz = rays.d[2].at[i];
            const long double xy = dx * dx + dy * dy, all = xy + dz * dz;
            const auto nearly_tangent = [](long double a, long double b, long double c) {
                return std::abs(b * b - a * c) < 1e-3L * (b * b + std::abs(a * c)) || std::abs(a) < 0.05L;
            };
            const long double cyl[3] = {xy, x * dx + y * dy, x * x + y * y - r * r};
            compare_pair(cylinder, i, quadratic(cyl[0], cyl[1], cyl[2]), 4e-6, nearly_tangent(cyl[0], cyl[1], cyl[2]),
                         std::sqrt(all));
            const long double sph[3] = {all, x * dx + y * dy + z * dz, x * x + y * y + z * z - r * r};
            compare_pair(sphere, i, quadratic(sph[0], sph[1], sph[2]), 4e-6, nearly_tangent(sph[0], sph[1], sph[2]),
                         std::sqrt(all));
            const long double rho = r + k * z, rho_t = k * dz;
            const long double con[3] = {xy - rho_t * rho_t, x * dx + y * dy - rho * rho_t, x * x + y * y - rho * rho};
            compare_pair(cone, i, quadratic(con[0], con[1], con[2]), 1e-5, nearly_tangent(con[0], con[1], con[2]),
                         std::sqrt(all));
            ++compared;
        }
    }
    EXPECT_EQ(compared, 32000);
}

/// The torus' roots by fine steps and bisection.
std::vector<long double> torus_by_steps(long double R, long double r, const long double o[3], const long double d[3])
{
    const auto f = [&](long double t) {
        const long double x = o[0] + t * d[0], y = o[1] + t * d[1], z = o[2] + t * d[2];
        const long double rho = std::sqrt(x * x + y * y) - R;
        return rho * rho + z * z - r * r;
    };
    std::vector<long double> roots;
    constexpr int kSteps = 4000;
    for (int i = 0; i < kSteps; ++i) {
        long double a = -8 + 16.0L * i / kSteps, b = -8 + 16.0L * (i + 1) / kSteps;
        if ((f(a) < 0) == (f(b) < 0))
            continue;
        const bool rising = f(a) < 0;
        for (int k = 0; k < 70; ++k) {
            const long double m = (a + b) / 2;
            ((f(m) < 0) == rising ? a : b) = m;
        }
        roots.push_back(a);
    }
    return roots;
}

TEST(formulas, lines_that_touch_within_rounding_are_told_and_no_others)
{
    // beside (x, y = -2, z) along y, `off` of the radius inside or outside of the line that touches
    const real none = real(0.0f);
    const auto told = [&](float off, auto roots_at) {
        return values(roots_at(real(0.8125f * (1 + off))).touch).at[0] < kHuge;
    };
    const real3 along(none, real(1.0f), none);
    const auto beside = [&](real x) { return real3(x, real(-2.0f), none); };
    const auto cylinder = [&](real x) { return cylinder_roots(0.8125f, beside(x), along); };
    const auto cone = [&](real x) { return cone_roots(0.8125f, 0.375f, beside(x), along); };
    const auto sphere = [&](real x) { return sphere_roots(0.8125f, beside(x), along); };
    // at the outer rim, along the axis: R + r = 0.8125
    const auto torus = [&](real x) {
        return torus_roots(0.5f, 0.3125f, real3(x, none, real(-2.0f)), real3(none, none, real(1.0f)));
    };
    for (const float off : {0.0f, 1.2e-7f, -1.2e-7f}) {
        EXPECT_TRUE(told(off, cylinder)) << off;
        EXPECT_TRUE(told(off, cone)) << off;
        EXPECT_TRUE(told(off, sphere)) << off;
        EXPECT_TRUE(told(off, torus)) << off;
    }
    for (const float off : {2e-5f, -2e-5f, 1e-2f, -1e-2f}) {
        EXPECT_FALSE(told(off, cylinder)) << off;
        EXPECT_FALSE(told(off, cone)) << off;
        EXPECT_FALSE(told(off, sphere)) << off;
        EXPECT_FALSE(told(off, torus)) << off;
    }
    EXPECT_LT(values(plane_roots(real3(none, none, none), along).touch).at[0], kHuge);
    EXPECT_EQ(values(plane_roots(real3(none, none, real(1e-4f)), along).touch).at[0], kHuge);
    EXPECT_EQ(values(plane_roots(real3(none, none, none), real3(none, real(1.0f), real(1e-4f))).touch).at[0], kHuge);
}

TEST(formulas, torus_roots_are_all_found_in_order)
{
    RandomRays rays;
    size_t found_four = 0, missed = 0, asked = 0;
    double worst = 0;
    for (const float r : {0.375f, 0.0625f, 0.015625f}) {
        for (int n = 0; n < 12; ++n) {
            rays.next(1.2f);
            if (n % 2 == 1) // flat rays cross a torus four times
                for (int i = 0; i < kLanes; ++i) {
                    rays.o[2].at[i] *= 0.3f * r;
                    rays.d[2].at[i] *= 0.3f * r;
                }
            const TorusRoots roots = torus_roots(1.0f, r, rays.origin(), rays.direction());
            const Lanes t[4] = {values(roots.t0), values(roots.t1), values(roots.t2), values(roots.t3)};
            for (int i = 0; i < kLanes; ++i) {
                const long double o[3] = {rays.o[0].at[i], rays.o[1].at[i], rays.o[2].at[i]};
                long double d[3] = {rays.d[0].at[i], rays.d[1].at[i], rays.d[2].at[i]};
                const long double speed = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
                for (long double& c : d)
                    c /= speed;
                const std::vector<long double> expected = torus_by_steps(1, r, o, d);
                std::vector<long double> got;
                for (const Lanes& lane : t)
                    if (lane.at[i] < kHuge)
                        got.push_back(lane.at[i] * speed);
                ++asked;
                if (got.size() != expected.size()) {
                    ++missed; // a chord shorter than a step, or tangent within rounding
                    continue;
                }
                found_four += got.size() == 4;
                EXPECT_TRUE(std::is_sorted(got.begin(), got.end()));
                for (size_t k = 0; k < got.size(); ++k) {
                    // how fast the distance changes along the ray says what rounding can do to a root
                    const long double e = 1e-4L;
                    const auto distance = [&](long double s) {
                        const long double x = o[0] + s * d[0], y = o[1] + s * d[1], z = o[2] + s * d[2];
                        return std::hypot(std::hypot(x, y) - 1, z) - r;
                    };
                    const long double slope = std::abs(distance(expected[k] + e) - distance(expected[k] - e)) / (2 * e);
                    worst = std::max(worst, double(std::abs(got[k] - expected[k]) * std::min(slope, 1.0L)));
                }
            }
        }
    }
    EXPECT_GT(found_four, 20u);
    EXPECT_LE(missed, asked / 100);
    EXPECT_LT(worst, 4e-6);
}

TEST(formulas, patches_of_small_degree_give_the_bits_of_the_general_formula)
{
    std::mt19937 random(11);
    std::uniform_real_distribution<float> unit(-1, 1), weight(0.2f, 1);
    int fixed = 0;
    for (uint degree_u = 1; degree_u <= 4; ++degree_u) {
        for (uint degree_v = 1; degree_v <= 4; ++degree_v) {
            for (const bool rational : {false, true}) {
                const Evaluate general = rational ? &evaluate_any<true> : &evaluate_any<false>;
                const Evaluate found =
                    find_evaluate(kKindBezier | degree_u << 8 | degree_v << 16 | (rational ? kShapeRational : 0u));
                fixed += found != general;
                std::vector<float> points(3); // the net begins somewhere
                for (uint i = 0; i < (degree_u + 1) * (degree_v + 1); ++i) {
                    const float w = rational ? weight(random) : 1;
                    for (int c = 0; c < 3; ++c)
                        points.push_back(w * unit(random));
                    if (rational)
                        points.push_back(w);
                }
                FetchSource source{};
                source.control_points = points.data();
                for (int n = 0; n < 200; ++n) {
                    Lanes u, v;
                    for (int i = 0; i < kLanes; ++i) {
                        u.at[i] = 0.5f + 0.501f * unit(random);
                        v.at[i] = 0.5f + 0.501f * unit(random);
                    }
                    const real2 uv(load(u.at), load(v.at));
                    const SurfacePoint a = general(source, 3, int(degree_u), int(degree_v), uv);
                    const SurfacePoint b = found(source, 3, int(degree_u), int(degree_v), uv);
                    for (const auto& [of_a, of_b] : {std::pair{a.p, b.p}, {a.du, b.du}, {a.dv, b.dv}}) {
                        const Lanes all_a[3] = {values(of_a.x), values(of_a.y), values(of_a.z)};
                        const Lanes all_b[3] = {values(of_b.x), values(of_b.y), values(of_b.z)};
                        ASSERT_EQ(std::memcmp(all_a, all_b, sizeof all_a), 0) << degree_u << "x" << degree_v;
                    }
                }
            }
        }
    }
    EXPECT_EQ(fixed, 18);
}

// A native surface as pack_layout.h has it, in double.
struct NativeSurface {
    uint kind;
    double r, second; // param
    void at(double u, double v, double (&p)[3]) const
    {
        const double sin_a = second / std::sqrt(1 + second * second), cos_a = 1 / std::sqrt(1 + second * second);
        const double rho = kind == kKindCylinder ? r
                           : kind == kKindCone   ? r + v * sin_a
                           : kind == kKindSphere ? r * std::cos(v)
                                                 : r + second * std::cos(v);
        p[0] = rho * std::cos(u);
        p[1] = rho * std::sin(u);
        p[2] = kind == kKindCylinder ? v
               : kind == kKindCone   ? v * cos_a
               : kind == kKindSphere ? r * std::sin(v)
                                     : second * std::sin(v);
    }
    Derivatives derivatives(real3 p) const
    {
        const scalar a = scalar(r), b = scalar(second);
        return kind == kKindCylinder ? cylinder_derivatives(p)
               : kind == kKindCone   ? cone_derivatives(a, b, p)
               : kind == kKindSphere ? sphere_derivatives(p)
                                     : torus_derivatives(a, torus_side(a, b, p), p);
    }
};

const NativeSurface kNativeSurfaces[] = {
    {kKindCylinder, 0.7, 0}, {kKindCone, 0.5, -0.4}, {kKindSphere, 0.8, 0}, {kKindTorus, 0.6, 0.3}};

TEST(formulas, derivatives_of_native_surfaces_are_the_limits_of_differences)
{
    std::mt19937 random(12);
    std::uniform_real_distribution<double> any(-1, 1);
    for (const NativeSurface& surface : kNativeSurfaces) {
        for (int k = 0; k < 200; ++k) {
            const double u = 3 * any(random), v = any(random), h = 1e-4;
            double s[3][3][3]; // at u + (i - 1) h, v + (j - 1) h
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    surface.at(u + (i - 1) * h, v + (j - 1) * h, s[i][j]);
            const real3 p = scalar3(float(s[1][1][0]), float(s[1][1][1]), float(s[1][1][2]));
            const Derivatives d = surface.derivatives(p);
            const auto lane = [](real3 a, int c) { return double(values(c == 0 ? a.x : c == 1 ? a.y : a.z).at[3]); };
            for (int c = 0; c < 3; ++c) {
                EXPECT_NEAR(lane(d.u, c), (s[2][1][c] - s[0][1][c]) / (2 * h), 1e-6);
                EXPECT_NEAR(lane(d.v, c), (s[1][2][c] - s[1][0][c]) / (2 * h), 1e-6);
                EXPECT_NEAR(lane(d.uu, c), (s[2][1][c] - 2 * s[1][1][c] + s[0][1][c]) / (h * h), 2e-6);
                EXPECT_NEAR(lane(d.vv, c), (s[1][2][c] - 2 * s[1][1][c] + s[1][0][c]) / (h * h), 2e-6);
                EXPECT_NEAR(lane(d.uv, c), (s[2][2][c] - s[2][0][c] - s[0][2][c] + s[0][0][c]) / (4 * h * h), 2e-6);
            }
        }
    }
}

TEST(formulas, the_map_to_pixels_says_where_points_nearby_are_seen)
{
    // an eye 5 away, 1e-3 a pixel, the axes of the picture askew
    const double eye[3] = {0.3, -0.2, 5}, w0[3] = {-0.05, 0.02, -1}, step_x[3] = {1e-3, 2e-4, 0},
                 step_y[3] = {-1e-4, 1.1e-3, 5e-5};
    const auto pixel_of = [&](const double(&p)[3], double(&at)[2], double& T) {
        // p - eye = T w0 + (T x) step_x + (T y) step_y, by Cramer's rule
        const double q[3] = {p[0] - eye[0], p[1] - eye[1], p[2] - eye[2]};
        const auto det = [](const double(&a)[3], const double(&b)[3], const double(&c)[3]) {
            return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
                   a[2] * (b[0] * c[1] - b[1] * c[0]);
        };
        const double whole = det(w0, step_x, step_y);
        T = det(q, step_x, step_y) / whole;
        at[0] = det(w0, q, step_y) / whole / T;
        at[1] = det(w0, step_x, q) / whole / T;
    };
    std::mt19937 random(13);
    std::uniform_real_distribution<double> any(-1, 1);
    double worst_first = 0, worst_second = 0;
    for (const NativeSurface& surface : kNativeSurfaces) {
        for (int k = 0; k < 300; ++k) {
            const double u = 3 * any(random), v = any(random), du = 0.02 * any(random), dv = 0.02 * any(random);
            double p[3], near[3], there[3], at[2], at_near[2], at_there[2], T, other;
            surface.at(u, v, p);
            surface.at(u + 1e-3 * du, v + 1e-3 * dv, near);
            surface.at(u + du, v + dv, there);
            pixel_of(p, at, T);
            pixel_of(near, at_near, other);
            pixel_of(there, at_there, other);
            const auto lanes = [](const double(&a)[3]) { return scalar3(float(a[0]), float(a[1]), float(a[2])); };
            const real3 w = real3(lanes(w0)) + real(float(at[0])) * real3(lanes(step_x)) +
                            real(float(at[1])) * real3(lanes(step_y));
            const PixelRows rows = pixel_rows(w, lanes(step_x), lanes(step_y), real(float(T)));
            const Derivatives d = surface.derivatives(real3(lanes(p)));
            const scalar2 uv_scale(0.25f, 2.0f); // uv_face a unit of uv_patch
            const PixelMap map = pixel_map(rows, d.u, d.v, uv_scale);
            const real2 first = to_pixels(map, real2(scalar2(float(1e-3 * du * 0.25), float(1e-3 * dv * 2))));
            const real2 second = seen_bent(rows, map, d, real2(scalar2(float(du), float(dv))));
            worst_first = std::max({worst_first, std::abs(double(values(first.x).at[0]) - (at_near[0] - at[0])),
                                    std::abs(double(values(first.y).at[0]) - (at_near[1] - at[1]))});
            if (values(second.x).at[0] > 1e3f)
                continue; // turned away on the way
            worst_second = std::max({worst_second, std::abs(double(values(second.x).at[0]) - (at_there[0] - at[0])),
                                     std::abs(double(values(second.y).at[0]) - (at_there[1] - at[1]))});
        }
    }
    EXPECT_LT(worst_first, 1e-4);  // pixels, of steps of 0.004
    EXPECT_LT(worst_second, 0.04); // pixels, of steps of 4: perspective's own bend is left out
}

TEST(formulas, the_nearest_point_of_a_piece_is_the_nearest)
{
    // monotone cubics of some 40 pixels, seen from beside them
    std::mt19937 random(14);
    std::uniform_real_distribution<float> unit(0, 1);
    double worst = 0;
    int asked = 0;
    for (int k = 0; k < 2000; ++k) {
        float x[4] = {0, 10 + 10 * unit(random), 20 + 10 * unit(random), 40};
        float y[4] = {0, 15 * unit(random), 15 + 10 * unit(random), 30};
        const auto point = [&](double t, const float(&c)[4]) {
            const double s = 1 - t;
            return s * s * s * c[0] + 3 * s * s * t * c[1] + 3 * s * t * t * c[2] + t * t * t * c[3];
        };
        const double t = unit(random);
        const float at_x = float(point(t, x)) + 3 * unit(random) - 1.5f, at_y = float(point(t, y)) + unit(random);
        for (int i = 0; i < 4; ++i) {
            x[i] -= at_x;
            y[i] -= at_y;
        }
        double least = 1e30;
        for (int i = 0; i <= 4000; ++i)
            least = std::min(least, std::hypot(point(i / 4000.0, x), point(i / 4000.0, y)));
        const real2 a(scalar2(x[0], y[0])), b(scalar2(x[1], y[1])), c(scalar2(x[2], y[2])), d(scalar2(x[3], y[3]));
        const real2 nearest = cubic_at(a, b, c, d, nearest_on_cubic(a, b, c, d)).p;
        worst = std::max(worst, double(values(length(nearest)).at[5]) - least);
        ++asked;
    }
    EXPECT_EQ(asked, 2000);
    EXPECT_LT(worst, 0.01); // pixels
}

TEST(formulas, pairs_of_floats_keep_46_bits)
{
    std::mt19937_64 random(9);
    std::uniform_real_distribution<double> any(-1, 1);
    const auto pair_of = [](double x) {
        Pair p;
        p.hi = float(x);
        p.lo = float(x - double(p.hi));
        return p;
    };
    double worst = 0;
    for (int i = 0; i < 20000; ++i) {
        const Pair eye = pair_of(1e6 * any(random)), w0 = pair_of(any(random)), origin = pair_of(any(random));
        const float tau = float(-(double(eye.hi) + eye.lo) / (double(w0.hi) + w0.lo));
        if (!(std::abs(tau) < 1e7f))
            continue;
        const double exact = (double(eye.hi) + double(eye.lo)) + double(tau) * (double(w0.hi) + double(w0.lo)) -
                             (double(origin.hi) + double(origin.lo));
        // the result is one float
        worst = std::max(worst, std::abs(double(anchored(eye, w0, tau, origin)) - exact) - kRounding * std::abs(exact));
    }
    EXPECT_LT(worst, 1e6 * std::ldexp(1.0, -44));
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace trimray
HWY_AFTER_NAMESPACE();
