// Compares our depths with the oracle's and finds why a ray disagrees: by the distance of the hit points to the edges
// of their faces, by the angle of incidence, and by asking the kernel in other ways (projection, jittered rays).
#include "tests/occt_oracle_impl.h"

#include <BRepAdaptor_Surface.hxx>
#include <BRepBuilderAPI_MakeVertex.hxx>
#include <BRepClass_FaceClassifier.hxx>
#include <BRepExtrema_DistShapeShape.hxx>
#include <BRepGProp_Face.hxx>
#include <BRep_Tool.hxx>
#include <Standard_Failure.hxx>
#include <TopExp.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <gp_Ax2.hxx>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace trimray::oracle {

namespace {

Point along(const Ray& ray, double t)
{
    return {ray.origin[0] + t * ray.direction[0], ray.origin[1] + t * ray.direction[1],
            ray.origin[2] + t * ray.direction[2]};
}

// The kernel's polygons follow curves this closely; beyond this share of the diagonal no such excuse is taken.
constexpr double kNearEdge = 1e-4;
// Where a surface bends, a ray this flat dips under it by cos^2/2 of the radius of curvature only.
constexpr double kGrazingCosine = 0.05;

const char* kind_name(const TopoDS_Face& face)
{
    switch (BRepAdaptor_Surface(face, false).GetType()) {
    case GeomAbs_Plane:
        return "plane";
    case GeomAbs_Cylinder:
        return "cylinder";
    case GeomAbs_Cone:
        return "cone";
    case GeomAbs_Sphere:
        return "sphere";
    case GeomAbs_Torus:
        return "torus";
    case GeomAbs_BezierSurface:
        return "bezier";
    case GeomAbs_BSplineSurface:
        return "bspline";
    case GeomAbs_SurfaceOfRevolution:
        return "revolution";
    case GeomAbs_SurfaceOfExtrusion:
        return "extrusion";
    case GeomAbs_OffsetSurface:
        return "offset";
    default:
        return "other";
    }
}

/// A point against a trimmed face. Distances in world mm.
struct PointOnFace {
    double face_distance_mm = std::numeric_limits<double>::infinity();
    double edge_distance_mm = std::numeric_limits<double>::infinity();
    double edge_excess_mm = std::numeric_limits<double>::infinity(); // distance less the edge's tolerance, the least
    double edge_tolerance_mm = 0;
    double cos_incidence = -1;
};

} // namespace

struct Explainer {
    const Oracle::Impl& oracle;
    double diagonal_mm;

    PointOnFace locate(const Ray& ray, const Point& p, int32_t face_index) const
    {
        const PlacedFace& placed = oracle.placed[size_t(face_index)];
        const TopoDS_Face& face = oracle.unique[placed.unique];
        gp_Pnt local(p[0], p[1], p[2]);
        local.Transform(placed.to_local);
        const TopoDS_Vertex vertex = BRepBuilderAPI_MakeVertex(local).Vertex();
        PointOnFace found;
        try {
            BRepExtrema_DistShapeShape to_face(vertex, face);
            if (to_face.IsDone() && to_face.NbSolution() > 0) {
                found.face_distance_mm = to_face.Value() / placed.local_scale;
                if (to_face.SupportTypeShape2(1) == BRepExtrema_IsInFace) {
                    double u = 0, v = 0;
                    to_face.ParOnFaceS2(1, u, v);
                    found.cos_incidence = cos_at(ray, placed, u, v);
                }
            }
            TopTools_IndexedMapOfShape edges;
            TopExp::MapShapes(face, TopAbs_EDGE, edges);
            for (int i = 1; i <= edges.Extent(); ++i) {
                const TopoDS_Edge& edge = TopoDS::Edge(edges(i));
                if (BRep_Tool::Degenerated(edge))
                    continue;
                BRepExtrema_DistShapeShape to_edge(vertex, edge);
                if (!to_edge.IsDone() || to_edge.NbSolution() == 0)
                    continue;
                const double distance = to_edge.Value() / placed.local_scale;
                const double tolerance = BRep_Tool::Tolerance(edge) / placed.local_scale;
                if (distance - tolerance < found.edge_excess_mm) {
                    found.edge_excess_mm = distance - tolerance;
                    found.edge_distance_mm = distance;
                    found.edge_tolerance_mm = tolerance;
                }
            }
        } catch (const Standard_Failure&) {
        }
        return found;
    }

    double cos_at(const Ray& ray, const PlacedFace& placed, double u, double v) const
    {
        gp_Pnt p;
        gp_Vec normal;
        BRepGProp_Face(oracle.unique[placed.unique]).Normal(u, v, p, normal);
        if (normal.Magnitude() == 0)
            return -1;
        normal.Transform(placed.to_world);
        const gp_Vec d(ray.direction[0], ray.direction[1], ray.direction[2]);
        return std::abs(normal.Normalized() * d);
    }

    /// Whether the hit lies outside of its face's curves themselves. The intersector goes by polygons of the curves,
    /// widened by a tolerance in parameters; this classifier intersects with the curves.
    bool outside_exactly(const OracleHit& hit) const
    {
        constexpr double kNoTolerance = 1e-12;
        const TopoDS_Face& face = oracle.unique[oracle.placed[size_t(hit.face)].unique];
        return BRepClass_FaceClassifier(face, gp_Pnt2d(hit.u, hit.v), kNoTolerance).State() == TopAbs_OUT;
    }

    /// Six rays turned by `angle_rad` about two axes: does any of the kernel's answers agree with ours?
    bool turned_agrees(const Ray& ray, double ours_mm, double angle_rad) const
    {
        const gp_Vec d(ray.direction[0], ray.direction[1], ray.direction[2]);
        const gp_Vec a = gp_Vec(gp_Ax2(gp_Pnt(), gp_Dir(d)).XDirection()), b = d ^ a;
        for (int k = 0; k < 6; ++k) {
            const double around = k * 1.0471975511965976; // 60 degrees
            const gp_Vec turned = (d + (a * std::cos(around) + b * std::sin(around)) * angle_rad).Normalized();
            const OracleHit hit = oracle.closest({ray.origin, {turned.X(), turned.Y(), turned.Z()}});
            if (agrees(ours_mm, hit.distance_mm))
                return true;
        }
        return false;
    }

    bool agrees(double ours_mm, double oracle_mm) const
    {
        if (!std::isfinite(ours_mm) || !std::isfinite(oracle_mm))
            return std::isfinite(ours_mm) == std::isfinite(oracle_mm);
        return std::abs(ours_mm - oracle_mm) <= oracle.options.depth_tolerance * diagonal_mm;
    }

    Disagreement explain(const Ray& ray, double ours_mm, const OracleHit& hit) const
    {
        Disagreement found;
        found.ours_mm = ours_mm;
        found.oracle_mm = hit.distance_mm;
        found.face = hit.face;
        const double margin_mm = oracle.options.edge_margin * diagonal_mm;
        const double on_face_mm = oracle.options.depth_tolerance * diagonal_mm;
        const auto record = [&](int32_t face, const PointOnFace& at) {
            found.face = face;
            found.cos_incidence = at.cos_incidence;
            found.edge_distance_mm = at.edge_distance_mm;
            found.edge_tolerance_mm = at.edge_tolerance_mm;
        };

        PointOnFace at_oracle;
        if (hit.hit()) {
            at_oracle = locate(ray, along(ray, hit.distance_mm), hit.face);
            at_oracle.cos_incidence = cos_at(ray, oracle.placed[size_t(hit.face)], hit.u, hit.v);
        }
        PointOnFace at_ours;
        int32_t our_face = -1;
        if (std::isfinite(ours_mm)) {
            const Point p = along(ray, ours_mm);
            for (const uint32_t face : oracle.faces_around(p, on_face_mm)) {
                const PointOnFace at = locate(ray, p, int32_t(face));
                if (at.edge_excess_mm <= margin_mm) { // the nearest edge decides at once
                    at_ours = at;
                    our_face = int32_t(face);
                    break;
                }
                if (at.face_distance_mm < at_ours.face_distance_mm) {
                    at_ours = at;
                    our_face = int32_t(face);
                }
            }
        }
        const double nearest_mm = std::min(ours_mm, hit.distance_mm);
        const auto grazes = [&](const PointOnFace& at) { // moved sideways by the tolerance, the ray gives our answer
            return at.cos_incidence >= 0 && at.cos_incidence < kGrazingCosine &&
                   turned_agrees(ray, ours_mm, on_face_mm / nearest_mm);
        };
        const bool ours_on_face = our_face >= 0 && at_ours.face_distance_mm <= on_face_mm;

        // 1. within an edge's tolerance
        if (hit.hit() && at_oracle.edge_excess_mm <= margin_mm) {
            record(hit.face, at_oracle);
            found.cause = Cause::Edge;
            found.why = "the oracle's hit lies within an edge's tolerance";
        } else if (our_face >= 0 && at_ours.edge_excess_mm <= margin_mm) {
            record(our_face, at_ours);
            found.cause = Cause::Edge;
            found.why = "our hit lies within an edge's tolerance";
        } else if (hit.hit() && at_oracle.edge_distance_mm <= kNearEdge * diagonal_mm && outside_exactly(hit)) {
            record(hit.face, at_oracle);
            found.cause = Cause::Edge;
            found.why =
                "the oracle widens or flattens its curves: its hit lies outside of them by the kernel's own classifier";
            // 2. grazing
        } else if (hit.hit() && hit.distance_mm < ours_mm + on_face_mm && at_oracle.cos_incidence >= 0 &&
                   at_oracle.cos_incidence < oracle.options.tangent_cosine) {
            record(hit.face, at_oracle);
            found.cause = Cause::Tangent;
            found.why = "the ray grazes the surface at the oracle's hit";
        } else if (ours_on_face && at_ours.cos_incidence >= 0 &&
                   at_ours.cos_incidence < oracle.options.tangent_cosine) {
            record(our_face, at_ours);
            found.cause = Cause::Tangent;
            found.why = "the ray grazes the surface at our hit";
        } else if (grazes(at_oracle) || (ours_on_face && grazes(at_ours))) {
            record(grazes(at_oracle) ? hit.face : our_face, grazes(at_oracle) ? at_oracle : at_ours);
            found.cause = Cause::Tangent;
            found.why = "the ray grazes the surface, no deeper than the tolerance";
            // 3. the kernel against itself
        } else if (ours_on_face && ours_mm < hit.distance_mm) {
            record(our_face, at_ours);
            found.cause = Cause::Oracle;
            found.why = "our nearer hit lies on a face by the kernel's projection: its intersector lost it";
        } else if (hit.hit() && at_oracle.face_distance_mm > on_face_mm) {
            record(hit.face, at_oracle);
            found.cause = Cause::Oracle;
            found.why = "the oracle's hit is off its face by the kernel's projection";
        } else if (turned_agrees(ray, ours_mm, oracle.options.jitter_rad)) {
            record(hit.hit() ? hit.face : our_face, hit.hit() ? at_oracle : at_ours);
            found.cause = Cause::Oracle;
            found.why = "the oracle agrees with us when the ray is turned by a jitter";
        } else {
            record(hit.hit() ? hit.face : our_face, hit.hit() ? at_oracle : at_ours);
            found.cause = Cause::Unexplained;
            if (!std::isfinite(ours_mm))
                found.why = "hole: we miss a face";
            else if (!hit.hit() || ours_mm < hit.distance_mm)
                found.why = "false face: we hit where no face is";
            else
                found.why = "hole: we hit a face behind";
        }
        if (found.face >= 0)
            found.surface = kind_name(oracle.unique[oracle.placed[size_t(found.face)].unique]);
        return found;
    }
};

Agreement Oracle::compare(std::span<const Ray> rays, std::span<const float> ours_mm,
                          std::span<const OracleHit> hits) const
{
    assert(rays.size() == ours_mm.size() && rays.size() == hits.size() && "one answer a ray");
    const Explainer explainer{*impl_, diagonal_mm()};
    Agreement result;
    result.rays = rays.size();
    std::vector<size_t> wrong;
    for (size_t i = 0; i < rays.size(); ++i) {
        const double ours = ours_mm[i];
        if (!explainer.agrees(ours, hits[i].distance_mm)) {
            wrong.push_back(i);
            continue;
        }
        ++result.agree;
        ++(hits[i].hit() ? result.both_hit : result.both_miss);
        if (hits[i].hit())
            result.worst_agreeing_error =
                std::max(result.worst_agreeing_error, std::abs(ours - hits[i].distance_mm) / explainer.diagonal_mm);
    }
    result.disagreements.resize(wrong.size());
    tbb::parallel_for(size_t(0), wrong.size(), [&](size_t k) {
        const size_t i = wrong[k];
        Disagreement& found = result.disagreements[k];
        if (k < impl_->options.max_classified) {
            found = explainer.explain(rays[i], ours_mm[i], hits[i]);
        } else {
            found.ours_mm = ours_mm[i];
            found.oracle_mm = hits[i].distance_mm;
            found.face = hits[i].face;
            found.why = "not looked into: too many";
        }
        found.ray = i;
    });
    for (const Disagreement& found : result.disagreements)
        ++result.by_cause[size_t(found.cause)];
    return result;
}

} // namespace trimray::oracle
