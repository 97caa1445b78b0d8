// Native surfaces as rational B-splines, for `--surfaces bezier`: exact in space, with other parameters, so pcurves go
// through the same change. Source: Piegl & Tiller, chapter 7.3 (arcs), 8.5 (surfaces of revolution).
#include "preprocess/import/cad_import_kernel.h"
#include "preprocess/trims/trim_curve.h"
#include "preprocess/vec3d.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trimray::kernel {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr double kLongestArc = std::numbers::pi / 2; // weights of at least cos 45: well conditioned
constexpr double kUvTolerance = 1e-7;                // of mapped pcurves, in arcs: below single precision of the pack

/// Control points of a circle's arcs: (cos, sin) / cos(half arc) between the ends, and weights.
struct ArcPoint {
    double x = 1, y = 0, w = 1;
};

/// One direction of the spline: its knots, and where the circle is in it (empty for a straight direction).
struct Direction {
    UvAxisMap map;
    int degree = 1;
    std::vector<double> knots;
    std::vector<ArcPoint> arc; // of the unit circle, times nothing: the true points
    double lo = 0, hi = 1;     // straight: the parameter of both ends
    double period = 0;
};

Direction straight(const UvAxisMap& map, double lo, double hi)
{
    Direction d;
    d.map = map;
    d.knots = {lo, lo, hi, hi};
    d.lo = lo;
    d.hi = hi;
    return d;
}

Direction circle(const UvAxisMap& map, double lo, double hi)
{
    Direction d;
    d.map = map;
    d.degree = 2;
    d.map.closed = hi - lo > kTwoPi - 1e-9;
    if (d.map.closed)
        hi = lo + kTwoPi;
    const int count = std::max(1, static_cast<int>(std::ceil((hi - lo) / kLongestArc - 1e-9)));
    d.map.arc_count = count;
    d.map.arc_first = lo;
    d.map.arc_step = (hi - lo) / count;
    d.period = d.map.closed ? count : 0;
    const double w = std::cos(0.5 * d.map.arc_step);
    for (int k = 0; k <= count; ++k) {
        const double angle = lo + k * d.map.arc_step;
        const bool around = d.map.closed && k == count; // the same point again, bit for bit
        d.arc.push_back(around ? d.arc.front() : ArcPoint{std::cos(angle), std::sin(angle), 1});
        if (k < count) {
            const double middle = angle + 0.5 * d.map.arc_step;
            d.arc.push_back({std::cos(middle) / w, std::sin(middle) / w, w});
        }
        d.knots.insert(d.knots.end(), k == 0 || k == count ? 3 : 2, k);
    }
    return d;
}

/// A point of the profile in the half plane of angle 0: distance from the axis, height, weight.
struct ProfilePoint {
    double rho = 0, height = 0, w = 1;
};

std::vector<ProfilePoint> profile_points(const CadSurface& s, const Direction& v)
{
    std::vector<ProfilePoint> points;
    if (s.kind == kKindCylinder || s.kind == kKindCone) {
        const double a = s.kind == kKindCone ? s.half_angle : 0;
        for (const double at : {v.lo, v.hi})
            points.push_back({s.radius + at * std::sin(a), at * std::cos(a), 1});
        return points;
    }
    const double major = s.kind == kKindTorus ? s.radius : 0;
    const double minor = s.kind == kKindTorus ? s.minor_radius : s.radius;
    for (const ArcPoint& p : v.arc)
        points.push_back({major + minor * p.x, minor * p.y, p.w});
    return points;
}

/// The bounds with a margin, within the surface's own; a whole period where the face needs about that much.
std::pair<double, double> grown(double lo, double hi, double own_lo, double own_hi, double period)
{
    const double margin = 1e-3 * (hi - lo);
    if (period > 0)
        return hi - lo + 2 * margin >= period ? std::pair(lo, lo + period) : std::pair(lo - margin, hi + margin);
    return {std::max(lo - margin, own_lo), std::min(hi + margin, own_hi)};
}

} // namespace

double UvAxisMap::operator()(double x) const
{
    const double angle = x * scale + offset;
    if (arc_count == 0)
        return angle;
    // an arc of half angle a with end weights 1 and parameter s in [0,1]: tan(phi / 2) = tan(a / 2) (2 s - 1), phi from
    // its middle; arc k has the parameters k .. k + 1
    const double position = (angle - arc_first) / arc_step;
    double k = std::floor(position);
    if (!closed) // what lies a rounding error outside belongs to the last arc
        k = std::clamp(k, 0.0, static_cast<double>(arc_count - 1));
    const double phi = (position - k - 0.5) * arc_step;
    return k + 0.5 + 0.5 * std::tan(0.5 * phi) / std::tan(0.25 * arc_step);
}

ConvertedSurface native_as_spline(const ConvertedSurface& native, const Rect2d& bounds)
{
    const CadSurface& s = native.surface;
    const Rect2d& own = s.natural_bounds;
    const auto [u0, u1] = grown(bounds.lo.x, bounds.hi.x, own.lo.x, own.hi.x, s.period_u);
    const auto [v0, v1] = grown(bounds.lo.y, bounds.hi.y, own.lo.y, own.hi.y, s.period_v);
    const bool plane = s.kind == kKindPlane;
    const bool round_v = s.kind == kKindSphere || s.kind == kKindTorus;
    const Direction u = plane ? straight(native.uv_map.u, u0, u1) : circle(native.uv_map.u, u0, u1);
    const Direction v = round_v ? circle(native.uv_map.v, v0, v1) : straight(native.uv_map.v, v0, v1);

    ConvertedSurface out;
    out.uv_map = {u.map, v.map};
    out.surface.kind = kKindBezier;
    out.surface.source_kind = s.source_kind;
    out.surface.deviation_mm = s.deviation_mm;
    out.surface.period_u = u.period;
    out.surface.period_v = v.period;
    out.surface.natural_bounds = {{u.knots.front(), v.knots.front()}, {u.knots.back(), v.knots.back()}};
    SplineSurface& spline = out.surface.spline;
    spline.degree_u = u.degree;
    spline.degree_v = v.degree;
    spline.knots_u = u.knots;
    spline.knots_v = v.knots;
    spline.rational = !plane;
    const CadFrame& f = s.frame;
    const auto add = [&](double x, double y, double z, double w) {
        const Vec3d p = f.origin + x * f.x + y * f.y + z * f.z;
        spline.control_points.push_back({w * p.x, w * p.y, w * p.z, w});
    };
    if (plane) {
        spline.count_u = spline.count_v = 2;
        for (const double x : {u.lo, u.hi})
            for (const double y : {v.lo, v.hi})
                add(x, y, 0, 1);
        return out;
    }
    const std::vector<ProfilePoint> profile = profile_points(s, v);
    spline.count_u = static_cast<int>(u.arc.size());
    spline.count_v = static_cast<int>(profile.size());
    for (const ArcPoint& c : u.arc)
        for (const ProfilePoint& p : profile)
            add(p.rho * c.x, p.rho * c.y, p.height, c.w * p.w);
    return out;
}

Result<ConvertedPcurve> map_pcurve(const ConvertedPcurve& pcurve, const UvMap& map)
{
    ConvertedPcurve out = pcurve;
    if (map.affine()) {
        for (auto& point : out.curve.control_points) {
            point[0] = map.u.scale * point[0] + map.u.offset * point[2];
            point[1] = map.v.scale * point[1] + map.v.offset * point[2];
        }
        return out;
    }
    const auto mapped = [&](double t) {
        const Vec2d p = curve_point(pcurve.curve, t);
        return Vec2d{map.u(p.x), map.v(p.y)};
    };
    const SplineCurve2d& source = pcurve.curve;
    const Vec2d a = curve_point(source, pcurve.first), b = curve_point(source, pcurve.last);
    const bool along_axis = source.degree == 1 && source.control_points.size() == 2 && (a.x == b.x || a.y == b.y);
    if (along_axis) { // it stays on its line, however its parameter runs
        const Vec2d p = mapped(pcurve.first), q = mapped(pcurve.last);
        out.curve.rational = false;
        out.curve.knots = {pcurve.first, pcurve.first, pcurve.last, pcurve.last};
        out.curve.control_points = {{p.x, p.y, 1.0}, {q.x, q.y, 1.0}};
        return out;
    }
    std::vector<double> breaks{pcurve.first};
    for (const double knot : source.knots)
        if (knot > breaks.back() && knot < pcurve.last)
            breaks.push_back(knot);
    breaks.push_back(pcurve.last);
    Result<SplineCurve2d> followed = approximate_curve2d(mapped, breaks, kUvTolerance);
    if (!followed)
        return followed.error();
    out.curve = std::move(*followed);
    return out;
}

} // namespace trimray::kernel
