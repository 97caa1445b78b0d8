// How far a pcurve, carried to space by its surface, runs from its edge's own curve, and a better one by projection
// (HARD_CASES 15).
#include "preprocess/import/cad_import_kernel.h"

#include <BRep_Tool.hxx>
#include <GeomAdaptor_Curve.hxx>
#include <Geom_Curve.hxx>
#include <Geom_Surface.hxx>
#include <TColStd_Array1OfReal.hxx>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trimray::kernel {
namespace {

// Below this an edge is where its pcurve says: the kernel's own idea of one point, and rounding at a part's size.
constexpr double kNoDeviation_mm = 1e-9;
constexpr double kFarFromTolerance = 0.1; // of the edge's tolerance: below, the largest sample is good enough
// Spans between samples of a line or circle on a native surface; odd, so that samples are not the nodes that a
// projected curve was fitted at.
constexpr int kSamplesOfLines = 11;
constexpr int kSamplesPerSpan = 4, kMostSamples = 128;

// A projected point farther from the pcurve's than this many deviations is another root.
constexpr double kFarthestStep = 4;

/// A curve in space over the range of an edge.
struct SpaceCurve {
    GeomAdaptor_Curve curve;
    double first = 0, last = 0;
    bool closed = false; // it ends where it begins

    /// The way from `q` to the curve, sought from parameter t on: Gauss-Newton on |C(s) - q|, held to the range (or
    /// around it), as long as it comes nearer.
    gp_Vec way_from(const gp_Pnt& q, double t) const
    {
        gp_Vec best(1e300, 0, 0);
        for (int i = 0; i < 16; ++i) {
            gp_Pnt p;
            gp_Vec d;
            curve.D1(t, p, d);
            const gp_Vec off(q, p);
            if (!(off.SquareMagnitude() < best.SquareMagnitude() * (1 - 2e-3)))
                return off.SquareMagnitude() < best.SquareMagnitude() ? off : best;
            best = off;
            const double speed2 = d.SquareMagnitude();
            if (best.Magnitude() < kNoDeviation_mm || !(speed2 > 0))
                return best;
            t -= off.Dot(d) / speed2;
            if (closed)
                t -= (last - first) * std::floor((t - first) / (last - first));
            t = std::clamp(t, first, last);
        }
        return best;
    }
};

bool is_spline(const GeomAdaptor_Curve& curve)
{
    return curve.GetType() == GeomAbs_BSplineCurve || curve.GetType() == GeomAbs_BezierCurve;
}

bool is_native(const GeomAdaptor_Surface& surface)
{
    return surface.GetType() <= GeomAbs_Torus; // plane, cylinder, cone, sphere, torus come first
}

/// An edge's curve and the way between its axes and the surface's.
struct PlacedCurve {
    SpaceCurve space;
    bool moved = false;
    gp_Trsf to_curve, to_surface;
    double scale_mm = 1; // of a length at the curve

    bool usable() const { return !space.curve.Curve().IsNull() && space.first < space.last; }
    double parameter(double share) const { return space.first + share * (space.last - space.first); }
};

PlacedCurve placed_curve(const TopoDS_Edge& edge, const TopLoc_Location& of_surface)
{
    TopLoc_Location location;
    PlacedCurve placed;
    const Handle(Geom_Curve) curve = BRep_Tool::Curve(edge, location, placed.space.first, placed.space.last);
    if (curve.IsNull())
        return placed;
    placed.space.curve.Load(curve);
    placed.space.closed = BRep_Tool::IsClosed(edge);
    placed.moved = location != of_surface;
    if (placed.moved) {
        placed.to_curve = location.Transformation().Inverted() * of_surface.Transformation();
        placed.to_surface = placed.to_curve.Inverted();
    }
    placed.scale_mm = std::abs(location.Transformation().ScaleFactor());
    return placed;
}

/// Whether an edge's curves say that the same parameter is the same point.
bool runs_alike(const TopoDS_Edge& edge)
{
    return BRep_Tool::SameParameter(edge) && BRep_Tool::SameRange(edge);
}

} // namespace

PcurveGauge::PcurveGauge(const TopoDS_Face& face)
{
    const Handle(Geom_Surface) surface = BRep_Tool::Surface(face, location_);
    if (!surface.IsNull())
        surface_.Load(surface);
}

PcurveGauge::Deviation PcurveGauge::deviation(const TopoDS_Edge& edge, const PcurvePoint& pcurve, double first,
                                              double last) const
{
    const PlacedCurve placed = placed_curve(edge, location_);
    if (!placed.usable() || surface_.Surface().IsNull())
        return {};
    const SpaceCurve& space = placed.space;
    const bool alike = runs_alike(edge);
    const auto way_at = [&](double share) {
        const Vec2d uv = pcurve(first + share * (last - first));
        gp_Pnt q = surface_.Value(uv.x, uv.y);
        if (placed.moved)
            q.Transform(placed.to_curve);
        double t = placed.parameter(share);
        if (!alike) { // from the nearest of a few points on
            constexpr int kStarts = 32;
            double nearest = 1e300;
            for (int i = 0; i <= kStarts; ++i) {
                const double s = placed.parameter(static_cast<double>(i) / kStarts);
                const double d = space.curve.Value(s).SquareDistance(q);
                if (d < nearest) {
                    nearest = d;
                    t = s;
                }
            }
        }
        return space.way_from(q, t);
    };
    const auto distance = [&](double share) { return way_at(share).Magnitude() * placed.scale_mm; };
    const auto measured = [&](double share, double mm) {
        const Vec2d uv = pcurve(first + share * (last - first));
        gp_Pnt p;
        gp_Vec du, dv, way = way_at(share);
        surface_.D1(uv.x, uv.y, p, du, dv);
        if (placed.moved)
            way.Transform(placed.to_surface);
        const gp_Vec normal = du.Crossed(dv);
        const double product = normal.Magnitude() * way.Magnitude();
        const double off = product > 0 ? way.Dot(normal) / product : 0;
        return Deviation{mm, mm * std::sqrt(std::max(1 - off * off, 0.0))};
    };

    int spans = kSamplesOfLines;
    if (is_spline(space.curve) || !is_native(surface_))
        spans =
            std::clamp(kSamplesPerSpan * space.curve.NbIntervals(GeomAbs_C2), 2 * kSamplesOfLines, kMostSamples) | 1;
    double worst = 0, at = 0;
    for (int i = 0; i <= spans; ++i) {
        const double share = static_cast<double>(i) / spans, d = distance(share);
        if (d > worst) {
            worst = d;
            at = share;
        }
    }
    if (worst < kNoDeviation_mm)
        return {};
    if (worst < kFarFromTolerance * BRep_Tool::Tolerance(edge))
        return measured(at, worst);
    // golden section around the worst sample
    double lo = std::max(at - 1.0 / spans, 0.0), hi = std::min(at + 1.0 / spans, 1.0);
    constexpr double kGolden = 1 - 1 / std::numbers::phi;
    for (int i = 0; i < 8; ++i) {
        const double a = lo + kGolden * (hi - lo), b = hi - kGolden * (hi - lo);
        const double da = distance(a), db = distance(b);
        for (const auto& [share, mm] : {std::pair(a, da), std::pair(b, db)})
            if (mm > worst) {
                worst = mm;
                at = share;
            }
        (da > db ? hi : lo) = da > db ? b : a;
    }
    return measured(at, worst);
}

Result<SplineCurve2d> PcurveGauge::projected(const TopoDS_Edge& edge, const PcurvePoint& pcurve, double first,
                                             double last, double deviation_mm, double tolerance_mm) const
{
    const PlacedCurve placed = placed_curve(edge, location_);
    if (!placed.usable() || surface_.Surface().IsNull() || !runs_alike(edge))
        return Error{ErrorCode::InvalidTrim, "pcurve", "its edge has no curve in space that runs like it"};
    const double farthest = kFarthestStep * deviation_mm / placed.scale_mm;
    double speed = 0; // the most that a step in uv is in space
    const auto project = [&](double t) {
        const Vec2d start = pcurve(t);
        Vec2d uv = start;
        gp_Pnt target = placed.space.curve.Value(placed.parameter((t - first) / (last - first)));
        if (placed.moved)
            target.Transform(placed.to_surface);
        for (int i = 0; i < 20; ++i) {
            gp_Pnt p;
            gp_Vec du, dv;
            surface_.D1(uv.x, uv.y, p, du, dv);
            speed = std::max({speed, du.Magnitude(), dv.Magnitude()});
            // normal equations of |S + du a + dv b - target|
            const gp_Vec off(p, target);
            const double uu = du.SquareMagnitude(), vv = dv.SquareMagnitude(), mixed = du.Dot(dv);
            const double determinant = uu * vv - mixed * mixed;
            if (!(determinant > 1e-12 * uu * vv))
                return start; // a pole
            const double ru = off.Dot(du), rv = off.Dot(dv);
            const double a = (ru * vv - rv * mixed) / determinant, b = (rv * uu - ru * mixed) / determinant;
            uv = {uv.x + a, uv.y + b};
            const double moved = std::hypot((uv.x - start.x) * du.Magnitude(), (uv.y - start.y) * dv.Magnitude());
            if (!(moved <= farthest))
                return start;
            if (std::hypot(a * du.Magnitude(), b * dv.Magnitude()) <= 1e-12 * (1 + target.XYZ().Modulus()))
                break;
        }
        return uv;
    };
    for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) // fills `speed`
        project(first + share * (last - first));
    if (!(speed > 0))
        return Error{ErrorCode::InvalidTrim, "pcurve", "its surface has no extent along it"};
    TColStd_Array1OfReal intervals(1, placed.space.curve.NbIntervals(GeomAbs_C2) + 1);
    placed.space.curve.Intervals(intervals, GeomAbs_C2);
    std::vector<double> breaks{first};
    for (const double s : intervals) {
        const double t = first + (s - placed.space.first) / (placed.space.last - placed.space.first) * (last - first);
        if (t > breaks.back() && t < last)
            breaks.push_back(t);
    }
    breaks.push_back(last);
    return approximate_curve2d(project, breaks, tolerance_mm / (speed * placed.scale_mm));
}

} // namespace trimray::kernel
