#include "preprocess/trims/trim_loop.h"

#include "format/trim_piece.h"
#include "preprocess/trims/trim_grow.h"
#include "preprocess/trims/trim_window.h"
#include "preprocess/vec2d.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trimray {
namespace {

using Pieces = std::vector<CurvePiece>;

Error invalid(const CadFace& face, std::string reason)
{
    return {ErrorCode::InvalidTrim, fmt::format("face {}", face.face_in_part), std::move(reason)};
}

bool bounded(const Rect2d& r)
{
    for (const double x : {r.lo.x, r.lo.y, r.hi.x, r.hi.y})
        if (!(std::abs(x) < 1e99))
            return false;
    return r.lo.x < r.hi.x && r.lo.y < r.hi.y;
}

/// Loops in uv_face, in double; points within `snap` of the domain's border lie on it.
void map_to_face(Pieces& pieces, const Rect2d& domain, Vec2d snap)
{
    const auto map = [](double x, double lo, double hi, double near) {
        const double f = std::clamp((x - lo) / (hi - lo), 0.0, 1.0);
        return f <= near ? 0.0 : f >= 1 - near ? 1.0 : f;
    };
    for (CurvePiece& piece : pieces) {
        for (Vec2d& p : piece.p)
            p = {map(p.x, domain.lo.x, domain.hi.x, 0), map(p.y, domain.lo.y, domain.hi.y, 0)};
        for (Vec2d* p : {&piece.p[0], &piece.p[3]})
            *p = {map(p->x, 0, 1, snap.x), map(p->y, 0, 1, snap.y)};
        order_points(piece);
    }
}

/// Edge classes of a face's edge uses, in the order that CurvePiece::use counts in.
class UseClasses {
public:
    explicit UseClasses(const CadFace& face)
    {
        for (const CadLoop& loop : face.loops)
            for (const CadEdgeUse& use : loop)
                classes_.push_back(use.edge_class);
    }
    uint32_t operator()(const CurvePiece& piece) const
    {
        return piece.use == kNoUse ? kEdgeSeam : classes_[static_cast<size_t>(piece.use)];
    }

private:
    std::vector<uint32_t> classes_;
};

/// A closed loop of lines of one edge class that follow each other straight becomes one of longer lines: a corner is
/// left out where it lies within `tolerance` (metric) of the line that replaces its two, and so is the tip of a line
/// that turns back on itself. Returns the largest distance.
double merge_lines(Pieces& pieces, const UseClasses& class_of, Vec2d metric, double tolerance)
{
    const auto distance = [&](Vec2d p, Vec2d a, Vec2d b) {
        const double x = (b.x - a.x) * metric.x, y = (b.y - a.y) * metric.y;
        const double px = (p.x - a.x) * metric.x, py = (p.y - a.y) * metric.y;
        const double l2 = x * x + y * y;
        const double t = l2 > 0 ? std::clamp((px * x + py * y) / l2, 0.0, 1.0) : 0;
        return std::hypot(px - t * x, py - t * y);
    };
    double worst = 0;
    Pieces out;
    std::vector<Vec2d> corners; // left out of out.back()
    for (const CurvePiece& piece : pieces) {
        if (!piece.cubic && piece.p[0].x == piece.p[3].x && piece.p[0].y == piece.p[3].y)
            continue;
        if (!out.empty() && !piece.cubic && !out.back().cubic && class_of(piece) == class_of(out.back())) {
            const Vec2d a = out.back().p[0], middle = piece.p[0], b = piece.p[3];
            const Vec2d before{(middle.x - a.x) * metric.x, (middle.y - a.y) * metric.y};
            const Vec2d after{(b.x - middle.x) * metric.x, (b.y - middle.y) * metric.y};
            const bool ahead = dot(before, after) >= 0;
            const bool held = piece.grow_mm == kHeld, alike = held == (out.back().grow_mm == kHeld);
            // a line that turns back encloses nothing; one that is held may be a cut into the face, and is kept
            const bool fold = !ahead && !held && corners.empty();
            double off = fold ? std::abs(cross(before, after)) / length(before) : distance(middle, a, b);
            for (const Vec2d& corner : corners)
                off = std::max(off, distance(corner, a, b));
            if ((ahead || fold) && off <= tolerance && alike) {
                worst = std::max(worst, off);
                if (!held)
                    out.back().grow_mm = std::max(out.back().grow_mm, piece.grow_mm) + off;
                out.back().p[3] = b;
                if (fold && a.x == b.x && a.y == b.y)
                    out.pop_back();
                if (!fold)
                    corners.push_back(middle);
                continue;
            }
        }
        corners.clear();
        out.push_back(piece);
    }
    pieces = std::move(out);
    return worst;
}

/// Rounds a loop and appends it; pieces that vanish are left out. The points are one chain, so ends are shared, and its
/// last point is its first, bit for bit. False: nothing was left.
bool append_loop(const Pieces& pieces, const UseClasses& class_of, TrimLoops& loops)
{
    // Multiples of 2^-22, off by 1.2e-7 of the face at most (single precision is off by half as much near 1): they
    // leave no noise in the low bits. One rounding for all points keeps shared ends shared and monotone pieces
    // monotone.
    constexpr double kPerUnit = 1 << 22;
    const auto round = [](Vec2d p) {
        return Vec2d{std::nearbyint(p.x * kPerUnit) / kPerUnit + 0.0, std::nearbyint(p.y * kPerUnit) / kPerUnit + 0.0};
    };
    const auto same = [](Vec2d a, Vec2d b) { return a.x == b.x && a.y == b.y; };
    const uint32_t base = static_cast<uint32_t>(loops.points.size() / 2);
    if (pieces.empty())
        return false;
    const Vec2d first = round(pieces.front().p[0]);
    std::vector<CurvePiece> kept;
    Vec2d at = first;
    for (const CurvePiece& piece : pieces) {
        CurvePiece rounded = piece;
        for (Vec2d& p : rounded.p)
            p = round(p);
        rounded.p[0] = at;
        at = rounded.p[3];
        if (!same(rounded.p[0], rounded.p[3]))
            kept.push_back(rounded);
    }
    if (kept.size() < 2)
        return false;
    kept.back().p[3] = first;
    loops.points.insert(loops.points.end(), {static_cast<float>(first.x), static_cast<float>(first.y)});
    uint32_t count = 1;
    for (CurvePiece& piece : kept) {
        order_points(piece);
        loops.pieces.push_back((base + count - 1) << kPiecePointShift | class_of(piece) << kPieceClassShift |
                               (piece.cubic ? kPieceCubic : 0));
        for (int i = piece.cubic ? 1 : 3; i < 4; ++i, ++count)
            loops.points.insert(loops.points.end(),
                                {static_cast<float>(piece.p[i].x), static_cast<float>(piece.p[i].y)});
    }
    loops.loop_count += 1;
    return true;
}

/// Length of u inside the loops on the line of constant v, by the even-odd rule.
double inside_length(const std::vector<MonotonePiece>& pieces, double v)
{
    std::vector<double> crossings;
    for (const MonotonePiece& piece : pieces)
        if (piece.v_lo() <= v && v < piece.v_hi())
            crossings.push_back(u_at_v(piece, v));
    std::sort(crossings.begin(), crossings.end());
    double sum = 0;
    for (size_t i = 0; i + 1 < crossings.size(); i += 2)
        sum += crossings[i + 1] - crossings[i];
    return sum;
}

bool encloses_area(const std::vector<MonotonePiece>& pieces)
{
    // thin horizontal features lie between lines: look just below and above every end of a piece as well
    for (const MonotonePiece& piece : pieces) {
        const double middle = 0.5 * (piece.v[0] + piece.v[3]);
        if (inside_length(pieces, middle) > 0)
            return true;
    }
    return false;
}

/// Whether the domain's rectangle itself is what the loops enclose: all pieces lie on its border, the inside within.
bool is_natural(const std::vector<MonotonePiece>& pieces)
{
    for (const MonotonePiece& p : pieces) {
        const bool on_u = p.u[0] == p.u[3] && (p.u[0] == 0 || p.u[0] == 1);
        const bool on_v = p.v[0] == p.v[3] && (p.v[0] == 0 || p.v[0] == 1);
        if (!on_u && !on_v)
            return false;
    }
    return inside_length(pieces, 0.5) == 1;
}

/// The class of each side of a natural border: of the edges along it the one with the greatest length in uv; where
/// edges take up less than half of the side, it is no edge.
uint32_t border_classes(const std::vector<uint32_t>& words, const std::vector<MonotonePiece>& pieces)
{
    double length[4][kEdgeClassCount] = {}; // sides u = 0, u = 1, v = 0, v = 1
    for (size_t i = 0; i < pieces.size(); ++i) {
        const MonotonePiece& p = pieces[i];
        const bool on_u = p.u[0] == p.u[3] && (p.u[0] == 0 || p.u[0] == 1);
        const int side = on_u ? (p.u[0] == 0 ? 0 : 1) : (p.v[0] == 0 ? 2 : 3);
        const uint32_t edge_class = words[i] >> kPieceClassShift & (kEdgeClassCount - 1);
        length[side][edge_class] += on_u ? p.v_hi() - p.v_lo() : p.u_hi() - p.u_lo();
    }
    uint32_t classes = 0;
    for (int side = 0; side < 4; ++side) {
        uint32_t longest = kEdgeSeam;
        double edges = 0, most = 0;
        for (const uint32_t edge_class : {kEdgeSharp, kEdgeFree, kEdgeSmooth}) {
            edges += length[side][edge_class];
            if (length[side][edge_class] > most) {
                most = length[side][edge_class];
                longest = edge_class;
            }
        }
        classes |= (edges >= 0.5 ? longest : kEdgeSeam) << (2 * side);
    }
    return classes;
}

/// The same where a face has no edges: its surface closes on itself, ends in poles, or just ends.
uint32_t natural_bounds_classes(const CadSurface& surface)
{
    const uint32_t u = surface.period_u > 0 ? kEdgeSeam : kEdgeFree;
    const uint32_t v = surface.period_v > 0 || surface.kind == kKindSphere ? kEdgeSeam : kEdgeFree;
    return u | u << 2 | v << 4 | v << 6;
}

} // namespace

Result<TrimLoops> build_trim_loops(const CadFace& face, const TrimOptions& options)
{
    TrimLoops loops;
    const bool has_edges =
        std::any_of(face.loops.begin(), face.loops.end(), [](const CadLoop& loop) { return !loop.empty(); });
    if (!has_edges) {
        if (!bounded(face.surface.natural_bounds))
            return invalid(face, "no loops, and the surface has no natural bounds");
        loops.domain = face.surface.natural_bounds;
        loops.natural_border = true;
        loops.border_classes = natural_bounds_classes(face.surface);
        return loops;
    }

    TrimMetric metric;
    ChainReport report;
    std::vector<TrimChain> chains = build_chains(face, options.tolerance, metric, report);
    if (!report.failure.empty())
        return invalid(face, report.failure);
    close_and_wrap(chains, face.surface, metric, loops.domain, report);
    if (!report.failure.empty())
        return invalid(face, report.failure);
    const Vec2d size{loops.domain.hi.x - loops.domain.lo.x, loops.domain.hi.y - loops.domain.lo.y};
    // narrower than rounding of its own coordinates: no area
    const double ulp = 1e-14 * std::max({std::abs(loops.domain.lo.x), std::abs(loops.domain.hi.x),
                                         std::abs(loops.domain.lo.y), std::abs(loops.domain.hi.y)});
    if (!(size.x > ulp && size.y > ulp))
        return invalid(face, fmt::format("the loops enclose no area: {} by {} in uv", size.x, size.y));

    // tolerance in uv_face, but never more than a small part of a narrow domain
    const Vec2d mm_per_face{metric.mm_per_uv.x * size.x, metric.mm_per_uv.y * size.y};
    const Vec2d snap{std::min(metric.tolerance_mm / mm_per_face.x, 1e-4),
                     std::min(metric.tolerance_mm / mm_per_face.y, 1e-4)};
    const UseClasses class_of(face);
    double merged_mm = 0;
    for (TrimChain& chain : chains) {
        map_to_face(chain.pieces, loops.domain, snap);
        merged_mm = std::max(merged_mm, merge_lines(chain.pieces, class_of, mm_per_face, 0.1 * metric.tolerance_mm));
    }
    std::vector<CheckedLoop> checked;
    for (const TrimChain& chain : chains)
        checked.push_back({&chain.pieces, chain.loop});
    loops.findings = std::move(report.findings);
    check_loops(checked, face, loops.domain, loops.findings);
    if (options.grow) {
        GrowReport grown;
        loops.domain = grow_loops(chains, face.surface, loops.domain, grown);
        loops.largest_growth_mm = grown.largest_mm;
        loops.findings.insert(loops.findings.end(), grown.not_grown.begin(), grown.not_grown.end());
    }
    for (const TrimChain& chain : chains)
        append_loop(chain.pieces, class_of, loops);
    std::vector<MonotonePiece> pieces;
    for (const uint32_t word : loops.pieces)
        pieces.push_back(load_piece(loops.points.data(), 0, word));
    if (!encloses_area(pieces))
        return invalid(face, "the loops enclose no area");

    loops.had_open_loop = report.had_open_loop;
    loops.largest_gap = report.largest_gap_mm / metric.longer_side_mm;
    loops.largest_deviation =
        (report.largest_deviation_mm + report.largest_move_mm + merged_mm) / metric.longer_side_mm;
    if (is_natural(pieces)) {
        loops.natural_border = true;
        loops.border_classes = border_classes(loops.pieces, pieces);
        loops.points.clear();
        loops.pieces.clear();
        loops.loop_count = 0;
    }
    return loops;
}

} // namespace trimray
