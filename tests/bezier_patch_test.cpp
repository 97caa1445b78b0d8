// Evaluation, decomposition and patch records, against the CAD kernel.
#include "preprocess/bezier_patch.h"
#include "preprocess/vec3d.h"
#include "tests/bezier_surface.h"
#include "tests/occt_surfaces.h"
#include "tests/random_surfaces.h"

#include <GeomConvert_BSplineSurfaceToBezierSurface.hxx>
#include <Geom_BezierSurface.hxx>

#include <gtest/gtest.h>

#include <chrono>

#include <fmt/format.h>

namespace trimray {
namespace {

using test::as_surface;
using test::RandomSurfaces;

Vec3d to_vec(const gp_XYZ& p)
{
    return {p.X(), p.Y(), p.Z()};
}

double size_of(const CadSurface& s)
{
    double size = 0;
    for (const auto& [x, y, z, w] : s.spline.control_points)
        size = std::max({size, std::abs(x / w), std::abs(y / w), std::abs(z / w)});
    return size;
}

/// Largest differences of point and first derivatives over random points, relative to the largest value of each.
struct Difference {
    double point = 0, derivative = 0;
};
template <class Reference>
Difference difference(const CadSurface& ours, const Reference& reference, const Rect2d& over, RandomSurfaces& random)
{
    Difference d;
    double largest_point = 0, largest_derivative = 0;
    for (int i = 0; i < 100; ++i) {
        const double u = random.uniform(over.lo.x, over.hi.x), v = random.uniform(over.lo.y, over.hi.y);
        const SurfaceDerivatives at = evaluate(ours, u, v), expected = reference(u, v);
        d.point = std::max(d.point, norm(at.p - expected.p));
        d.derivative = std::max({d.derivative, norm(at.du - expected.du), norm(at.dv - expected.dv)});
        largest_point = std::max(largest_point, norm(expected.p));
        largest_derivative = std::max({largest_derivative, norm(expected.du), norm(expected.dv)});
    }
    return {d.point / largest_point, d.derivative / largest_derivative};
}

auto kernel_reference(const Handle(Geom_Surface) & kernel)
{
    return [kernel](double u, double v) {
        gp_Pnt p;
        gp_Vec du, dv;
        kernel->D1(u, v, p, du, dv);
        return SurfaceDerivatives{to_vec(p.XYZ()), to_vec(du.XYZ()), to_vec(dv.XYZ())};
    };
}

/// N_{i,p}(t) by its recursive definition (Piegl & Tiller eq. 2.5), 0/0 = 0.
long double basis(const std::vector<double>& knots, int i, int p, long double t)
{
    if (p == 0)
        return knots[i] <= t && t < knots[i + 1] ? 1 : 0;
    long double sum = 0;
    if (knots[i + p] > knots[i])
        sum += (t - knots[i]) / ((long double)knots[i + p] - knots[i]) * basis(knots, i, p - 1, t);
    if (knots[i + p + 1] > knots[i + 1])
        sum += (knots[i + p + 1] - t) / ((long double)knots[i + p + 1] - knots[i + 1]) * basis(knots, i + 1, p - 1, t);
    return sum;
}
/// N'_{i,p} by eq. 2.7.
long double basis_slope(const std::vector<double>& knots, int i, int p, long double t)
{
    long double sum = 0;
    if (knots[i + p] > knots[i])
        sum += p / ((long double)knots[i + p] - knots[i]) * basis(knots, i, p - 1, t);
    if (knots[i + p + 1] > knots[i + 1])
        sum -= p / ((long double)knots[i + p + 1] - knots[i + 1]) * basis(knots, i + 1, p - 1, t);
    return sum;
}

/// The definition in long double: the kernel's own evaluation is off by up to 1e-11 for degrees about 10.
auto definition(const CadSurface& surface)
{
    return [&surface](double u, double v) {
        const SplineSurface& s = surface.spline;
        if (surface.period_u > 0)
            u -= surface.period_u * std::floor((u - surface.natural_bounds.lo.x) / surface.period_u);
        long double a[4] = {}, au[4] = {}, av[4] = {};
        std::vector<long double> nv, dv;
        for (int j = 0; j < s.count_v; ++j) {
            nv.push_back(basis(s.knots_v, j, s.degree_v, v));
            dv.push_back(basis_slope(s.knots_v, j, s.degree_v, v));
        }
        for (int i = 0; i < s.count_u; ++i) {
            const long double nu = basis(s.knots_u, i, s.degree_u, u), du = basis_slope(s.knots_u, i, s.degree_u, u);
            for (int j = 0; j < s.count_v; ++j) {
                for (int c = 0; c < 4; ++c) {
                    const long double x = s.control_points[size_t(i) * s.count_v + j][c];
                    a[c] += nu * nv[j] * x;
                    au[c] += du * nv[j] * x;
                    av[c] += nu * dv[j] * x;
                }
            }
        }
        double p[3], pu[3], pv[3];
        for (int c = 0; c < 3; ++c) {
            const long double x = a[c] / a[3];
            p[c] = double(x);
            pu[c] = double((au[c] - au[3] * x) / a[3]);
            pv[c] = double((av[c] - av[3] * x) / a[3]);
        }
        return SurfaceDerivatives{{p[0], p[1], p[2]}, {pu[0], pu[1], pu[2]}, {pv[0], pv[1], pv[2]}};
    };
}
constexpr double kKernelError = 2e-11; // see definition()

CadSurface random_degree_surface(RandomSurfaces& random, int degree, int spans = 3)
{
    return random.spline(degree, random.integer(1, 11), random.integer(0, 1) == 1, random.integer(1, spans),
                         random.integer(1, spans));
}

TEST(evaluate, agrees_with_the_definition_and_the_kernel_on_splines_of_degree_1_to_11)
{
    RandomSurfaces random(1);
    for (int degree = 1; degree <= 11; ++degree) {
        for (int repeat = 0; repeat < 5; ++repeat) {
            const CadSurface s = random_degree_surface(random, degree);
            const Difference exact = difference(s, definition(s), s.natural_bounds, random);
            EXPECT_LE(exact.point, 1e-14);
            EXPECT_LE(exact.derivative, 1e-14);
            const Difference d = difference(s, kernel_reference(test::to_kernel(s.spline)), s.natural_bounds, random);
            EXPECT_LE(d.point, kKernelError);
            EXPECT_LE(d.derivative, kKernelError);
        }
    }
}

TEST(evaluate, agrees_with_the_kernel_on_native_surfaces_in_frames_of_both_hands)
{
    RandomSurfaces random(2);
    for (uint kind = kKindPlane; kind <= kKindTorus; ++kind) {
        for (int repeat = 0; repeat < 20; ++repeat) {
            const CadSurface s = random.native(kind);
            if (kind == kKindCone && std::abs(s.half_angle) < 1e-3)
                continue; // the kernel refuses cones that are nearly cylinders
            const Difference d =
                difference(s, kernel_reference(test::native_to_kernel(s)), random.native_domain(kind), random);
            EXPECT_LE(d.point, 1e-13);
            EXPECT_LE(d.derivative, 1e-13);
        }
    }
}

/// A periodic surface: a wavy tube closed in u, cubic, rational or not.
Handle(Geom_BSplineSurface) periodic_surface(RandomSurfaces& random, int degree, bool rational)
{
    const int n = degree + random.integer(3, 6); // poles = knots - 1 where each inner knot is simple
    TColgp_Array2OfPnt poles(1, n, 1, 4);
    TColStd_Array2OfReal weights(1, n, 1, 4);
    for (int i = 1; i <= n; ++i) {
        for (int j = 1; j <= 4; ++j) {
            const double a = 2 * M_PI * i / n, r = random.uniform(8, 12);
            poles(i, j) = gp_Pnt(r * std::cos(a), r * std::sin(a), 5 * j + random.uniform(-1, 1));
            weights(i, j) = rational ? random.uniform(0.5, 2) : 1;
        }
    }
    TColStd_Array1OfReal knots_u(1, n + 1), knots_v(1, 2);
    TColStd_Array1OfInteger mults_u(1, n + 1), mults_v(1, 2);
    double t = random.uniform(-1, 1);
    for (int i = 1; i <= n + 1; ++i) {
        knots_u(i) = t;
        mults_u(i) = 1;
        t += random.uniform(0.3, 1.2);
    }
    knots_v(1) = 0;
    knots_v(2) = 1;
    mults_v(1) = mults_v(2) = 4;
    return new Geom_BSplineSurface(poles, weights, knots_u, knots_v, mults_u, mults_v, degree, 3, true, false);
}

TEST(evaluate, agrees_with_the_kernel_on_periodic_surfaces_wherever_the_parameter_lies)
{
    RandomSurfaces random(3);
    for (int degree = 1; degree <= 9; ++degree) {
        const Handle(Geom_BSplineSurface) kernel = periodic_surface(random, degree, degree % 2 == 0);
        const CadSurface s = test::from_kernel(kernel);
        ASSERT_GT(s.period_u, 0);
        Rect2d far = s.natural_bounds;
        far.lo.x -= 2.3 * s.period_u;
        far.hi.x += 1.7 * s.period_u;
        const Difference exact = difference(s, definition(s), far, random);
        EXPECT_LE(exact.point, 1e-13);
        EXPECT_LE(exact.derivative, 1e-13);
        const Difference d = difference(s, kernel_reference(kernel), far, random);
        EXPECT_LE(d.point, kKernelError);
        EXPECT_LE(d.derivative, kKernelError);
    }
}

TEST(decompose, agrees_with_the_kernels_bezier_surfaces)
{
    RandomSurfaces random(4);
    for (int degree = 1; degree <= 11; ++degree) {
        for (int repeat = 0; repeat < 5; ++repeat) {
            const CadSurface s = random_degree_surface(random, degree, 5);
            const std::vector<BezierPatch> ours = decompose(s, s.natural_bounds);
            GeomConvert_BSplineSurfaceToBezierSurface kernel(test::to_kernel(s.spline));
            ASSERT_EQ(int(ours.size()), kernel.NbUPatches() * kernel.NbVPatches());
            const double size = size_of(s);
            for (int i = 0; i < kernel.NbUPatches(); ++i) {
                for (int j = 0; j < kernel.NbVPatches(); ++j) {
                    const BezierPatch& patch = ours[size_t(i) * kernel.NbVPatches() + j];
                    const Handle(Geom_BezierSurface) theirs = kernel.Patch(i + 1, j + 1);
                    ASSERT_EQ(theirs->UDegree(), patch.degree_u);
                    for (int a = 0; a <= patch.degree_u; ++a) {
                        for (int b = 0; b <= patch.degree_v; ++b) {
                            const auto& [x, y, z, w] = patch.control_points[size_t(a) * (patch.degree_v + 1) + b];
                            const Vec3d pole = to_vec(theirs->Pole(a + 1, b + 1).XYZ());
                            EXPECT_LE(norm(Vec3d{x / w, y / w, z / w} - pole), 5e-14 * size);
                            EXPECT_NEAR(theirs->Weight(a + 1, b + 1) / w, 1, 5e-14);
                        }
                    }
                }
            }
        }
    }
}

/// Checks that the patches tile `domain` and are the surface where they lie.
void expect_patches_are_the_surface(const CadSurface& s, const Rect2d& domain, RandomSurfaces& random)
{
    const double size = size_of(s);
    double area = 0;
    for (const BezierPatch& patch : decompose(s, domain)) {
        const Rect2d& d = patch.domain;
        area += (d.hi.x - d.lo.x) * (d.hi.y - d.lo.y);
        const CadSurface piece = as_surface(patch);
        for (int i = 0; i < 10; ++i) {
            const double a = random.uniform(0, 1), b = random.uniform(0, 1);
            const Vec3d p = evaluate(s, std::lerp(d.lo.x, d.hi.x, a), std::lerp(d.lo.y, d.hi.y, b)).p;
            EXPECT_LE(norm(evaluate(piece, a, b).p - p), 1e-13 * size);
        }
    }
    EXPECT_NEAR(area / ((domain.hi.x - domain.lo.x) * (domain.hi.y - domain.lo.y)), 1, 1e-12);
}

TEST(decompose, cuts_at_the_domains_border)
{
    RandomSurfaces random(5);
    for (int repeat = 0; repeat < 40; ++repeat) {
        const CadSurface s = random_degree_surface(random, random.integer(1, 9), 4);
        const Rect2d& n = s.natural_bounds;
        Rect2d domain;
        domain.lo = {std::lerp(n.lo.x, n.hi.x, random.uniform(0, 0.45)),
                     std::lerp(n.lo.y, n.hi.y, random.uniform(0, 0.45))};
        domain.hi = {std::lerp(n.lo.x, n.hi.x, random.uniform(0.55, 1)),
                     std::lerp(n.lo.y, n.hi.y, random.uniform(0.55, 1))};
        expect_patches_are_the_surface(s, domain, random);
    }
}

TEST(decompose, follows_the_domain_across_the_seam_of_a_periodic_surface)
{
    RandomSurfaces random(6);
    for (int degree = 1; degree <= 7; ++degree) {
        const CadSurface s = test::from_kernel(periodic_surface(random, degree, degree % 2 == 1));
        for (const double turns : {-3.4, -0.6, 0.0, 0.3, 2.0}) {
            Rect2d domain = s.natural_bounds;
            domain.lo.x += turns * s.period_u;
            domain.hi.x = domain.lo.x + s.period_u * (turns == 0.3 ? 0.5 : 1);
            expect_patches_are_the_surface(s, domain, random);
        }
    }
}

TEST(decompose, is_exact_on_unclamped_knots_and_jumps)
{
    RandomSurfaces random(7);
    CadSurface s = random.spline(3, 2, true, 1, 1);
    SplineSurface& b = s.spline;
    b.knots_u = {-3, -2, -1, 0, 1, 1, 1, 1, 2, 3.5, 4, 5}; // unclamped, a jump at 1 (multiplicity degree + 1)
    b.count_u = int(b.knots_u.size()) - 4;
    b.control_points.clear();
    for (int i = 0; i < b.count_u * b.count_v; ++i) {
        const double w = random.uniform(0.5, 2);
        b.control_points.push_back(
            {w * random.uniform(-1, 1), w * random.uniform(-1, 1), w * random.uniform(-1, 1), w});
    }
    s.natural_bounds = {{0, b.knots_v.front()}, {2, b.knots_v.back()}};
    const std::vector<BezierPatch> patches = decompose(s, s.natural_bounds);
    ASSERT_EQ(patches.size(), 2u);
    for (const BezierPatch& patch : patches) {
        const CadSurface piece = as_surface(patch);
        for (int i = 0; i < 50; ++i) {
            const double a = random.uniform(0, 0.999), v = random.uniform(0, 1);
            const Vec3d expected = evaluate(s, std::lerp(patch.domain.lo.x, patch.domain.hi.x, a),
                                            std::lerp(patch.domain.lo.y, patch.domain.hi.y, v))
                                       .p;
            EXPECT_LE(norm(evaluate(piece, a, v).p - expected), 1e-13);
        }
    }
}

TEST(decompose, drops_weights_that_are_all_equal)
{
    RandomSurfaces random(8);
    CadSurface s = random.spline(3, 3, false, 3, 3);
    const std::vector<BezierPatch> plain = decompose(s, s.natural_bounds);
    for (auto& p : s.spline.control_points)
        for (double& c : p)
            c *= 0.3;
    s.spline.rational = true;
    const std::vector<BezierPatch> scaled = decompose(s, s.natural_bounds);
    ASSERT_EQ(plain.size(), scaled.size());
    for (size_t i = 0; i < plain.size(); ++i) {
        ASSERT_FALSE(scaled[i].rational);
        for (size_t p = 0; p < plain[i].control_points.size(); ++p)
            for (int c = 0; c < 4; ++c)
                EXPECT_NEAR(plain[i].control_points[p][c], scaled[i].control_points[p][c], 1e-13);
    }
}

TEST(decompose, is_faster_than_the_kernel)
{
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "the sanitizers slow our code, not the kernel's";
#endif
    RandomSurfaces random(9);
    using Clock = std::chrono::steady_clock;
    for (const int degree : {1, 2, 3, 5, 8}) {
        const CadSurface s = random.spline(degree, degree, degree != 3, 12, 12);
        const Handle(Geom_BSplineSurface) surface = test::to_kernel(s.spline);
        double ours_us = 1e9, kernel_us = 1e9;
        for (int repeat = 0; repeat < 5; ++repeat) {
            auto start = Clock::now();
            const size_t count = decompose(s, s.natural_bounds).size();
            ours_us =
                std::min(ours_us, std::chrono::duration<double, std::micro>(Clock::now() - start).count() / count);
            start = Clock::now();
            GeomConvert_BSplineSurfaceToBezierSurface kernel(surface);
            TColGeom_Array2OfBezierSurface patches(1, kernel.NbUPatches(), 1, kernel.NbVPatches());
            kernel.Patches(patches);
            kernel_us =
                std::min(kernel_us, std::chrono::duration<double, std::micro>(Clock::now() - start).count() / count);
        }
        fmt::print("degree {} x {}{}: {:.2f} us a patch, kernel {:.2f}\n", degree, degree,
                   s.spline.rational ? " rational" : "", ours_us, kernel_us);
        EXPECT_LT(ours_us, kernel_us);
    }
}

} // namespace
} // namespace trimray
