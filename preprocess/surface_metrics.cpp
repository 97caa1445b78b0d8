// Points, derivatives and sizes of surfaces in the file's own parametrisation.
#include "preprocess/bezier_patch.h"
#include "preprocess/spline.h"
#include "preprocess/vec3d.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace trimray {
namespace {

constexpr int kMaxOrder = int(kMaxDegree) + 1;

/// The basis of one direction at one parameter.
struct Basis {
    int first = 0; // first control point it weighs
    double value[kMaxOrder], derivative[kMaxOrder];
};

Basis basis_at(const std::vector<double>& knots, int degree, double period, double t)
{
    if (period > 0) {
        const double start = knots[degree];
        t -= period * std::floor((t - start) / period);
    } else {
        t = held_to_surface(knots, degree, t);
    }
    Basis b;
    const int k = find_span(knots, degree, t);
    b.first = k - degree;
    basis_functions(knots, degree, k, t, b.value, b.derivative);
    return b;
}

SurfaceDerivatives evaluate_spline(const SplineSurface& s, const Basis& bu, const Basis& bv)
{
    double a[4] = {}, au[4] = {}, av[4] = {}; // homogeneous point and derivatives
    for (int i = 0; i <= s.degree_u; ++i) {
        const std::array<double, 4>* row = &s.control_points[size_t(bu.first + i) * s.count_v + bv.first];
        double r[4] = {}, rv[4] = {};
        for (int j = 0; j <= s.degree_v; ++j) {
            for (int c = 0; c < 4; ++c) {
                r[c] += bv.value[j] * row[j][c];
                rv[c] += bv.derivative[j] * row[j][c];
            }
        }
        for (int c = 0; c < 4; ++c) {
            a[c] += bu.value[i] * r[c];
            au[c] += bu.derivative[i] * r[c];
            av[c] += bu.value[i] * rv[c];
        }
    }
    if (!s.rational)
        return {{a[0], a[1], a[2]}, {au[0], au[1], au[2]}, {av[0], av[1], av[2]}};
    // S = A / w,  S_u = (A_u - w_u S) / w   (Piegl & Tiller eq. 4.20)
    const Vec3d p{a[0] / a[3], a[1] / a[3], a[2] / a[3]};
    return {p, (1 / a[3]) * (Vec3d{au[0], au[1], au[2]} - au[3] * p),
            (1 / a[3]) * (Vec3d{av[0], av[1], av[2]} - av[3] * p)};
}

/// S = origin + rho (cos u X + sin u Y) + h Z with rho and h functions of v.
SurfaceDerivatives evaluate_turned(const CadFrame& f, double u, double rho, double rho_v, double h, double h_v)
{
    const Vec3d radial = std::cos(u) * f.x + std::sin(u) * f.y;
    const Vec3d tangent = std::cos(u) * f.y - std::sin(u) * f.x;
    return {f.origin + rho * radial + h * f.z, rho * tangent, rho_v * radial + h_v * f.z};
}

/// Sample positions and weights of one direction; the weights sum to the length of the parameter range.
struct Quadrature {
    std::vector<double> t, weight;
};

/// 2-point Gauss on each span, halved where there are few; over many spans, on equal pieces. Areas steer memory: a few
/// per cent are good enough.
Quadrature quadrature(const std::vector<double>& knots, int degree, double period, double lo, double hi)
{
    constexpr size_t kFewSpans = 6, kManySpans = 12;
    std::vector<double> ends{lo};
    const std::vector<SpanCut> cuts = cut_spans(knots, degree, period, lo, hi);
    if (cuts.size() <= kManySpans) {
        for (const SpanCut& cut : cuts) {
            if (degree > 1 && cuts.size() <= kFewSpans)
                ends.push_back(0.5 * (cut.a + cut.b) + cut.shift);
            ends.push_back(cut.b + cut.shift);
        }
        ends.back() = hi;
    } else {
        for (size_t i = 1; i <= kManySpans; ++i)
            ends.push_back(std::lerp(lo, hi, double(i) / kManySpans));
    }
    if (ends.size() == 1)
        ends.push_back(hi);                       // the domain lies outside the surface: its continuation
    constexpr double kGauss = 0.5773502691896257; // 1 / sqrt 3
    Quadrature q;
    for (size_t i = 0; i + 1 < ends.size(); ++i) {
        const double middle = 0.5 * (ends[i] + ends[i + 1]), half = 0.5 * (ends[i + 1] - ends[i]);
        for (const double side : {-kGauss, kGauss}) {
            q.t.push_back(middle + side * half);
            q.weight.push_back(half);
        }
    }
    return q;
}

double abs_integral_of_radius(const CadSurface& s, double lo, double hi)
{
    // int |R + r cos v| dv; the sign changes only on tori with R < r
    constexpr int kSteps = 32;
    if (s.radius >= s.minor_radius)
        return s.radius * (hi - lo) + s.minor_radius * (std::sin(hi) - std::sin(lo));
    double sum = 0;
    for (int i = 0; i < kSteps; ++i)
        sum += std::abs(s.radius + s.minor_radius * std::cos(lo + (i + 0.5) * (hi - lo) / kSteps));
    return sum * (hi - lo) / kSteps;
}

SurfaceExtent spline_extent(const CadSurface& surface, const Rect2d& d)
{
    const SplineSurface& s = surface.spline;
    const Quadrature qu = quadrature(s.knots_u, s.degree_u, surface.period_u, d.lo.x, d.hi.x);
    const Quadrature qv = quadrature(s.knots_v, s.degree_v, surface.period_v, d.lo.y, d.hi.y);
    std::vector<Basis> basis_v;
    for (const double v : qv.t)
        basis_v.push_back(basis_at(s.knots_v, s.degree_v, surface.period_v, v));
    SurfaceExtent e;
    for (size_t i = 0; i < qu.t.size(); ++i) {
        const Basis basis_u = basis_at(s.knots_u, s.degree_u, surface.period_u, qu.t[i]);
        for (size_t j = 0; j < qv.t.size(); ++j) {
            const SurfaceDerivatives at = evaluate_spline(s, basis_u, basis_v[j]);
            const double weight = qu.weight[i] * qv.weight[j];
            e.area_mm2 += weight * norm(cross(at.du, at.dv));
            e.length_u_mm += weight * norm(at.du);
            e.length_v_mm += weight * norm(at.dv);
        }
    }
    e.length_u_mm /= d.hi.y - d.lo.y;
    e.length_v_mm /= d.hi.x - d.lo.x;
    return e;
}

} // namespace

SurfaceDerivatives evaluate(const CadSurface& surface, double u, double v)
{
    const CadFrame& f = surface.frame;
    const double r = surface.radius;
    switch (surface.kind) {
    case kKindPlane:
        return {f.origin + u * f.x + v * f.y, f.x, f.y};
    case kKindCylinder:
        return evaluate_turned(f, u, r, 0, v, 1);
    case kKindCone: {
        const double sin_a = std::sin(surface.half_angle), cos_a = std::cos(surface.half_angle);
        return evaluate_turned(f, u, r + v * sin_a, sin_a, v * cos_a, cos_a);
    }
    case kKindSphere:
        return evaluate_turned(f, u, r * std::cos(v), -r * std::sin(v), r * std::sin(v), r * std::cos(v));
    case kKindTorus: {
        const double s = surface.minor_radius;
        return evaluate_turned(f, u, r + s * std::cos(v), -s * std::sin(v), s * std::sin(v), s * std::cos(v));
    }
    default:
        break;
    }
    assert(surface.kind == kKindBezier && "one of the six kinds");
    const SplineSurface& s = surface.spline;
    assert(s.degree_u < kMaxOrder && s.degree_v < kMaxOrder && "the kernel's own limit");
    return evaluate_spline(s, basis_at(s.knots_u, s.degree_u, surface.period_u, u),
                           basis_at(s.knots_v, s.degree_v, surface.period_v, v));
}

SurfaceExtent surface_extent(const CadSurface& surface, const Rect2d& domain)
{
    const double du = domain.hi.x - domain.lo.x, dv = domain.hi.y - domain.lo.y;
    const double v0 = domain.lo.y, v1 = domain.hi.y, r = surface.radius;
    // native kinds: |S_u| = |rho(v)|, |S_v| constant; area = du |S_v| int |rho| dv, mean length along u = area / dv
    double int_rho = 0, speed_v = 1;
    switch (surface.kind) {
    case kKindPlane:
        return {du, dv, du * dv};
    case kKindCylinder:
        int_rho = r * dv;
        break;
    case kKindCone: {
        // int |r + v sin a| dv, a trapezium on each side of the apex
        const double sin_a = std::sin(surface.half_angle), rho0 = r + v0 * sin_a, rho1 = r + v1 * sin_a;
        int_rho = rho0 * rho1 >= 0 ? 0.5 * (std::abs(rho0) + std::abs(rho1)) * dv
                                   : 0.5 * (rho0 * rho0 + rho1 * rho1) / std::abs(sin_a);
        break;
    }
    case kKindSphere:
        int_rho = r * (std::sin(v1) - std::sin(v0));
        speed_v = r;
        break;
    case kKindTorus:
        int_rho = abs_integral_of_radius(surface, v0, v1);
        speed_v = surface.minor_radius;
        break;
    default:
        return spline_extent(surface, domain);
    }
    return {du * int_rho / dv, dv * speed_v, du * int_rho * speed_v};
}

} // namespace trimray
