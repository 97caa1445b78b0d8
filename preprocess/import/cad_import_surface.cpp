// The kernel's surfaces -> CadSurface: native kinds and splines exactly, sweeps and offsets exactly where they are one
// of those, everything else approximated in its own parameters, so that its pcurves stay true.
#include "preprocess/import/cad_import_kernel.h"

#include <BRep_Tool.hxx>
#include <GeomAdaptor_Surface.hxx>
#include <Geom_BSplineCurve.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Geom_BezierCurve.hxx>
#include <Geom_BezierSurface.hxx>
#include <Geom_BoundedSurface.hxx>
#include <Geom_Circle.hxx>
#include <Geom_ConicalSurface.hxx>
#include <Geom_CylindricalSurface.hxx>
#include <Geom_ElementarySurface.hxx>
#include <Geom_Line.hxx>
#include <Geom_OffsetSurface.hxx>
#include <Geom_Plane.hxx>
#include <Geom_RectangularTrimmedSurface.hxx>
#include <Geom_SphericalSurface.hxx>
#include <Geom_SurfaceOfLinearExtrusion.hxx>
#include <Geom_SurfaceOfRevolution.hxx>
#include <Geom_ToroidalSurface.hxx>
#include <Geom_TrimmedCurve.hxx>
#include <Precision.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <gp_Cone.hxx>
#include <gp_Cylinder.hxx>
#include <gp_GTrsf2d.hxx>
#include <gp_Pln.hxx>
#include <gp_Sphere.hxx>
#include <gp_Torus.hxx>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace trimray::kernel {
namespace {

constexpr double kInfiniteSide = 1e100; // the kernel writes 2e100
// A cone this flat or flatter goes on as a spline: its two nappes lie so close that a quadratic in single precision
// cannot tell their roots apart. 1e-2 already costs a digit in depth; files hold cones of 7e-7.
constexpr double kFlatConeCosine = 0.02;
bool is_flat_cone(double half_angle)
{
    return std::abs(std::cos(half_angle)) < kFlatConeCosine;
}

constexpr double kTwoPi = 2 * std::numbers::pi;

Vec3d vec(const gp_XYZ& p)
{
    return {p.X(), p.Y(), p.Z()};
}

CadFrame frame_of(const gp_Ax3& axes)
{
    return {vec(axes.Location().XYZ()), vec(axes.XDirection().XYZ()), vec(axes.YDirection().XYZ()),
            vec(axes.Direction().XYZ())};
}

Rect2d bounds_of(const Geom_Surface& surface)
{
    double u0, u1, v0, v1;
    surface.Bounds(u0, u1, v0, v1);
    const auto clip = [](double x) { return std::clamp(x, -kInfiniteSide, kInfiniteSide); };
    return {{clip(u0), clip(v0)}, {clip(u1), clip(v1)}};
}

void set_periods(const Geom_Surface& surface, CadSurface& out)
{
    out.period_u = surface.IsUPeriodic() ? surface.UPeriod() : 0;
    out.period_v = surface.IsVPeriodic() ? surface.VPeriod() : 0;
}

ConvertedSurface native(uint32_t kind, const Geom_Surface& surface, const gp_Ax3& axes, const char* source_kind)
{
    ConvertedSurface out;
    out.surface.kind = kind;
    out.surface.frame = frame_of(axes);
    out.surface.natural_bounds = bounds_of(surface);
    out.surface.source_kind = source_kind;
    set_periods(surface, out.surface);
    return out;
}

std::vector<double> flat_knots(const TColStd_Array1OfReal& sequence)
{
    return {sequence.begin(), sequence.end()};
}

/// Control points times weights, u first; `pole` and `weight` are the kernel's 1-based accessors.
template <class Surface>
void take_control_points(const Surface& source, SplineSurface& out)
{
    out.count_u = source.NbUPoles();
    out.count_v = source.NbVPoles();
    out.degree_u = source.UDegree();
    out.degree_v = source.VDegree();
    out.rational = source.IsURational() || source.IsVRational();
    out.control_points.reserve(static_cast<size_t>(out.count_u) * out.count_v);
    for (int i = 1; i <= out.count_u; ++i)
        for (int j = 1; j <= out.count_v; ++j) {
            const gp_Pnt p = source.Pole(i, j);
            const double w = out.rational ? source.Weight(i, j) : 1.0;
            out.control_points.push_back({w * p.X(), w * p.Y(), w * p.Z(), w});
        }
}

ConvertedSurface spline(const Geom_BSplineSurface& source)
{
    ConvertedSurface out;
    out.surface.kind = kKindBezier;
    out.surface.source_kind = "bspline";
    set_periods(source, out.surface);
    // Segment() throws on periodic surfaces; opening a copy at its first knot moves no point
    Handle(Geom_BSplineSurface) open = Handle(Geom_BSplineSurface)::DownCast(source.Copy());
    if (open->IsUPeriodic())
        open->SetUNotPeriodic();
    if (open->IsVPeriodic())
        open->SetVNotPeriodic();
    take_control_points(*open, out.surface.spline);
    out.surface.spline.knots_u = flat_knots(open->UKnotSequence());
    out.surface.spline.knots_v = flat_knots(open->VKnotSequence());
    out.surface.natural_bounds = bounds_of(*open);
    return out;
}

std::vector<double> bezier_knots(int degree)
{
    std::vector<double> knots(static_cast<size_t>(degree) + 1, 0.0);
    knots.insert(knots.end(), static_cast<size_t>(degree) + 1, 1.0);
    return knots;
}

ConvertedSurface bezier(const Geom_BezierSurface& source)
{
    ConvertedSurface out;
    out.surface.kind = kKindBezier;
    out.surface.source_kind = "bezier";
    take_control_points(source, out.surface.spline);
    out.surface.spline.knots_u = bezier_knots(source.UDegree());
    out.surface.spline.knots_v = bezier_knots(source.VDegree());
    out.surface.natural_bounds = {{0, 0}, {1, 1}};
    return out;
}

Handle(Geom_Curve) untrimmed(Handle(Geom_Curve) curve)
{
    while (const Handle(Geom_TrimmedCurve) trimmed = Handle(Geom_TrimmedCurve)::DownCast(curve))
        curve = trimmed->BasisCurve();
    return curve;
}

/// Fails to a null spline curve where the curve has no spline with the same parameters.
Handle(Geom_BSplineCurve) same_parameter_spline(const Handle(Geom_Curve) & curve)
{
    const Handle(Geom_Curve) basis = untrimmed(curve);
    if (const auto spline = Handle(Geom_BSplineCurve)::DownCast(basis)) {
        Handle(Geom_BSplineCurve) copy = Handle(Geom_BSplineCurve)::DownCast(spline->Copy());
        if (copy->IsPeriodic())
            copy->SetNotPeriodic();
        return copy;
    }
    if (const auto bezier = Handle(Geom_BezierCurve)::DownCast(basis)) {
        TColgp_Array1OfPnt poles(1, bezier->NbPoles());
        bezier->Poles(poles);
        TColStd_Array1OfReal weights(1, bezier->NbPoles()), knots(1, 2);
        TColStd_Array1OfInteger multiplicities(1, 2);
        bezier->Weights(weights);
        knots(1) = 0;
        knots(2) = 1;
        multiplicities.Init(bezier->Degree() + 1);
        return new Geom_BSplineCurve(poles, weights, knots, multiplicities, bezier->Degree());
    }
    return {};
}

/// S(u,v) = C(u) + v D, exactly: the profile's net twice.
std::optional<ConvertedSurface> extrusion(const Geom_SurfaceOfLinearExtrusion& source, const Rect2d& bounds)
{
    const gp_Dir direction = source.Direction();
    const Handle(Geom_Curve) profile = untrimmed(source.BasisCurve());
    if (const auto line = Handle(Geom_Line)::DownCast(profile)) {
        const gp_Dir x = line->Lin().Direction();
        if (std::abs(x.Dot(direction)) < 1e-12) {
            CadFrame frame{vec(line->Lin().Location().XYZ()), vec(x.XYZ()), vec(direction.XYZ()),
                           vec(x.Crossed(direction).XYZ())};
            ConvertedSurface out;
            out.surface.kind = kKindPlane;
            out.surface.frame = frame;
            out.surface.natural_bounds = {{-kInfiniteSide, -kInfiniteSide}, {kInfiniteSide, kInfiniteSide}};
            return out;
        }
    }
    if (const auto circle = Handle(Geom_Circle)::DownCast(profile)) {
        const gp_Ax2 axes = circle->Circ().Position();
        if (std::abs(axes.Direction().Dot(direction)) > 1 - 1e-14) {
            ConvertedSurface out;
            out.surface.kind = kKindCylinder;
            out.surface.frame = {vec(axes.Location().XYZ()), vec(axes.XDirection().XYZ()), vec(axes.YDirection().XYZ()),
                                 vec(direction.XYZ())};
            out.surface.radius = circle->Radius();
            out.surface.period_u = kTwoPi;
            out.surface.natural_bounds = {{0, -kInfiniteSide}, {kTwoPi, kInfiniteSide}};
            return out;
        }
    }
    const Handle(Geom_BSplineCurve) curve = same_parameter_spline(profile);
    if (curve.IsNull() || curve->Degree() > static_cast<int>(kMaxDegree))
        return std::nullopt;
    ConvertedSurface out;
    CadSurface& s = out.surface;
    s.kind = kKindBezier;
    s.period_u = profile->IsPeriodic() ? profile->Period() : 0;
    s.spline.degree_u = curve->Degree();
    s.spline.degree_v = 1;
    s.spline.count_u = curve->NbPoles();
    s.spline.count_v = 2;
    s.spline.rational = curve->IsRational();
    s.spline.knots_u = flat_knots(curve->KnotSequence());
    s.spline.knots_v = {bounds.lo.y, bounds.lo.y, bounds.hi.y, bounds.hi.y};
    for (int i = 1; i <= curve->NbPoles(); ++i)
        for (const double v : {bounds.lo.y, bounds.hi.y}) {
            const double w = s.spline.rational ? curve->Weight(i) : 1.0;
            const gp_XYZ p = w * (curve->Pole(i).XYZ() + v * direction.XYZ());
            s.spline.control_points.push_back({p.X(), p.Y(), p.Z(), w});
        }
    s.natural_bounds = {{curve->FirstParameter(), bounds.lo.y}, {curve->LastParameter(), bounds.hi.y}};
    return out;
}

/// Lines and circles turned about an axis in their plane are cylinders, cones, spheres and tori; u is the angle in
/// both, v may need an offset (in the map).
std::optional<ConvertedSurface> revolution(const Geom_SurfaceOfRevolution& source, double tolerance_mm)
{
    const gp_Ax1 axis = source.Axis();
    const gp_XYZ origin = axis.Location().XYZ(), z = axis.Direction().XYZ();
    const Handle(Geom_Curve) meridian = untrimmed(source.BasisCurve());
    ConvertedSurface out;
    CadSurface& s = out.surface;
    s.period_u = kTwoPi;
    s.natural_bounds = {{0, -kInfiniteSide}, {kTwoPi, kInfiniteSide}};
    const auto radial = [&](const gp_XYZ& p) { return p - origin - z * z.Dot(p - origin); };

    if (const auto line = Handle(Geom_Line)::DownCast(meridian)) {
        const gp_XYZ start = line->Lin().Location().XYZ(), d = line->Lin().Direction().XYZ();
        const gp_XYZ r0 = radial(start), dr = d - z * z.Dot(d);
        if (std::abs(z.Dot(d)) < 1e-9)
            return std::nullopt; // a plane in polar parameters
        const bool far = r0.Modulus() > tolerance_mm;
        if (!far && dr.Modulus() < 1e-9)
            return std::nullopt; // the axis itself
        const gp_XYZ x = far ? r0 / r0.Modulus() : dr / dr.Modulus();
        if ((dr - x * x.Dot(dr)).Modulus() * 1e3 > 1e-9)
            return std::nullopt; // skew to the axis: a hyperboloid
        const double up = z.Dot(d) > 0 ? 1 : -1;
        s.frame = {vec(origin + z * z.Dot(start - origin)), vec(x), vec(z.Crossed(x)), vec(up * z)};
        s.radius = far ? r0.Modulus() : 0;
        if (dr.Modulus() < 1e-12) {
            s.kind = kKindCylinder;
        } else {
            s.kind = kKindCone;
            s.half_angle = std::asin(std::clamp(x.Dot(dr), -1.0, 1.0));
        }
        return out;
    }
    if (const auto circle = Handle(Geom_Circle)::DownCast(meridian)) {
        const gp_Ax2 axes = circle->Circ().Position();
        const gp_XYZ center = axes.Location().XYZ(), normal = axes.Direction().XYZ();
        if (std::abs(normal.Dot(z)) > 1e-12)
            return std::nullopt; // its plane is not along the axis
        const gp_XYZ rc = radial(center);
        const bool far = rc.Modulus() > tolerance_mm;
        gp_XYZ x = far ? rc / rc.Modulus() : z.Crossed(normal);
        if (std::abs(x.Dot(normal)) * std::max(rc.Modulus(), circle->Radius()) > tolerance_mm)
            return std::nullopt; // its plane passes beside the axis
        x.Normalize();
        // the circle at parameter t: center + r (cos t X + sin t Y), with X = cos(phi) x + sin(phi) z, turning with or
        // against x -> z. The torus' z axis turns with it, so v = turn phi + t: a shift keeps the side of the loops
        const gp_XYZ cx = axes.XDirection().XYZ(), cy = axes.YDirection().XYZ();
        const double phi = std::atan2(cx.Dot(z), cx.Dot(x));
        const double turn = cx.Dot(x) * cy.Dot(z) - cx.Dot(z) * cy.Dot(x) > 0 ? 1 : -1;
        s.frame = {vec(origin + z * z.Dot(center - origin)), vec(x), vec(z.Crossed(x)), vec(turn * z)};
        if (!far) {
            // a sphere's v ends at its poles; a meridian that runs through one needs two of them
            return std::nullopt;
        }
        s.kind = kKindTorus;
        s.radius = rc.Modulus();
        s.minor_radius = circle->Radius();
        s.period_v = kTwoPi;
        s.natural_bounds = {{0, 0}, {kTwoPi, kTwoPi}};
        out.uv_map.v.offset = turn * phi;
        return out;
    }
    return std::nullopt;
}

std::vector<double> smooth_breaks(const GeomAdaptor_Surface& surface, bool along_u, double lo, double hi)
{
    std::vector<double> breaks{lo};
    const int count = along_u ? surface.NbUIntervals(GeomAbs_C3) : surface.NbVIntervals(GeomAbs_C3);
    TColStd_Array1OfReal inner(1, count + 1);
    along_u ? surface.UIntervals(inner, GeomAbs_C3) : surface.VIntervals(inner, GeomAbs_C3);
    for (int i = 2; i <= count; ++i)
        if (inner(i) > breaks.back() + 1e-9 * (hi - lo) && inner(i) < hi - 1e-9 * (hi - lo))
            breaks.push_back(inner(i));
    breaks.push_back(hi);
    return breaks;
}

/// The face's bounds, grown by a margin, kept within the surface's own and within one period.
Rect2d working_bounds(const Geom_Surface& surface, const Rect2d& face)
{
    const Rect2d own = bounds_of(surface);
    const auto side = [](double lo, double hi, double own_lo, double own_hi, bool periodic, double period) {
        const double margin = 1e-3 * (hi - lo);
        if (periodic)
            return hi - lo + 2 * margin >= period ? std::pair(lo, lo + period) : std::pair(lo - margin, hi + margin);
        return std::pair(std::max(lo - margin, own_lo), std::min(hi + margin, own_hi));
    };
    const auto [u0, u1] = side(face.lo.x, face.hi.x, own.lo.x, own.hi.x, surface.IsUPeriodic(),
                               surface.IsUPeriodic() ? surface.UPeriod() : 0);
    const auto [v0, v1] = side(face.lo.y, face.hi.y, own.lo.y, own.hi.y, surface.IsVPeriodic(),
                               surface.IsVPeriodic() ? surface.VPeriod() : 0);
    return {{u0, v0}, {u1, v1}};
}

Result<ConvertedSurface> approximated(const Handle(Geom_Surface) & surface, const Rect2d& bounds, double tolerance_mm)
{
    if (!(bounds.hi.x > bounds.lo.x) || !(bounds.hi.y > bounds.lo.y))
        return Error{ErrorCode::InvalidSurface, "surface", "its face covers no area of it"};
    const GeomAdaptor_Surface adaptor(surface, bounds.lo.x, bounds.hi.x, bounds.lo.y, bounds.hi.y);
    SampledSurface sampled;
    sampled.point = [&](double u, double v) { return vec(adaptor.Value(u, v).XYZ()); };
    sampled.breaks_u = smooth_breaks(adaptor, true, bounds.lo.x, bounds.hi.x);
    sampled.breaks_v = smooth_breaks(adaptor, false, bounds.lo.y, bounds.hi.y);
    ConvertedSurface out;
    const Result<SplineSurface> spline = approximate_surface(sampled, tolerance_mm, out.surface.deviation_mm);
    if (!spline)
        return spline.error();
    out.surface.kind = kKindBezier;
    out.surface.spline = *spline;
    out.surface.natural_bounds = bounds;
    const auto whole = [](double width, double period) { return width >= period * (1 - 1e-12) ? period : 0.0; };
    if (surface->IsUPeriodic())
        out.surface.period_u = whole(bounds.hi.x - bounds.lo.x, surface->UPeriod());
    if (surface->IsVPeriodic())
        out.surface.period_v = whole(bounds.hi.y - bounds.lo.y, surface->VPeriod());
    return out;
}

Rect2d mapped_bounds(const Rect2d& bounds, const UvMap& map)
{
    const auto [u0, u1] = std::minmax({map.u(bounds.lo.x), map.u(bounds.hi.x)});
    const auto [v0, v1] = std::minmax({map.v(bounds.lo.y), map.v(bounds.hi.y)});
    return {{u0, v0}, {u1, v1}};
}

bool finite(const CadSurface& s)
{
    const auto good = [](double x) { return std::isfinite(x); };
    for (const Vec3d& v : {s.frame.origin, s.frame.x, s.frame.y, s.frame.z})
        if (!good(v.x) || !good(v.y) || !good(v.z))
            return false;
    for (const auto& point : s.spline.control_points)
        if (!std::all_of(point.begin(), point.end(), good))
            return false;
    return std::all_of(s.spline.knots_u.begin(), s.spline.knots_u.end(), good) &&
           std::all_of(s.spline.knots_v.begin(), s.spline.knots_v.end(), good) && good(s.radius) &&
           good(s.minor_radius) && good(s.half_angle);
}

Result<ConvertedSurface> convert(const Handle(Geom_Surface) & surface, const Rect2d& face_bounds, double tolerance_mm)
{
    if (const auto trimmed = Handle(Geom_RectangularTrimmedSurface)::DownCast(surface)) {
        Result<ConvertedSurface> inner = convert(trimmed->BasisSurface(), face_bounds, tolerance_mm);
        // where the face has no loops its bounds are the trimmed surface's
        if (inner && inner->uv_map.identity())
            inner->surface.natural_bounds = bounds_of(*trimmed);
        return inner;
    }
    if (const auto plane = Handle(Geom_Plane)::DownCast(surface))
        return native(kKindPlane, *plane, plane->Pln().Position(), "plane");
    if (const auto cylinder = Handle(Geom_CylindricalSurface)::DownCast(surface)) {
        ConvertedSurface out = native(kKindCylinder, *cylinder, cylinder->Cylinder().Position(), "cylinder");
        out.surface.radius = cylinder->Radius();
        return out;
    }
    if (const auto cone = Handle(Geom_ConicalSurface)::DownCast(surface)) {
        ConvertedSurface out = native(kKindCone, *cone, cone->Cone().Position(), "cone");
        out.surface.radius = cone->RefRadius();
        out.surface.half_angle = cone->SemiAngle();
        return out;
    }
    if (const auto sphere = Handle(Geom_SphericalSurface)::DownCast(surface)) {
        ConvertedSurface out = native(kKindSphere, *sphere, sphere->Sphere().Position(), "sphere");
        out.surface.radius = sphere->Radius();
        return out;
    }
    if (const auto torus = Handle(Geom_ToroidalSurface)::DownCast(surface)) {
        ConvertedSurface out = native(kKindTorus, *torus, torus->Torus().Position(), "torus");
        out.surface.radius = torus->MajorRadius();
        out.surface.minor_radius = torus->MinorRadius();
        return out;
    }
    if (const auto splined = Handle(Geom_BSplineSurface)::DownCast(surface))
        return spline(*splined);
    if (const auto bezier_surface = Handle(Geom_BezierSurface)::DownCast(surface))
        return bezier(*bezier_surface);

    const Rect2d bounds = working_bounds(*surface, face_bounds);
    const char* source_kind = "other";
    std::optional<ConvertedSurface> exact;
    if (const auto extruded = Handle(Geom_SurfaceOfLinearExtrusion)::DownCast(surface)) {
        source_kind = "extrusion";
        exact = extrusion(*extruded, bounds);
    } else if (const auto revolved = Handle(Geom_SurfaceOfRevolution)::DownCast(surface)) {
        source_kind = "revolution";
        exact = revolution(*revolved, tolerance_mm);
    } else if (const auto offset = Handle(Geom_OffsetSurface)::DownCast(surface)) {
        source_kind = "offset";
        if (const Handle(Geom_Surface) equivalent = offset->Surface(); !equivalent.IsNull())
            if (const auto inner = convert(equivalent, face_bounds, tolerance_mm); inner)
                exact = *inner;
    }
    if (exact) {
        exact->surface.source_kind = source_kind;
        return *exact;
    }
    Result<ConvertedSurface> result = approximated(surface, bounds, tolerance_mm);
    if (result)
        result->surface.source_kind = source_kind;
    return result;
}

} // namespace

bool conversion_needs_bounds(const TopoDS_Face& face, const ImportOptions& options)
{
    TopLoc_Location location;
    Handle(Geom_Surface) surface = BRep_Tool::Surface(face, location);
    while (const auto trimmed = Handle(Geom_RectangularTrimmedSurface)::DownCast(surface))
        surface = trimmed->BasisSurface();
    if (surface.IsNull())
        return false;
    const bool spline = surface->IsKind(STANDARD_TYPE(Geom_BoundedSurface));
    const bool elementary = surface->IsKind(STANDARD_TYPE(Geom_ElementarySurface));
    const auto cone = Handle(Geom_ConicalSurface)::DownCast(surface);
    const bool flat_cone = !cone.IsNull() && is_flat_cone(cone->SemiAngle());
    return !spline && !(elementary && options.native_surfaces && !flat_cone);
}

Result<ConvertedSurface> convert_surface(const TopoDS_Face& face, const Rect2d& bounds, const ImportOptions& options,
                                         double tolerance_mm)
{
    TopLoc_Location location;
    Handle(Geom_Surface) surface = BRep_Tool::Surface(face, location);
    if (surface.IsNull())
        return Error{ErrorCode::InvalidSurface, "surface", "the face has none"};
    Rect2d own_bounds = bounds;
    double scale_u = 1, scale_v = 1; // lengths among the parameters grow with a scaled placement
    if (!location.IsIdentity()) {
        const gp_Trsf transform = location.Transformation();
        const gp_GTrsf2d parameters = surface->ParametricTransformation(transform);
        scale_u = parameters.Value(1, 1);
        scale_v = parameters.Value(2, 2);
        own_bounds = {{bounds.lo.x * scale_u, bounds.lo.y * scale_v}, {bounds.hi.x * scale_u, bounds.hi.y * scale_v}};
        surface = Handle(Geom_Surface)::DownCast(surface->Transformed(transform));
    }
    Result<ConvertedSurface> result = convert(surface, own_bounds, tolerance_mm);
    if (!result)
        return result;
    result->uv_map.u.scale *= scale_u;
    result->uv_map.v.scale *= scale_v;
    const bool flat_cone = result->surface.kind == kKindCone && is_flat_cone(result->surface.half_angle);
    if ((!options.native_surfaces && result->surface.kind != kKindBezier) || flat_cone)
        result = native_as_spline(*result, mapped_bounds(bounds, result->uv_map));
    const SplineSurface& s = result->surface.spline;
    if (std::max(s.degree_u, s.degree_v) > static_cast<int>(kMaxDegree))
        return Error{ErrorCode::UnsupportedSurface, "surface",
                     fmt::format("degree {} x {} is above {}", s.degree_u, s.degree_v, kMaxDegree)};
    if (!finite(result->surface))
        return Error{ErrorCode::InvalidSurface, "surface", "it holds numbers that are not finite"};
    return result;
}

} // namespace trimray::kernel
