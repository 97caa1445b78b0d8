#include "format/native_reference.h"

#include <numbers>
#include <optional>

namespace trimray::reference {
namespace {

using Real = long double;
constexpr Real kTouching = 1e-15L; // the rounding of a ray to double, relative

struct Real3 {
    Real x, y, z;
};
Real3 real3(const Vec3& a)
{
    return {a[0], a[1], a[2]};
}
Real dot(const Real3& a, const Real3& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
Real3 at(const Real3& origin, const Real3& direction, Real t)
{
    return {origin.x + t * direction.x, origin.y + t * direction.y, origin.z + t * direction.z};
}

struct LineRoot {
    Real t;
    bool contact;
};

/// Roots of a t^2 + 2 b t + c, with a discriminant b^2 - a c known to `error`. Where a is 0 there is one.
std::vector<LineRoot> quadratic_roots(Real a, Real b, Real c, Real discriminant, Real error)
{
    if (a == 0)
        return b == 0 ? std::vector<LineRoot>{} : std::vector<LineRoot>{{-c / (2 * b), false}};
    if (std::abs(discriminant) <= error)
        return {{-b / a, true}};
    if (discriminant < 0)
        return {};
    // q is the larger of the two sums, so nothing cancels; its partner is c / q
    const Real q = -(b + std::copysign(std::sqrt(discriminant), b));
    Real t0 = q / a, t1 = c / q;
    if (t0 > t1)
        std::swap(t0, t1);
    return {{t0, false}, {t1, false}};
}

/// x^2 + y^2 = r^2: the discriminant is r^2 n^2 - m^2 with the line's moment m about the axis.
std::vector<LineRoot> cylinder_roots(Real r, const Real3& o, const Real3& d)
{
    const Real n2 = d.x * d.x + d.y * d.y, m = o.x * d.y - o.y * d.x;
    const Real half2 = (r * std::sqrt(n2) - m) * (r * std::sqrt(n2) + m);
    return quadratic_roots(n2, o.x * d.x + o.y * d.y, o.x * o.x + o.y * o.y - r * r, half2, 2 * kTouching * r * r * n2);
}

/// |p|^2 = r^2, likewise
std::vector<LineRoot> sphere_roots(Real r, const Real3& o, const Real3& d)
{
    const Real n2 = dot(d, d);
    const Real3 m{o.y * d.z - o.z * d.y, o.z * d.x - o.x * d.z, o.x * d.y - o.y * d.x};
    const Real moment = std::sqrt(dot(m, m)), n = std::sqrt(n2);
    return quadratic_roots(n2, dot(o, d), dot(o, o) - r * r, (r * n - moment) * (r * n + moment),
                           2 * kTouching * r * r * n2);
}

/// x^2 + y^2 = (r + k z)^2, both nappes
std::vector<LineRoot> cone_roots(Real r, Real k, const Real3& o, const Real3& d)
{
    const Real rho = r + k * o.z, slope = k * d.z;
    const Real a = d.x * d.x + d.y * d.y - slope * slope, b = o.x * d.x + o.y * d.y - rho * slope,
               c = o.x * o.x + o.y * o.y - rho * rho;
    return quadratic_roots(a, b, c, b * b - a * c, 2 * kTouching * (b * b + std::abs(a * c)));
}

/// Where f, monotone on [lo, hi], is zero; nothing if it has one sign at both ends.
template <class F>
std::optional<Real> monotone_root(F f, Real lo, Real hi)
{
    constexpr int kHalvings = 80; // of an interval of a few radii: down to rounding
    const Real at_lo = f(lo), at_hi = f(hi);
    if (at_lo == 0)
        return lo;
    if (at_hi == 0)
        return hi;
    if ((at_lo < 0) == (at_hi < 0))
        return std::nullopt;
    for (int i = 0; i < kHalvings; ++i) {
        const Real middle = (lo + hi) / 2;
        ((f(middle) < 0) == (at_lo < 0) ? lo : hi) = middle;
    }
    return (lo + hi) / 2;
}

/// A quartic isolated between the zeros of its derivatives. Unit direction d, o at a right angle to it.
std::vector<LineRoot> torus_roots(Real R, Real r, const Real3& o, const Real3& d)
{
    const Real m2 = dot(o, o), reach = R + r;
    if (m2 > reach * reach * (1 + kTouching))
        return {};
    // (|p|^2 + R^2 - r^2)^2 = 4 R^2 (x^2 + y^2) with |p|^2 = m2 + t^2: t^4 + c2 t^2 + c1 t + c0
    const Real k = m2 + R * R - r * r, rho = std::sqrt(o.x * o.x + o.y * o.y);
    const Real c2 = 2 * k - 4 * R * R * (d.x * d.x + d.y * d.y), c1 = -8 * R * R * (o.x * d.x + o.y * d.y),
               c0 = (k - 2 * R * rho) * (k + 2 * R * rho);
    const auto f = [=](Real t) { return ((t * t + c2) * t + c1) * t + c0; };
    const auto slope = [=](Real t) { return (4 * t * t + 2 * c2) * t + c1; };
    const Real end = std::sqrt(std::max(reach * reach - m2, Real(0))) * (1 + kTouching) + kTouching * reach;
    std::vector<Real> turns{-end}; // of the slope, then of f
    if (c2 < 0)
        for (const Real t : {-std::sqrt(-c2 / 6), std::sqrt(-c2 / 6)})
            if (t > turns.back() && t < end)
                turns.push_back(t);
    turns.push_back(end);
    std::vector<Real> extrema{-end};
    for (size_t i = 0; i + 1 < turns.size(); ++i)
        if (const auto t = monotone_root(slope, turns[i], turns[i + 1]))
            extrema.push_back(*t);
    extrema.push_back(end);
    std::vector<LineRoot> roots;
    // distance from the surface, of a torus with R < r from the nearer of its two sheets
    const auto distance = [=](Real t) {
        const Real3 p = at(o, d, t);
        const Real from_axis = std::sqrt(p.x * p.x + p.y * p.y);
        return std::min(std::abs(std::hypot(from_axis - R, p.z) - r), std::abs(std::hypot(from_axis + R, p.z) - r));
    };
    for (size_t i = 0; i + 1 < extrema.size(); ++i) {
        const bool touches = i > 0 && distance(extrema[i]) <= kTouching * reach;
        if (touches)
            roots.push_back({extrema[i], true});
        if (const auto t = monotone_root(f, extrema[i], extrema[i + 1]))
            if (roots.empty() || std::abs(*t - roots.back().t) > (roots.back().contact ? Real(1e-7L) * reach : Real(0)))
                roots.push_back({*t, false});
    }
    return roots;
}

/// uv_patch of a point on the surface, angles in (-pi, pi].
void find_uv(const PatchRecord& patch, const Real3& p, Root& root)
{
    const Real from_axis = std::sqrt(p.x * p.x + p.y * p.y), first = patch.param[0], second = patch.param[1];
    Real u = std::atan2(p.y, p.x), v = p.z;
    switch (patch.shape & 0xffu) {
    case kKindPlane:
        u = p.x;
        v = p.y;
        break;
    case kKindCone:
        if (first + second * p.z < 0) // beyond the apex
            u = std::atan2(-p.y, -p.x);
        v = p.z * std::sqrt(1 + second * second);
        break;
    case kKindSphere:
        v = std::atan2(p.z, from_axis);
        break;
    case kKindTorus: {
        const bool inner_sheet = std::abs(std::hypot(from_axis + first, p.z) - second) <
                                 std::abs(std::hypot(from_axis - first, p.z) - second); // R + r cos v < 0
        if (inner_sheet)
            u = std::atan2(-p.y, -p.x);
        v = std::atan2(p.z, (inner_sheet ? -from_axis : from_axis) - first);
        break;
    }
    default: // cylinder: as above
        break;
    }
    root.u = static_cast<double>(u);
    root.v = static_cast<double>(v);
}

struct Range {
    double lo, hi;
};
Range operator*(const Range& a, const Range& b)
{
    const double products[4] = {a.lo * b.lo, a.lo * b.hi, a.hi * b.lo, a.hi * b.hi};
    const auto [lo, hi] = std::minmax_element(products, products + 4);
    return {*lo, *hi};
}
Range operator+(const Range& a, double b)
{
    return {a.lo + b, a.hi + b};
}
/// cos over [a.lo, a.hi]
Range cosine(const Range& a)
{
    constexpr double kPi = std::numbers::pi;
    Range out{std::min(std::cos(a.lo), std::cos(a.hi)), std::max(std::cos(a.lo), std::cos(a.hi))};
    if (std::floor(a.hi / (2 * kPi)) > std::floor(a.lo / (2 * kPi)))
        out.hi = 1; // a whole number of turns lies between
    if (std::floor((a.hi - kPi) / (2 * kPi)) > std::floor((a.lo - kPi) / (2 * kPi)))
        out.lo = -1;
    return out;
}
Range sine(const Range& a)
{
    return cosine(a + -0.5 * std::numbers::pi);
}

} // namespace

std::vector<Root> native_roots(const PatchRecord& patch, const Ray& ray)
{
    // the line's own origin: its point nearest to the patch's origin; unit direction
    const Real3 given_o = real3(ray.origin), given_d = real3(ray.direction);
    const Real speed = std::sqrt(dot(given_d, given_d));
    const Real3 d{given_d.x / speed, given_d.y / speed, given_d.z / speed};
    const Real base = -dot(given_o, d);
    const Real3 o = at(given_o, d, base);
    const Real first = patch.param[0], second = patch.param[1];
    std::vector<LineRoot> found;
    switch (patch.shape & 0xffu) {
    case kKindPlane:
        if (d.z != 0)
            found.push_back({-o.z / d.z, false});
        break;
    case kKindCylinder:
        found = cylinder_roots(first, o, d);
        break;
    case kKindCone:
        found = cone_roots(first, second, o, d);
        break;
    case kKindSphere:
        found = sphere_roots(first, o, d);
        break;
    default:
        found = torus_roots(first, second, o, d);
        break;
    }
    std::vector<Root> roots;
    for (const LineRoot& line_root : found) {
        Root root;
        root.t = static_cast<double>((base + line_root.t) / speed);
        root.contact = line_root.contact;
        find_uv(patch, at(o, d, line_root.t), root);
        roots.push_back(root);
    }
    return roots;
}

Vec3 native_normal(const PatchRecord& patch, double u, double v)
{
    const double cu = std::cos(u), su = std::sin(u), cv = std::cos(v), sv = std::sin(v);
    const double first = patch.param[0], second = patch.param[1];
    switch (patch.shape & 0xffu) {
    case kKindPlane:
        return {0, 0, 1};
    case kKindCylinder:
        return {cu, su, 0};
    case kKindCone: {
        // rho (cos a cos u, cos a sin u, -sin a)
        const double cos_a = 1 / std::sqrt(1 + second * second), sin_a = second * cos_a, rho = first + v * sin_a;
        if (rho == 0)
            return {0, 0, sin_a > 0 ? -1.0 : 1.0};
        return Vec3{cos_a * cu, cos_a * su, -sin_a} * (rho < 0 ? -1.0 : 1.0);
    }
    case kKindSphere:
        return {cv * cu, cv * su, sv};
    default: // (R + r cos v) r (cos v cos u, cos v sin u, sin v)
        return Vec3{cv * cu, cv * su, sv} * (first + second * cv < 0 ? -1.0 : 1.0);
    }
}

Bounds native_bounds(const PatchRecord& patch, const double uv_lo[2], const double uv_hi[2])
{
    const Range u{uv_lo[0], uv_hi[0]}, v{uv_lo[1], uv_hi[1]};
    const double first = patch.param[0], second = patch.param[1];
    Range x = u, y = v, z{0, 0};
    if ((patch.shape & 0xffu) != kKindPlane) {
        Range rho{first, first};
        z = v;
        if ((patch.shape & 0xffu) == kKindCone) {
            const double cos_a = 1 / std::sqrt(1 + second * second);
            rho = v * Range{second * cos_a, second * cos_a} + first;
            z = v * Range{cos_a, cos_a};
        } else if ((patch.shape & 0xffu) == kKindSphere) {
            rho = cosine(v) * Range{first, first};
            z = sine(v) * Range{first, first};
        } else if ((patch.shape & 0xffu) == kKindTorus) {
            rho = cosine(v) * Range{second, second} + first;
            z = sine(v) * Range{second, second};
        }
        x = rho * cosine(u);
        y = rho * sine(u);
    }
    return {{x.lo, y.lo, z.lo}, {x.hi, y.hi, z.hi}};
}

} // namespace trimray::reference
