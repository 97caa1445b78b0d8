#include "preprocess/trims/trim_window.h"

#include "format/trim_piece.h"

#include <algorithm>
#include <cmath>

namespace trimray {
namespace {

using Pieces = std::vector<CurvePiece>;

// A span of a period and this share more or less is the whole period: pcurves of seams are off by rounding.
constexpr double kWholePeriod = 1e-7;

/// A direction of uv, so that u and v are treated by the same words: `along` is the periodic one.
struct Axis {
    bool v = false;

    double along(const Vec2d& p) const { return v ? p.y : p.x; }
    double across(const Vec2d& p) const { return v ? p.x : p.y; }
    double& along(Vec2d& p) const { return v ? p.y : p.x; }
    Vec2d point(double along, double across) const { return v ? Vec2d{across, along} : Vec2d{along, across}; }
    double period(const CadSurface& s) const { return v ? s.period_v : s.period_u; }
    double cross_period(const CadSurface& s) const { return v ? s.period_u : s.period_v; }
    int& winding(TrimChain& c) const { return v ? c.winding_v : c.winding_u; }
    double scale(const TrimMetric& m) const { return v ? m.mm_per_uv.y : m.mm_per_uv.x; }
};

void shift_pieces(Pieces& pieces, Vec2d by)
{
    for (CurvePiece& piece : pieces)
        for (Vec2d& p : piece.p)
            p = {p.x + by.x, p.y + by.y};
}

/// Cuts where a piece passes x strictly inside; both halves end at x exactly.
void cut_at(Pieces& pieces, Axis axis, double x)
{
    Pieces out;
    for (const CurvePiece& piece : pieces) {
        const double a = axis.along(piece.p[0]), b = axis.along(piece.p[3]);
        if (!(std::min(a, b) < x && x < std::max(a, b))) {
            out.push_back(piece);
            continue;
        }
        CurvePiece before, after;
        split_piece(piece, std::clamp(parameter_at(piece, axis.v, x), 0.0, 1.0), before, after);
        axis.along(before.p[3]) = x;
        axis.along(after.p[0]) = x;
        order_points(before);
        order_points(after);
        out.push_back(before);
        out.push_back(after);
    }
    pieces = std::move(out);
}

/// Presses what lies beyond [lo, hi] against the border, where it runs along no edge; what lay there stays its edge's.
void press_into(Pieces& pieces, Axis axis, double lo, double hi)
{
    const auto on_border = [&](double x) {
        return std::min(std::abs(x - lo), std::abs(x - hi)) <= kWholePeriod * (hi - lo);
    };
    cut_at(pieces, axis, lo);
    cut_at(pieces, axis, hi);
    for (CurvePiece& piece : pieces) {
        const bool outside = std::max(axis.along(piece.p[0]), axis.along(piece.p[3])) <= lo ||
                             std::min(axis.along(piece.p[0]), axis.along(piece.p[3])) >= hi;
        if (!outside)
            continue;
        const bool lay_there = on_border(axis.along(piece.p[0])) && on_border(axis.along(piece.p[3]));
        const int use = lay_there ? piece.use : kNoUse;
        const double grow_mm = lay_there ? piece.grow_mm : kHeld;
        axis.along(piece.p[0]) = std::clamp(axis.along(piece.p[0]), lo, hi);
        axis.along(piece.p[3]) = std::clamp(axis.along(piece.p[3]), lo, hi);
        piece = line_piece(piece.p[0], piece.p[3]);
        piece.use = use;
        piece.grow_mm = grow_mm;
    }
}

/// Rotates a chain that goes around once so that it starts at `start` (mod the period) and advances one period.
void start_at(Pieces& pieces, Axis axis, double start, double period, int winding)
{
    // the chain goes from x0 to x0 + winding period; find start + k period in that span
    const double x0 = axis.along(pieces.front().p[0]);
    double x = start + period * std::ceil((std::min(x0, x0 + winding * period) - start) / period);
    cut_at(pieces, axis, x);
    const auto at = std::find_if(pieces.begin(), pieces.end(),
                                 [&](const CurvePiece& piece) { return axis.along(piece.p[0]) == x; });
    if (at == pieces.end())
        return; // it starts there but for rounding
    Pieces head(pieces.begin(), at), tail(at, pieces.end());
    shift_pieces(head, axis.point(winding * period, 0));
    if (!head.empty() && !tail.empty())
        head.front().p[0] = tail.back().p[3];
    tail.insert(tail.end(), head.begin(), head.end());
    shift_pieces(tail, axis.point((winding > 0 ? start : start + period) - x, 0));
    pieces = std::move(tail);
}

/// Where a closed surface ends across the axis on one side: a pole, an apex, or its natural border.
double far_border(const CadSurface& surface, Axis axis, bool upper)
{
    const auto finite = [](double x) { return std::isfinite(x) && std::abs(x) < 1e99; };
    if (surface.kind == kKindCone && !axis.v) {
        const double apex = -surface.radius / std::sin(surface.half_angle);
        return apex;
    }
    const double border = axis.v ? (upper ? surface.natural_bounds.hi.x : surface.natural_bounds.lo.x)
                                 : (upper ? surface.natural_bounds.hi.y : surface.natural_bounds.lo.y);
    return finite(border) ? border : std::nan("");
}

/// Joins the chains that go around once. Each lies on [start, start + period] along the axis afterwards.
void join_winding(std::vector<TrimChain>& chains, const CadSurface& surface, Axis axis, const TrimMetric& metric,
                  ChainReport& report)
{
    const double period = axis.period(surface);
    std::vector<TrimChain> closed, winding;
    for (TrimChain& chain : chains) {
        const int turns = axis.winding(chain);
        if (turns != 0 && (chain.winding_u != 0) == (chain.winding_v != 0)) {
            report.failure = "a loop goes around both directions of the surface at once";
            return;
        }
        if (std::abs(turns) > 1) {
            report.failure = "a loop goes around the surface more than once before it closes";
            return;
        }
        (turns == 0 ? closed : winding).push_back(std::move(chain));
    }
    if (winding.size() == 1 && std::isnan(far_border(surface, axis, false)) &&
        std::isnan(far_border(surface, axis, true))) {
        Pieces& pieces = winding.front().pieces;
        report.largest_gap_mm = std::max(report.largest_gap_mm, period * axis.scale(metric));
        report.had_open_loop = true;
        report.findings.push_back({TrimFindingKind::OpenLoop, pieces.back().p[3], period * axis.scale(metric),
                                   winding.front().loop, winding.front().loop});
        pieces.push_back(line_piece(pieces.back().p[3], pieces.front().p[0]));
        closed.push_back(std::move(winding.front()));
        winding.clear();
    }
    if (winding.empty()) {
        chains = std::move(closed);
        return;
    }
    const double start =
        std::min(axis.along(winding.front().pieces.front().p[0]), axis.along(winding.front().pieces.back().p[3]));
    struct Band {
        Pieces pieces;
        bool forwards; // with the axis: in a right-handed uv, the face lies on the upper side (u) or lower side (v)
        double at_border;
        int loop; // negative: a pole's
    };
    std::vector<Band> bands;
    for (TrimChain& chain : winding) {
        const int turns = axis.winding(chain);
        start_at(chain.pieces, axis, start, period, turns);
        Band band{std::move(chain.pieces), turns > 0, 0, chain.loop};
        if (!band.forwards)
            reverse_pieces(band.pieces);
        band.pieces.front().p[0] = axis.point(start, axis.across(band.pieces.front().p[0]));
        band.pieces.back().p[3] = axis.point(start + period, axis.across(band.pieces.front().p[0]));
        order_points(band.pieces.front());
        order_points(band.pieces.back());
        band.at_border = axis.across(band.pieces.front().p[0]);
        bands.push_back(std::move(band));
    }
    // the side of the face: left of the loop
    const auto upper_side = [&](const Band& band) { return band.forwards != axis.v; };
    const double cross_period = axis.cross_period(surface);
    if (cross_period > 0 && bands.size() == 2 && upper_side(bands[0]) != upper_side(bands[1])) {
        // a band around a torus: it lies above the one and below the other, at most a period away
        Band& lower = upper_side(bands[0]) ? bands[0] : bands[1];
        Band& upper = upper_side(bands[0]) ? bands[1] : bands[0];
        const double by = cross_period * std::ceil((lower.at_border - upper.at_border) / cross_period + kWholePeriod);
        if (by != 0) {
            shift_pieces(upper.pieces, axis.point(0, by));
            upper.at_border += by;
        }
    }
    std::stable_sort(bands.begin(), bands.end(),
                     [](const Band& a, const Band& b) { return a.at_border < b.at_border; });
    if (bands.size() % 2 != 0) {
        // the outermost loop that has its face beyond it, or the outermost at all
        bool upper = upper_side(bands.back());
        double border = far_border(surface, axis, upper);
        if (std::isnan(border)) {
            upper = !upper;
            border = far_border(surface, axis, upper);
        }
        if (std::isnan(border)) {
            report.failure = "an odd number of loops goes around a surface that has no end on either side";
            return;
        }
        Band pole{{line_piece(axis.point(start, border), axis.point(start + period, border))}, true, border, -1};
        bands.insert(border > bands.back().at_border ? bands.end() : bands.begin(), std::move(pole));
    }
    for (size_t i = 0; i + 1 < bands.size(); i += 2) {
        for (const size_t k : {i, i + 1}) // the face lies above the lower and below the upper loop of a pair
            if (bands[k].loop >= 0 && upper_side(bands[k]) != (k == i))
                report.findings.push_back(
                    {TrimFindingKind::TurnedLoop, bands[k].pieces.front().p[0], 0, bands[k].loop, bands[k].loop});
        TrimChain loop;
        loop.pieces = std::move(bands[i].pieces);
        Pieces& back = bands[i + 1].pieces;
        reverse_pieces(back);
        const CurvePiece up = line_piece(loop.pieces.back().p[3], back.front().p[0]);
        const CurvePiece down = line_piece(back.back().p[3], loop.pieces.front().p[0]);
        loop.pieces.push_back(up);
        loop.pieces.insert(loop.pieces.end(), back.begin(), back.end());
        loop.pieces.push_back(down);
        closed.push_back(std::move(loop));
    }
    chains = std::move(closed);
}

/// Whether only holes of a closed surface are given: every loop runs clockwise, and none spans a period.
bool only_holes(const std::vector<TrimChain>& chains, const CadSurface& surface)
{
    const Rect2d& n = surface.natural_bounds;
    const bool closed = surface.period_u > 0 && (surface.period_v > 0 || surface.kind == kKindSphere) &&
                        std::isfinite(n.lo.y) && std::abs(n.lo.y) < 1e99 && std::abs(n.hi.y) < 1e99;
    if (!closed)
        return false;
    return std::all_of(chains.begin(), chains.end(), [&](const TrimChain& chain) {
        const Rect2d r = chain_bounds(chain.pieces);
        return signed_area(chain.pieces) < 0 && r.hi.x - r.lo.x < 0.999 * surface.period_u &&
               (surface.period_v == 0 || r.hi.y - r.lo.y < 0.999 * surface.period_v);
    });
}

TrimChain rectangle(const Rect2d& r)
{
    TrimChain chain;
    const Vec2d corner[4] = {r.lo, {r.hi.x, r.lo.y}, r.hi, {r.lo.x, r.hi.y}};
    for (int i = 0; i < 4; ++i)
        chain.pieces.push_back(line_piece(corner[i], corner[(i + 1) % 4]));
    return chain;
}

/// Brings closed chains into one window along the axis.
void wrap(std::vector<TrimChain>& chains, const CadSurface& surface, Axis axis, const TrimMetric& metric)
{
    const double period = axis.period(surface);
    if (!(period > 0))
        return;
    const auto span = [&](const TrimChain& chain) {
        const Rect2d r = chain_bounds(chain.pieces);
        return std::pair(axis.along(r.lo), axis.along(r.hi));
    };
    // the outer loop is the longest along the axis, then the largest
    size_t outer = 0;
    double outer_length = 0, outer_area = 0;
    for (size_t i = 0; i < chains.size(); ++i) {
        const auto [lo, hi] = span(chains[i]);
        const double area = std::abs(signed_area(chains[i].pieces));
        if (hi - lo > outer_length * (1 + kWholePeriod) ||
            (hi - lo > outer_length * (1 - kWholePeriod) && area > outer_area)) {
            outer = i;
            outer_length = hi - lo;
            outer_area = area;
        }
    }
    constexpr double kMostSlack = 0.01; // of the period: a collapsed direction has no scale of its own
    const double slack =
        std::max(kWholePeriod * period, std::min(metric.tolerance_mm / axis.scale(metric), kMostSlack * period));
    auto [window_lo, window_hi] = span(chains[outer]);
    const bool whole = window_hi - window_lo > period - slack;
    double lo = window_lo, hi = window_hi;
    for (TrimChain& chain : chains) {
        const auto [a, b] = span(chain);
        // where the middle of a hole lies in the window, or nearest to it
        const double by = period * std::round((0.5 * (window_lo + window_hi) - 0.5 * (a + b)) / period);
        if (by != 0)
            shift_pieces(chain.pieces, axis.point(by, 0));
        lo = std::min(lo, a + by);
        hi = std::max(hi, b + by);
    }
    if (!whole && hi - lo <= period)
        return;
    window_hi = window_lo + period;

    std::vector<TrimChain> wrapped;
    for (const TrimChain& chain : chains) {
        const auto [a, b] = span(chain);
        const int first = static_cast<int>(std::floor((window_lo + slack - b) / period)) + 1;
        const int last = static_cast<int>(std::ceil((window_hi - slack - a) / period)) - 1;
        for (int k = first; k <= last; ++k) {
            TrimChain copy = chain;
            shift_pieces(copy.pieces, axis.point(k * period, 0));
            press_into(copy.pieces, axis, window_lo, window_hi);
            wrapped.push_back(std::move(copy));
        }
    }
    chains = std::move(wrapped);
}

} // namespace

void close_and_wrap(std::vector<TrimChain>& chains, const CadSurface& surface, const TrimMetric& metric, Rect2d& domain,
                    ChainReport& report)
{
    for (const Axis axis : {Axis{false}, Axis{true}}) {
        join_winding(chains, surface, axis, metric, report);
        if (!report.failure.empty())
            return;
    }
    if (only_holes(chains, surface))
        chains.insert(chains.begin(), rectangle(surface.natural_bounds));
    for (const Axis axis : {Axis{false}, Axis{true}})
        wrap(chains, surface, axis, metric);
    domain = {{1e300, 1e300}, {-1e300, -1e300}};
    for (const TrimChain& chain : chains) {
        const Rect2d r = chain_bounds(chain.pieces);
        domain.lo = {std::min(domain.lo.x, r.lo.x), std::min(domain.lo.y, r.lo.y)};
        domain.hi = {std::max(domain.hi.x, r.hi.x), std::max(domain.hi.y, r.hi.y)};
    }
}

} // namespace trimray
