#include "preprocess/trims/trim_chain.h"

#include "preprocess/bezier_patch.h"
#include "preprocess/trims/trim_corner.h"
#include "preprocess/vec2d.h"
#include "preprocess/vec3d.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace trimray {
namespace {

/// Mean length of the control net along u per unit of u (along v likewise): an upper bound of the mean speed.
Vec2d net_speed(const SplineSurface& s)
{
    const auto point = [&](int i, int j) {
        const auto& p = s.control_points[static_cast<size_t>(i) * s.count_v + j];
        return Vec3d{p[0] / p[3], p[1] / p[3], p[2] / p[3]};
    };
    const auto length = [](Vec3d a, Vec3d b) { return std::hypot(a.x - b.x, a.y - b.y, a.z - b.z); };
    double longest_u = 0, longest_v = 0;
    for (int j = 0; j < s.count_v; ++j) {
        double sum = 0;
        for (int i = 0; i + 1 < s.count_u; ++i)
            sum += length(point(i, j), point(i + 1, j));
        longest_u = std::max(longest_u, sum);
    }
    for (int i = 0; i < s.count_u; ++i) {
        double sum = 0;
        for (int j = 0; j + 1 < s.count_v; ++j)
            sum += length(point(i, j), point(i, j + 1));
        longest_v = std::max(longest_v, sum);
    }
    return {longest_u / (s.knots_u[s.count_u] - s.knots_u[s.degree_u]),
            longest_v / (s.knots_v[s.count_v] - s.knots_v[s.degree_v])};
}

/// |S_u|, |S_v| at v for the native kinds, whose metric depends on v alone; for splines the means of the net.
Vec2d speed_at(const CadSurface& surface, double v)
{
    switch (surface.kind) {
    case kKindCylinder:
        return {surface.radius, 1};
    case kKindCone:
        return {std::abs(surface.radius + v * std::sin(surface.half_angle)), 1};
    case kKindSphere:
        return {surface.radius * std::abs(std::cos(v)), surface.radius};
    case kKindTorus:
        return {std::abs(surface.radius + surface.minor_radius * std::cos(v)), surface.minor_radius};
    case kKindBezier:
        return net_speed(surface.spline);
    default:
        return {1, 1};
    }
}

/// One use of an edge, as the walk goes: from start to end, in uv_file without shifts.
struct Use {
    const CadEdgeUse* edge = nullptr;
    int index = kNoUse; // over the face's loops in order
    bool held = false;  // no neighbour but the face itself: a seam, a pole, a cut into the face
    bool backwards = false;
    Vec2d ends[2];
    Rect2d box; // of samples

    Vec2d start() const { return ends[backwards ? 1 : 0]; }
    Vec2d end() const { return ends[backwards ? 0 : 1]; }
};

/// Where ends meet: distances between parameters, whole periods apart or not.
class Joints {
public:
    Joints(const CadSurface& surface, Vec2d mm_per_uv) : surface_(surface), mm_per_uv_(mm_per_uv) {}

    /// Distance in mm between two parameters as they are. Native surfaces are measured where they are, so that the
    /// points of a pole are one.
    double distance(Vec2d a, Vec2d b) const
    {
        Vec2d mm = mm_per_uv_;
        if (surface_.kind != kKindBezier)
            mm = speed_at(surface_, 0.5 * (a.y + b.y));
        return std::hypot((a.x - b.x) * mm.x, (a.y - b.y) * mm.y);
    }

    /// Length in mm on the surface of a short line between two parameters, by its derivatives there.
    double length_on_surface(Vec2d a, Vec2d b) const
    {
        if (surface_.kind != kKindBezier)
            return distance(a, b);
        const Vec2d way = b - a;
        double longest = 0;
        for (const Vec2d at : {a, b}) {
            const SurfaceDerivatives s = evaluate(surface_, at.x, at.y);
            longest = std::max(longest, norm(way.x * s.du + way.y * s.dv));
        }
        return longest;
    }

    /// Whole periods that bring `b` nearest to `a`.
    Vec2d nearest_shift(Vec2d a, Vec2d b) const
    {
        const auto periods = [](double from, double to, double period) {
            return period > 0 ? period * std::round((from - to) / period) : 0.0;
        };
        return {periods(a.x, b.x, surface_.period_u), periods(a.y, b.y, surface_.period_v)};
    }

    /// The shift for `b` to follow `a`: the one in use if that is near enough, else the nearest.
    Vec2d shift(Vec2d a, Vec2d b, Vec2d current, double near_mm) const
    {
        const Vec2d nearest = nearest_shift(a, b);
        const double kept = distance(a, {b.x + current.x, b.y + current.y});
        return kept <= near_mm || kept <= distance(a, {b.x + nearest.x, b.y + nearest.y}) ? current : nearest;
    }

private:
    const CadSurface& surface_;
    Vec2d mm_per_uv_;
};

/// Uses put in order, each with the shift that makes the walk continuous.
struct PlacedUse {
    Use use;
    Vec2d shift;
};
using Walk = std::vector<PlacedUse>;

/// Where the walk has come to, and how a use would follow it there.
struct WalkEnd {
    const Joints& joints;
    const PlacedUse& last;
    double near_mm;

    Vec2d at() const { return {last.use.end().x + last.shift.x, last.use.end().y + last.shift.y}; }
    Vec2d shift(const Use& next) const { return joints.shift(at(), next.start(), last.shift, near_mm); }
    double gap(const Use& next) const
    {
        const Vec2d s = shift(next);
        return joints.distance(at(), {next.start().x + s.x, next.start().y + s.y});
    }
};

/// Whether a seam's second use, laid next, would run along the first the same way, or back over it though their pcurves
/// lie whole periods apart.
bool doubles_seam(const Walk& walk, const Use& next, Vec2d shift)
{
    return next.edge->seam && std::any_of(walk.begin(), walk.end(), [&](const PlacedUse& placed) {
               if (placed.use.edge->edge != next.edge->edge)
                   return false;
               const bool shifted = shift.x != placed.shift.x || shift.y != placed.shift.y;
               return placed.use.backwards == next.backwards || (&placed == &walk.back() && shifted);
           });
}

struct NextUse {
    size_t index = 0;
    bool turned = false;
    double gap = std::numeric_limits<double>::infinity();
};

/// What follows a walk: the first of the uses left where it meets the walk's end, else the nearest.
NextUse nearest_use(const Walk& walk, const std::vector<Use>& uses, const WalkEnd& end, bool seams_apart)
{
    NextUse best;
    const auto consider = [&](size_t i, bool turned, double less_than) {
        Use use = uses[i];
        use.backwards = use.backwards != turned;
        const double gap = end.gap(use);
        if (gap < less_than && !(seams_apart && doubles_seam(walk, use, end.shift(use))))
            best = {i, turned, gap};
    };
    consider(0, false, best.gap);
    if (best.gap > end.near_mm)
        for (size_t i = 0; i < uses.size(); ++i)
            for (const bool turned : {false, true})
                // the order and direction of the file stand unless another end is clearly nearer
                consider(i, turned, 0.5 * best.gap);
    return best;
}

/// Orders the uses of one loop. A loop whose ends meet before all uses are walked is closed, and another begins.
std::vector<Walk> walk_loop(std::vector<Use> uses, const Joints& joints, double near_mm)
{
    std::vector<Walk> walks;
    while (!uses.empty()) {
        Walk walk{{uses.front(), {0, 0}}};
        uses.erase(uses.begin());
        while (!uses.empty()) {
            const WalkEnd end{joints, walk.back(), near_mm};
            NextUse best = nearest_use(walk, uses, end, true);
            if (best.gap > near_mm) {
                if (end.gap(walk.front().use) <= near_mm)
                    break;
                best = nearest_use(walk, uses, end, false); // a cut into the face along its seam
            }
            Use next = uses[best.index];
            uses.erase(uses.begin() + static_cast<std::ptrdiff_t>(best.index));
            next.backwards = next.backwards != best.turned;
            walk.push_back({next, end.shift(next)});
        }
        walks.push_back(std::move(walk));
    }
    return walks;
}

// Neighbouring pcurves that miss each other by up to this many tolerances are moved together by half the gap each: as
// far as the file contradicts itself, and no farther. What they move counts as deviation.
constexpr double kJoinTolerances = 10;
// The constant metric's lengths may be this many times those on the surface where ends are near each other.
constexpr double kLargestStretch = 8;

/// Joins the end of `before` with the start of `after`, which is `offset` (whole periods) away in uv. What the gap
/// needs between them is put into `between`.
void join(CurvePiece& before, CurvePiece& after, Vec2d offset, const CadFace& face, const Joints& joints,
          const TrimMetric& metric, ChainReport& report, std::vector<CurvePiece>& between)
{
    const Vec2d a = before.p[3], b = after.p[0] + offset, gap = b - a;
    if (a.x == b.x && a.y == b.y)
        return;
    const double flat_mm = length({gap.x * metric.mm_per_uv.x, gap.y * metric.mm_per_uv.y});
    const double gap_mm = joints.length_on_surface(a, b);
    report.largest_gap_mm = std::max(report.largest_gap_mm, gap_mm);
    if (flat_mm <= kJoinTolerances * metric.tolerance_mm) {
        report.largest_move_mm = std::max(report.largest_move_mm, 0.5 * flat_mm);
        move_end(before, a + 0.5 * gap, metric.mm_per_uv);
        move_start(after, before.p[3] - offset, metric.mm_per_uv);
        return;
    }
    // either end may be off by the tolerance from where they should meet
    const double tolerated_mm = 2 * face.tolerance_mm;
    const bool open = gap_mm > std::max(tolerated_mm, kJoinTolerances * metric.tolerance_mm);
    if (open) {
        report.had_open_loop = true;
        report.findings.push_back({TrimFindingKind::OpenLoop, a, gap_mm, report.loop, report.loop});
    }
    // a pole's side is short on the surface, but no corner
    const bool corner = !open && flat_mm <= kLargestStretch * tolerated_mm;
    if (corner && meet_at_corner(before, after, offset, metric.mm_per_uv, between))
        return;
    CurvePiece line = line_piece(a, b);
    line.grow_mm = std::max({before.grow_mm, after.grow_mm, 0.0}); // the corner is its neighbours'
    between.push_back(line);
}

void grow(Rect2d& r, Vec2d p)
{
    r.lo = {std::min(r.lo.x, p.x), std::min(r.lo.y, p.y)};
    r.hi = {std::max(r.hi.x, p.x), std::max(r.hi.y, p.y)};
}

constexpr Rect2d kEmptyRect{{1e300, 1e300}, {-1e300, -1e300}};

/// Rectangle of samples of an edge: what the tolerance is relative to.
Rect2d sampled_box(const CadEdgeUse& e, const Vec2d ends[2])
{
    constexpr int kSamples = 32; // a quarter of an arc is seen to 1e-3 of its height
    Rect2d r = kEmptyRect;
    grow(r, ends[0]);
    grow(r, ends[1]);
    for (int i = 1; i < kSamples && !is_straight(e.pcurve); ++i)
        grow(r, curve_point(e.pcurve, e.first + (e.last - e.first) * i / kSamples));
    return r;
}

bool usable(const CadEdgeUse& use, std::string& failure)
{
    const SplineCurve2d& c = use.pcurve;
    const size_t n = c.control_points.size();
    if (c.degree < 1 || c.degree > static_cast<int>(kMaxDegree) || n < static_cast<size_t>(c.degree) + 1 ||
        c.knots.size() != n + c.degree + 1) {
        failure = "a pcurve's knots and control points do not fit its degree";
        return false;
    }
    if (!(std::isfinite(use.first) && std::isfinite(use.last)) || !std::is_sorted(c.knots.begin(), c.knots.end()) ||
        !(c.knots[c.degree] < c.knots[n])) {
        failure = "a pcurve's knots or range are not finite and increasing";
        return false;
    }
    for (const auto& p : c.control_points)
        if (!(std::isfinite(p[0]) && std::isfinite(p[1]) && p[2] > 0 && std::isfinite(p[2]))) {
            failure = "a pcurve's control point is not finite or its weight not positive";
            return false;
        }
    return true;
}

} // namespace

Rect2d chain_bounds(const std::vector<CurvePiece>& pieces)
{
    Rect2d r = kEmptyRect;
    for (const CurvePiece& piece : pieces) {
        grow(r, piece.p[0]);
        grow(r, piece.p[3]);
    }
    return r;
}

double signed_area(const std::vector<CurvePiece>& pieces)
{
    if (pieces.empty())
        return 0;
    // relative to a point of the chain, so that distant loops keep their digits
    const Vec2d o = pieces.front().p[0];
    double twice = 0;
    const auto cross = [&](Vec2d a, Vec2d b) { return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x); };
    for (const CurvePiece& piece : pieces) {
        const Vec2d* p = piece.p;
        if (piece.cubic) // 2 A = (6 c01 + 3 c02 + c03 + 3 c12 + 3 c13 + 6 c23) / 10, c_ij = p_i x p_j
            twice += (6 * cross(p[0], p[1]) + 3 * cross(p[0], p[2]) + cross(p[0], p[3]) + 3 * cross(p[1], p[2]) +
                      3 * cross(p[1], p[3]) + 6 * cross(p[2], p[3])) /
                     10;
        else
            twice += cross(p[0], p[3]);
    }
    return 0.5 * twice;
}

TrimMetric trim_metric(const CadSurface& surface, const Rect2d& domain, double relative_tolerance)
{
    TrimMetric metric;
    Vec2d mm = speed_at(surface, 0.5 * (domain.lo.y + domain.hi.y));
    if (surface.kind == kKindCone || surface.kind == kKindTorus || surface.kind == kKindSphere)
        mm.x = std::max(speed_at(surface, domain.lo.y).x, speed_at(surface, domain.hi.y).x);
    if (surface.kind == kKindTorus || surface.kind == kKindSphere) {
        // the widest circles of a sphere, a torus and a spindle torus' inner sheet lie at multiples of pi
        const double pi = 3.14159265358979323846;
        for (double k = std::ceil(domain.lo.y / pi); k * pi <= domain.hi.y && k * pi <= domain.lo.y + 2 * pi; ++k)
            mm.x = std::max(mm.x, speed_at(surface, k * pi).x);
    }
    // a surface that collapses in a direction still needs a scale for it
    const double larger = std::max({mm.x, mm.y, 1e-300});
    metric.mm_per_uv = {std::max(mm.x, 1e-9 * larger), std::max(mm.y, 1e-9 * larger)};
    metric.longer_side_mm =
        std::max((domain.hi.x - domain.lo.x) * metric.mm_per_uv.x, (domain.hi.y - domain.lo.y) * metric.mm_per_uv.y);
    metric.tolerance_mm = relative_tolerance * metric.longer_side_mm;
    return metric;
}

std::vector<TrimChain> build_chains(const CadFace& face, double relative_tolerance, TrimMetric& metric,
                                    ChainReport& report)
{
    std::vector<std::vector<Use>> loops;
    Rect2d rough = kEmptyRect;
    int index = -1; // of the use at hand
    std::map<uint32_t, int> uses_of_edge;
    for (const CadLoop& loop : face.loops)
        for (const CadEdgeUse& edge : loop)
            ++uses_of_edge[edge.edge];
    for (const CadLoop& loop : face.loops) {
        loops.emplace_back();
        for (const CadEdgeUse& edge : loop) {
            ++index;
            if (!usable(edge, report.failure))
                return {};
            if (!(edge.first < edge.last))
                continue; // an edge without length
            Use use{&edge,
                    index,
                    edge.seam || edge.degenerate || uses_of_edge[edge.edge] > 1,
                    edge.reversed,
                    {curve_point(edge.pcurve, edge.first), curve_point(edge.pcurve, edge.last)},
                    kEmptyRect};
            use.box = sampled_box(edge, use.ends);
            grow(rough, use.box.lo);
            grow(rough, use.box.hi);
            loops.back().push_back(use);
        }
    }
    const TrimMetric rough_metric = trim_metric(face.surface, rough, relative_tolerance);
    const Joints joints(face.surface, rough_metric.mm_per_uv);
    // ends this near belong together: the file's tolerance, or what its curves may be off by when it states none
    const double near_mm = std::max(2 * face.tolerance_mm, 1e-4 * rough_metric.longer_side_mm);
    std::vector<Walk> walks;
    for (std::vector<Use>& uses : loops)
        for (Walk& walk : walk_loop(std::move(uses), joints, near_mm))
            walks.push_back(std::move(walk));

    // Unrolled, a loop may cover less than its raw pcurves or more: the tolerance follows the largest loop.
    Rect2d largest = kEmptyRect;
    double largest_size = -1;
    for (const Walk& walk : walks) {
        Rect2d r = kEmptyRect;
        for (const auto& [use, shift] : walk) {
            grow(r, {use.box.lo.x + shift.x, use.box.lo.y + shift.y});
            grow(r, {use.box.hi.x + shift.x, use.box.hi.y + shift.y});
        }
        const double size =
            std::max((r.hi.x - r.lo.x) * rough_metric.mm_per_uv.x, (r.hi.y - r.lo.y) * rough_metric.mm_per_uv.y);
        if (size > largest_size) {
            largest_size = size;
            largest = r;
        }
    }
    metric = trim_metric(face.surface, largest, relative_tolerance);
    if (!(metric.longer_side_mm > 0 && std::isfinite(metric.longer_side_mm))) {
        report.failure = "the loops have no extent";
        return {};
    }

    std::vector<TrimChain> chains;
    for (const Walk& walk : walks) {
        TrimChain chain;
        chain.loop = report.loop = static_cast<int>(chains.size());
        for (const PlacedUse& placed : walk) {
            const CadEdgeUse& e = *placed.use.edge;
            CurveFit fit = fit_curve(e.pcurve, e.first, e.last, metric.mm_per_uv, metric.tolerance_mm);
            if (!fit.finite) {
                report.failure = "a pcurve has points that are not finite";
                return {};
            }
            report.largest_deviation_mm = std::max(report.largest_deviation_mm, fit.deviation);
            if (placed.use.backwards)
                reverse_pieces(fit.pieces);
            for (CurvePiece& piece : fit.pieces) {
                piece.use = placed.use.index;
                piece.grow_mm = placed.use.held ? kHeld : e.gap_mm + fit.deviation;
                for (Vec2d& p : piece.p)
                    p = {p.x + placed.shift.x, p.y + placed.shift.y};
            }
            std::vector<CurvePiece> between;
            if (!chain.pieces.empty())
                join(chain.pieces.back(), fit.pieces.front(), {0, 0}, face, joints, metric, report, between);
            chain.pieces.insert(chain.pieces.end(), between.begin(), between.end());
            chain.pieces.insert(chain.pieces.end(), fit.pieces.begin(), fit.pieces.end());
        }
        const Vec2d end = chain.pieces.back().p[3], start = chain.pieces.front().p[0];
        const Vec2d offset = joints.shift(end, start, {0, 0}, near_mm);
        if (offset.x != 0)
            chain.winding_u = static_cast<int>(std::lround(offset.x / face.surface.period_u));
        if (offset.y != 0)
            chain.winding_v = static_cast<int>(std::lround(offset.y / face.surface.period_v));
        std::vector<CurvePiece> between;
        join(chain.pieces.back(), chain.pieces.front(), offset, face, joints, metric, report, between);
        chain.pieces.insert(chain.pieces.end(), between.begin(), between.end());
        chains.push_back(std::move(chain));
    }
    return chains;
}

} // namespace trimray
