// How far a pcurve, carried to space by its surface, runs from its edge's own curve, and a better one by projection
// (HARD_CASES 15).
#include "preprocess/cad_import_kernel.h"

#include <BRep_Tool.hxx>
#include <Geom2d_Curve.hxx>
#include <Geom2d_TrimmedCurve.hxx>
#include <GeomAdaptor_Curve.hxx>
#include <Geom_Curve.hxx>
#include <Geom_Surface.hxx>
#include <Precision.hxx>
#include <ShapeConstruct_ProjectCurveOnSurface.hxx>
#include <TopoDS_Edge.hxx>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace trimray::kernel {
namespace {

// Below this an edge is where its pcurve says: the kernel's own idea of one point, and rounding at a part's size.
constexpr double kNoDeviation_mm = 1e-9;
constexpr double kFarFromTolerance = 0.1; // of the edge's tolerance: below, the largest sample is good enough
constexpr int kSamplesOfLines = 8;        // spans between samples of a line or circle on a native surface
constexpr int kSamplesPerSpan = 4, kMostSamples = 128;
constexpr double kMuchBetter = 0.5; // of the deviation: what a projection must reach to replace the file's pcurve

/// A curve in space over the range of an edge.
struct SpaceCurve {
    GeomAdaptor_Curve curve;
    double first = 0, last = 0;

    /// Distance of `q` from the curve, sought from parameter t on: Gauss-Newton on |C(s) - q|, held to the range, as
    /// long as it comes nearer.
    double distance(const gp_Pnt& q, double t) const
    {
        double best = 1e300;
        for (int i = 0; i < 16; ++i) {
            gp_Pnt p;
            gp_Vec d;
            curve.D1(t, p, d);
            const gp_Vec off(p, q);
            const double distance = off.Magnitude();
            if (!(distance < best * (1 - 1e-3)))
                return std::min(best, distance);
            best = distance;
            const double speed2 = d.SquareMagnitude();
            if (best < kNoDeviation_mm || !(speed2 > 0))
                return best;
            t = std::clamp(t + off.Dot(d) / speed2, first, last);
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

} // namespace

PcurveGauge::PcurveGauge(const TopoDS_Face& face)
{
    const Handle(Geom_Surface) surface = BRep_Tool::Surface(face, location_);
    if (!surface.IsNull())
        surface_.Load(surface);
}

double PcurveGauge::deviation_mm(const TopoDS_Edge& edge, const Handle(Geom2d_Curve) & pcurve, double first,
                                 double last) const
{
    TopLoc_Location location;
    SpaceCurve space;
    const Handle(Geom_Curve) curve = BRep_Tool::Curve(edge, location, space.first, space.last);
    if (curve.IsNull() || surface_.Surface().IsNull() || !(space.first < space.last))
        return 0;
    space.curve.Load(curve);
    gp_Trsf to_curve; // from the surface's axes to the curve's
    const bool moved = location != location_;
    if (moved)
        to_curve = location.Transformation().Inverted() * location_.Transformation();
    const double scale_mm = std::abs(location.Transformation().ScaleFactor());
    // an edge whose curves do not run alike is compared from the nearest of a few points on
    const bool same = BRep_Tool::SameParameter(edge) && BRep_Tool::SameRange(edge);

    const auto deviation = [&](double share) {
        const gp_Pnt2d uv = pcurve->Value(first + share * (last - first));
        gp_Pnt q = surface_.Value(uv.X(), uv.Y());
        if (moved)
            q.Transform(to_curve);
        double t = space.first + share * (space.last - space.first);
        if (!same) {
            constexpr int kStarts = 32;
            double nearest = 1e300;
            for (int i = 0; i <= kStarts; ++i) {
                const double s = space.first + i * (space.last - space.first) / kStarts;
                const double d = space.curve.Value(s).SquareDistance(q);
                if (d < nearest) {
                    nearest = d;
                    t = s;
                }
            }
        }
        return space.distance(q, t) * scale_mm;
    };

    int spans = kSamplesOfLines;
    if (is_spline(space.curve) || !is_native(surface_))
        spans = std::clamp(kSamplesPerSpan * space.curve.NbIntervals(GeomAbs_C2), 2 * kSamplesOfLines, kMostSamples);
    double worst = 0, at = 0;
    for (int i = 0; i <= spans; ++i) {
        const double share = static_cast<double>(i) / spans, d = deviation(share);
        if (d > worst) {
            worst = d;
            at = share;
        }
    }
    if (worst < kNoDeviation_mm)
        return 0;
    if (worst < kFarFromTolerance * BRep_Tool::Tolerance(edge))
        return worst;
    // golden section around the worst sample
    double lo = std::max(at - 1.0 / spans, 0.0), hi = std::min(at + 1.0 / spans, 1.0);
    constexpr double kGolden = 1 - 1 / std::numbers::phi;
    for (int i = 0; i < 8; ++i) {
        const double a = lo + kGolden * (hi - lo), b = hi - kGolden * (hi - lo);
        const double da = deviation(a), db = deviation(b);
        worst = std::max({worst, da, db});
        (da > db ? hi : lo) = da > db ? b : a;
    }
    return worst;
}

Handle(Geom2d_Curve) PcurveGauge::projected(const TopoDS_Edge& edge, const Handle(Geom2d_Curve) & pcurve, double first,
                                            double last) const
{
    double space_first = 0, space_last = 0;
    Handle(Geom_Curve) curve = BRep_Tool::Curve(edge, space_first, space_last);
    if (curve.IsNull() || surface_.Surface().IsNull())
        return {};
    Handle(Geom_Surface) surface = surface_.Surface();
    if (!location_.IsIdentity())
        surface = Handle(Geom_Surface)::DownCast(surface->Transformed(location_.Transformation()));
    ShapeConstruct_ProjectCurveOnSurface project;
    project.Init(surface, Precision::Confusion());
    Handle(Geom2d_Curve) found;
    // its curve has the parameters of the curve in space
    if (!project.Perform(curve, space_first, space_last, found) || found.IsNull() || first != space_first ||
        last != space_last)
        return {};
    // it may lie whole periods beside the file's
    const double middle = 0.5 * (first + last);
    const gp_Pnt2d was = pcurve->Value(middle), is = found->Value(middle);
    const auto periods = [](double from, double to, bool periodic, double period) {
        return periodic ? period * std::round((to - from) / period) : 0.0;
    };
    const gp_Vec2d by(
        periods(is.X(), was.X(), surface->IsUPeriodic(), surface->IsUPeriodic() ? surface->UPeriod() : 0),
        periods(is.Y(), was.Y(), surface->IsVPeriodic(), surface->IsVPeriodic() ? surface->VPeriod() : 0));
    if (by.SquareMagnitude() > 0)
        found->Translate(by);
    return found;
}

} // namespace trimray::kernel
