// The loops of a face: every edge use of every wire, in the walk's order, with its pcurve as a B-spline in uv.
#include "preprocess/import/cad_import_kernel.h"
#include "preprocess/trims/trim_curve.h"

#include <BRepTools_WireExplorer.hxx>
#include <BRep_Tool.hxx>
#include <Geom2dConvert.hxx>
#include <Geom2d_BSplineCurve.hxx>
#include <Geom2d_BezierCurve.hxx>
#include <Geom2d_Line.hxx>
#include <Geom2d_TrimmedCurve.hxx>
#include <ShapeFix_Edge.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Iterator.hxx>
#include <TopoDS_Wire.hxx>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace trimray::kernel {
namespace {

SplineCurve2d from_kernel_spline(const Geom2d_BSplineCurve& source)
{
    SplineCurve2d curve;
    curve.degree = source.Degree();
    curve.rational = source.IsRational();
    const TColStd_Array1OfReal& knots = source.KnotSequence();
    curve.knots.assign(knots.begin(), knots.end());
    curve.control_points.reserve(source.NbPoles());
    for (int i = 1; i <= source.NbPoles(); ++i) {
        const gp_Pnt2d p = source.Pole(i);
        const double w = curve.rational ? source.Weight(i) : 1.0;
        curve.control_points.push_back({w * p.X(), w * p.Y(), w});
    }
    return curve;
}

SplineCurve2d segment(const gp_Pnt2d& a, const gp_Pnt2d& b, double first, double last)
{
    SplineCurve2d curve;
    curve.degree = 1;
    curve.knots = {first, first, last, last};
    curve.control_points = {{a.X(), a.Y(), 1.0}, {b.X(), b.Y(), 1.0}};
    return curve;
}

bool finite(const SplineCurve2d& curve)
{
    for (const auto& point : curve.control_points)
        if (!std::isfinite(point[0]) || !std::isfinite(point[1]) || !std::isfinite(point[2]))
            return false;
    return std::all_of(curve.knots.begin(), curve.knots.end(), [](double k) { return std::isfinite(k); });
}

Vec2d start_of(const CadEdgeUse& use, bool end)
{
    // ends of a use without evaluating: the kernel's splines are clamped, or nearly so; good enough to order by
    const SplineCurve2d& c = use.pcurve;
    const bool at_last = use.reversed != end;
    const double t = at_last ? use.last : use.first;
    const double k0 = c.knots[c.degree], k1 = c.knots[c.control_points.size()];
    const double s = k1 > k0 ? std::clamp((t - k0) / (k1 - k0), 0.0, 1.0) : 0.0;
    const size_t i = static_cast<size_t>(std::lround(s * static_cast<double>(c.control_points.size() - 1)));
    const auto& p = c.control_points[i];
    return {p[0] / p[2], p[1] / p[2]};
}

double distance(Vec2d a, Vec2d b)
{
    return std::hypot(a.x - b.x, a.y - b.y);
}

/// Chains uses by the nearest next end, for wires whose own order is incomplete. Starts a new loop where the chain
/// has come back to its start and edges are left.
std::vector<CadLoop> chain(std::vector<CadEdgeUse> uses)
{
    std::vector<CadLoop> loops;
    while (!uses.empty()) {
        CadLoop loop{std::move(uses.front())};
        uses.erase(uses.begin());
        while (!uses.empty()) {
            const Vec2d tail = start_of(loop.back(), true);
            const auto nearest = std::min_element(uses.begin(), uses.end(), [&](const auto& a, const auto& b) {
                return distance(start_of(a, false), tail) < distance(start_of(b, false), tail);
            });
            if (distance(start_of(loop.front(), false), tail) < distance(start_of(*nearest, false), tail))
                break;
            loop.push_back(std::move(*nearest));
            uses.erase(nearest);
        }
        loops.push_back(std::move(loop));
    }
    return loops;
}

constexpr double kMuchNearer = 0.5; // of the file's pcurve's deviation: what a projection must reach to replace it

/// Measures a use's pcurve, and replaces it where that is worth it.
void gauge_use(const TopoDS_Edge& edge, const PcurveGauge& gauge, const PcurvePoint& pcurve, double first, double last,
               double resolution_mm, CadEdgeUse& use)
{
    const PcurveGauge::Deviation deviation = gauge.deviation(edge, pcurve, first, last);
    use.deviation_mm = deviation.mm;
    const double tolerance_mm = BRep_Tool::Tolerance(edge);
    if (deviation.mm <= tolerance_mm)
        return;
    use.state = PcurveState::Small;
    if (deviation.mm <= resolution_mm)
        return;
    use.state = PcurveState::OffSurface;
    if (deviation.along_mm <= kMuchNearer * deviation.mm)
        return;
    use.state = PcurveState::NotBettered;
    Result<SplineCurve2d> projected =
        gauge.projected(edge, pcurve, first, last, deviation.mm, 0.1 * std::max(tolerance_mm, resolution_mm));
    if (!projected)
        return;
    const auto projected_point = [&](double t) { return curve_point(*projected, t); };
    const double projected_mm = gauge.deviation(edge, projected_point, first, last).mm;
    if (!(projected_mm <= kMuchNearer * deviation.mm))
        return;
    use.pcurve = std::move(*projected);
    use.first = first;
    use.last = last;
    use.deviation_mm = projected_mm;
    use.file_deviation_mm = deviation.mm;
    use.state = PcurveState::Rebuilt;
}

Result<CadEdgeUse> edge_use(const TopoDS_Edge& edge, const TopoDS_Face& face, const TopTools_IndexedMapOfShape& edges,
                            const PcurveGauge& gauge, bool may_project, double resolution_mm)
{
    double first = 0, last = 0;
    Handle(Geom2d_Curve) curve = BRep_Tool::CurveOnSurface(edge, face, first, last);
    if (curve.IsNull() && may_project) {
        ShapeFix_Edge fix;
        if (fix.FixAddPCurve(edge, face, false, BRep_Tool::Tolerance(edge)))
            curve = BRep_Tool::CurveOnSurface(edge, face, first, last);
    }
    if (curve.IsNull())
        return Error{ErrorCode::InvalidTrim, "edge", "it has no pcurve and could not be projected onto the surface"};
    const Result<ConvertedPcurve> pcurve = convert_pcurve(curve, first, last);
    if (!pcurve)
        return pcurve.error();
    CadEdgeUse use;
    use.pcurve = pcurve->curve;
    use.first = pcurve->first;
    use.last = pcurve->last;
    use.reversed = edge.Orientation() == TopAbs_REVERSED;
    use.seam = BRep_Tool::IsClosed(edge, face);
    use.degenerate = BRep_Tool::Degenerated(edge);
    const auto point = [&](double t) {
        const gp_Pnt2d p = curve->Value(t);
        return Vec2d{p.X(), p.Y()};
    };
    // a face is not lost because one of its pcurves cannot be measured
    if (failure_of([&] { gauge_use(edge, gauge, point, first, last, resolution_mm, use); }))
        use.state = PcurveState::NotMeasured;
    const int index = edges.FindIndex(edge);
    if (index == 0)
        return Error{ErrorCode::InvalidTrim, "edge", "it is not among its part's edges"};
    use.edge = static_cast<uint32_t>(index - 1);
    return use;
}

} // namespace

Result<ConvertedPcurve> convert_pcurve(const Handle(Geom2d_Curve) & source, double first, double last)
{
    if (!std::isfinite(first) || !std::isfinite(last) || std::abs(first) > 1e99 || std::abs(last) > 1e99)
        return Error{ErrorCode::InvalidTrim, "pcurve", "its parameter range is not finite"};
    if (!(first < last))
        return Error{ErrorCode::InvalidTrim, "pcurve",
                     fmt::format("its parameter range {} .. {} is empty", first, last)};
    Handle(Geom2d_Curve) curve = source;
    while (const auto trimmed = Handle(Geom2d_TrimmedCurve)::DownCast(curve))
        curve = trimmed->BasisCurve();

    ConvertedPcurve out{{}, first, last};
    if (!Handle(Geom2d_Line)::DownCast(curve).IsNull()) {
        out.curve = segment(curve->Value(first), curve->Value(last), first, last);
    } else if (curve->IsPeriodic()) {
        const Handle(Geom2d_BSplineCurve) spline =
            Geom2dConvert::CurveToBSplineCurve(new Geom2d_TrimmedCurve(curve, first, last));
        out = {from_kernel_spline(*spline), spline->FirstParameter(), spline->LastParameter()};
    } else {
        const double slack = 1e-9 * (last - first); // a rounding error outside its knots
        const bool inside = first >= curve->FirstParameter() - slack && last <= curve->LastParameter() + slack;
        const bool whole = !Handle(Geom2d_BSplineCurve)::DownCast(curve).IsNull() ||
                           !Handle(Geom2d_BezierCurve)::DownCast(curve).IsNull();
        if (inside && whole) {
            const Handle(Geom2d_BSplineCurve) spline = Geom2dConvert::CurveToBSplineCurve(curve);
            out.curve = from_kernel_spline(*spline);
            out.first = std::max(first, spline->FirstParameter());
            out.last = std::min(last, spline->LastParameter());
        } else if (inside) {
            const Handle(Geom2d_BSplineCurve) spline =
                Geom2dConvert::CurveToBSplineCurve(new Geom2d_TrimmedCurve(curve, first, last));
            out = {from_kernel_spline(*spline), spline->FirstParameter(), spline->LastParameter()};
        } else {
            // the kernel goes on beyond the end knots with the end span's polynomial, and so do we
            std::vector<double> breaks{first};
            for (const double end : {curve->FirstParameter(), curve->LastParameter()})
                if (end > breaks.back() && end < last)
                    breaks.push_back(end);
            breaks.push_back(last);
            const double size = curve->Value(first).Distance(curve->Value(last)) + 1e-9;
            const Result<SplineCurve2d> followed = approximate_curve2d(
                [&](double t) {
                    const gp_Pnt2d p = curve->Value(t);
                    return Vec2d{p.X(), p.Y()};
                },
                breaks, 1e-9 * size);
            if (!followed)
                return followed.error();
            out.curve = *followed;
        }
    }
    if (!finite(out.curve))
        return Error{ErrorCode::InvalidTrim, "pcurve", "it holds numbers that are not finite"};
    return out;
}

Result<std::vector<CadLoop>> collect_loops(const TopoDS_Face& face, const TopTools_IndexedMapOfShape& edges,
                                           bool may_project, double resolution_mm)
{
    std::vector<CadLoop> loops;
    const PcurveGauge gauge(face);
    for (TopoDS_Iterator it(face, false); it.More(); it.Next()) {
        if (it.Value().ShapeType() != TopAbs_WIRE || it.Value().Orientation() == TopAbs_INTERNAL ||
            it.Value().Orientation() == TopAbs_EXTERNAL)
            continue;
        const TopoDS_Wire wire = TopoDS::Wire(it.Value());
        std::vector<TopoDS_Edge> all;
        for (TopExp_Explorer e(wire, TopAbs_EDGE); e.More(); e.Next())
            if (e.Current().Orientation() == TopAbs_FORWARD || e.Current().Orientation() == TopAbs_REVERSED)
                all.push_back(TopoDS::Edge(e.Current()));
        std::vector<TopoDS_Edge> walked;
        for (BRepTools_WireExplorer e(wire, face); e.More() && walked.size() <= all.size(); e.Next())
            walked.push_back(e.Current());
        const bool complete = walked.size() == all.size();
        std::vector<CadEdgeUse> uses;
        for (const TopoDS_Edge& edge : complete ? walked : all) {
            Result<CadEdgeUse> use = edge_use(edge, face, edges, gauge, may_project, resolution_mm);
            if (!use)
                return use.error();
            uses.push_back(std::move(*use));
        }
        if (uses.empty())
            continue;
        if (complete)
            loops.push_back(std::move(uses));
        else
            for (CadLoop& loop : chain(std::move(uses)))
                loops.push_back(std::move(loop));
    }
    return loops;
}

} // namespace trimray::kernel
