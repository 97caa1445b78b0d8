#include "preprocess/edge_class.h"

#include "preprocess/bezier_patch.h"
#include "preprocess/trim_curve.h"
#include "preprocess/vec3d.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

namespace trimray {
namespace {

struct Side {
    const CadFace* face = nullptr;
    CadEdgeUse* use = nullptr;
};

/// A point of a pcurve on its surface: the normal of the side on which the edge runs forward, and the tangent along t.
struct SidePoint {
    Vec3d p, normal, tangent;
    bool regular = true; // the normal is one
};

SidePoint point_of(const Side& side, double t)
{
    const CadEdgeUse& use = *side.use;
    const double step = 1e-6 * (use.last - use.first); // inwards, for the tangent in uv
    const double beside = t + step <= use.last ? t + step : t - step;
    const Vec2d uv = curve_point(use.pcurve, t), next = curve_point(use.pcurve, beside);
    const SurfaceDerivatives s = evaluate(side.face->surface, uv.x, uv.y);
    SidePoint point;
    point.p = s.p;
    point.tangent = (1 / (beside - t)) * ((next.x - uv.x) * s.du + (next.y - uv.y) * s.dv);
    const Vec3d across = cross(s.du, s.dv);
    const double length = norm(across);
    // a pole: rounding alone leaves |S_u x S_v| a few eps of |S_u||S_v|, or one of them is nothing beside the other
    constexpr double kSingular = 1e-9;
    const double larger = std::max(norm(s.du), norm(s.dv));
    point.regular = length > kSingular * larger * larger;
    if (point.regular)
        point.normal = (use.reversed ? -1 / length : 1 / length) * across;
    return point;
}

double parameter_at(const CadEdgeUse& use, double share)
{
    return use.first + share * (use.last - use.first);
}

/// The point of `side` that is nearest to `p`, from a share of its range on: pcurves of one edge may run unalike.
SidePoint nearest_point(const Side& side, double share, Vec3d p)
{
    double t = parameter_at(*side.use, share);
    SidePoint point = point_of(side, t);
    for (int i = 0; i < 4; ++i) {
        const double speed2 = dot(point.tangent, point.tangent);
        const double step = speed2 > 0 ? dot(p - point.p, point.tangent) / speed2 : 0;
        constexpr double kNear = 1e-4; // of the range: a circle's normal turns by 0.04 degrees there
        if (!(std::abs(step) > kNear * (side.use->last - side.use->first)))
            break;
        t = std::clamp(t + step, side.use->first, side.use->last);
        point = point_of(side, t);
    }
    return point;
}

/// Whether both sides of an edge have one tangent plane along it; nothing where no sample tells.
std::optional<bool> tangent_along(const Side& a, const Side& b)
{
    // an edge's middle tells most edges apart; its very ends may be poles
    constexpr double kShares[] = {0.5, 0.01, 0.99, 0.25, 0.75, 0.125, 0.375, 0.625, 0.875};
    const double most = std::sin(kSmoothAngle_deg * std::numbers::pi / 180);
    bool measured = false;
    for (const double share : kShares) {
        const SidePoint at = point_of(a, parameter_at(*a.use, share));
        // both uses follow the edge's own direction by their pcurves' parameters, so shares are alike
        const SidePoint other = nearest_point(b, share, at.p);
        if (!at.regular || !other.regular)
            continue;
        measured = true;
        // each face lies on the left of its walk: normal x walk. One goes on where the other ends if, walked both
        // ways along the edge, their normals agree; `normal` is turned to the edge's direction, so they oppose.
        if (norm(cross(at.normal, other.normal)) > most || dot(at.normal, other.normal) > 0)
            return false;
        if (a.face->surface.kind == kKindPlane && b.face->surface.kind == kKindPlane)
            break;
    }
    return measured ? std::optional(true) : std::nullopt;
}

} // namespace

void classify_edges(CadPart& part)
{
    std::vector<std::vector<Side>> sides(part.edges.size());
    for (CadFace& face : part.faces)
        for (CadLoop& loop : face.loops)
            for (CadEdgeUse& use : loop) {
                use.edge_class = kEdgeSeam;
                if (!use.degenerate)
                    sides[use.edge].push_back({&face, &use});
            }
    tbb::parallel_for(size_t{0}, sides.size(), [&](size_t edge) {
        const std::vector<Side>& of_edge = sides[edge];
        uint32_t edge_class = kEdgeSharp;
        if (of_edge.size() == 1) {
            // one side of a seam whose other side the file leaves out
            edge_class = of_edge[0].use->seam ? kEdgeSeam : kEdgeFree;
        } else if (of_edge.size() == 2) {
            const bool seam = of_edge[0].face == of_edge[1].face && of_edge[0].use->seam;
            if (tangent_along(of_edge[0], of_edge[1]).value_or(part.edges[edge].smooth))
                edge_class = seam ? kEdgeSeam : kEdgeSmooth;
        }
        for (const Side& side : of_edge)
            side.use->edge_class = edge_class;
    });
}

} // namespace trimray
