#include "preprocess/trims/edge_class.h"

#include "preprocess/bezier_patch.h"
#include "preprocess/trims/border_gap.h"
#include "preprocess/trims/trim_curve.h"
#include "preprocess/vec3d.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
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

constexpr double kNear = 1e-4; // of an edge's range: a circle's normal turns by 0.04 degrees there

/// The point of `side` that is nearest to `p`, from a share of its range on: pcurves of one edge may run unalike. Stops
/// within `share_off` of the range.
SidePoint nearest_point(const Side& side, double share, Vec3d p, double share_off = kNear)
{
    double t = parameter_at(*side.use, share);
    SidePoint point = point_of(side, t);
    for (int i = 0; i < 4; ++i) {
        const double speed2 = dot(point.tangent, point.tangent);
        const double step = speed2 > 0 ? dot(p - point.p, point.tangent) / speed2 : 0;
        if (!(std::abs(step) > share_off * (side.use->last - side.use->first)))
            break;
        t = std::clamp(t + step, side.use->first, side.use->last);
        point = point_of(side, t);
    }
    return point;
}

/// Whether both sides of an edge have one tangent plane along it; nothing where no sample tells. `opposed`: their
/// pcurves follow it in opposite directions.
std::optional<bool> tangent_along(const Side& a, const Side& b, bool opposed = false)
{
    // an edge's middle tells most edges apart; its very ends may be poles
    constexpr double kShares[] = {0.5, 0.01, 0.99, 0.25, 0.75, 0.125, 0.375, 0.625, 0.875};
    const double most = std::sin(kSmoothAngle_deg * std::numbers::pi / 180);
    bool measured = false;
    for (const double share : kShares) {
        const SidePoint at = point_of(a, parameter_at(*a.use, share));
        // both uses follow the edge's own direction by their pcurves' parameters, so shares are alike
        SidePoint other = nearest_point(b, opposed ? 1 - share : share, at.p);
        if (opposed)
            other.normal = -1 * other.normal;
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

/// An edge that one face uses, in space.
struct FreeEdge {
    Side side;
    double reach_mm = 0; // what lies within is the same
    Vec3d start, end;

    Vec3d middle() const { return 0.5 * (start + end); }
};

/// Whether two edges lie on one another, and if so whether in opposite directions.
std::optional<bool> opposed_if_alike(const FreeEdge& a, const FreeEdge& b)
{
    constexpr double kNearPoint = 1e-7; // of an edge's range: far less than a reach
    const double reach_mm = std::max(a.reach_mm, b.reach_mm);
    const auto near = [&](Vec3d p, Vec3d q) { return norm(p - q) <= reach_mm; };
    for (const bool opposed : {false, true}) {
        if (!near(a.start, opposed ? b.end : b.start) || !near(a.end, opposed ? b.start : b.end))
            continue;
        bool alike = true, extended = false;
        for (const double share : {0.5, 0.25, 0.75}) {
            const Vec3d p = point_of(a.side, parameter_at(*a.side.use, share)).p;
            alike = alike && near(p, nearest_point(b.side, opposed ? 1 - share : share, p, kNearPoint).p);
            extended = extended || !near(p, a.start);
        }
        if (alike && extended)
            return opposed;
    }
    return std::nullopt;
}

/// Edges by where the middle of their ends lies. Those that are nowhere (not finite) are alike to none.
class FreeEdgeGrid {
public:
    explicit FreeEdgeGrid(const std::vector<FreeEdge>& edges) : edges_(edges)
    {
        for (const FreeEdge& edge : edges)
            reach_mm_ = std::max(reach_mm_, edge.reach_mm);
        for (size_t i = 0; i < edges.size(); ++i)
            if (std::isfinite(norm(edges[i].middle())))
                cells_[cell_of(edges[i].middle(), {0, 0, 0})].push_back(i);
    }

    /// The others that lie on edge i, each with whether it runs the other way.
    std::vector<std::pair<size_t, bool>> alike(size_t i) const
    {
        std::vector<std::pair<size_t, bool>> found;
        if (!std::isfinite(norm(edges_[i].middle())))
            return found;
        const std::array<int64_t, 3> lo = cell_of(edges_[i].middle(), {-1, -1, -1}),
                                     hi = cell_of(edges_[i].middle(), {1, 1, 1});
        for (int64_t x = lo[0]; x <= hi[0]; ++x)
            for (int64_t y = lo[1]; y <= hi[1]; ++y)
                for (int64_t z = lo[2]; z <= hi[2]; ++z) {
                    const auto cell = cells_.find({x, y, z});
                    if (cell == cells_.end())
                        continue;
                    for (const size_t j : cell->second)
                        if (j != i) // asked the same way round for both, so that both get the same answer
                            if (const auto opposed = opposed_if_alike(edges_[std::min(i, j)], edges_[std::max(i, j)]))
                                found.emplace_back(j, *opposed);
                }
        return found;
    }

private:
    /// The cell that a point lies in, moved by so many reaches.
    std::array<int64_t, 3> cell_of(Vec3d p, Vec3d reaches) const
    {
        const double side_mm = 4 * reach_mm_;
        const auto index = [&](double x) { return static_cast<int64_t>(std::floor(std::clamp(x, -1e15, 1e15))); };
        const Vec3d at = (1 / side_mm) * (p + reach_mm_ * reaches);
        return {index(at.x), index(at.y), index(at.z)};
    }

    const std::vector<FreeEdge>& edges_;
    double reach_mm_ = 1e-9;
    std::map<std::array<int64_t, 3>, std::vector<size_t>> cells_;
};

/// Classes of edges that one face uses each, and that lie on one another.
void classify_alike(const std::vector<FreeEdge>& edges)
{
    const FreeEdgeGrid grid(edges);
    tbb::parallel_for(size_t{0}, edges.size(), [&](size_t i) {
        const auto others = grid.alike(i);
        if (others.empty())
            return;
        uint32_t edge_class = kEdgeSharp;
        if (others.size() == 1) {
            const auto [j, opposed] = others.front();
            const Side &a = edges[std::min(i, j)].side, &b = edges[std::max(i, j)].side;
            const CadSurface& surface = a.face->surface;
            const bool seam = a.face == b.face && (surface.period_u > 0 || surface.period_v > 0);
            if (tangent_along(a, b, opposed).value_or(false))
                edge_class = seam ? kEdgeSeam : kEdgeSmooth;
        }
        edges[i].side.use->edge_class = edge_class;
    });
}

} // namespace

void classify_edges(CadPart& part, double size_mm)
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
    std::vector<FreeEdge> free;
    for (size_t edge = 0; edge < sides.size(); ++edge)
        if (sides[edge].size() == 1 && sides[edge][0].use->edge_class == kEdgeFree) {
            const Side& side = sides[edge][0];
            free.push_back({side, std::max(part.edges[edge].tolerance_mm, kUnstatedGap * size_mm),
                            point_of(side, side.use->first).p, point_of(side, side.use->last).p});
        }
    classify_alike(free);
}

} // namespace trimray
