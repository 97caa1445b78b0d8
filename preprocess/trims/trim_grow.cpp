#include "preprocess/trims/trim_grow.h"

#include "preprocess/bezier_patch.h"
#include "preprocess/spline.h"
#include "preprocess/vec2d.h"
#include "preprocess/vec3d.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace trimray {
namespace {

using Pieces = std::vector<CurvePiece>;

// What single precision may move a hit by, of the patch's unit: 8 roundings of 2^-24, the sum of a ray's, a root's and
// a parameter's on a patch that fills its unit.
constexpr double kHitRounding = 1.0 / (1 << 21);
// A stored point lies on a grid of 2^-22 of uv_face, half of it off at most, and a tracer's uv has as much again.
constexpr double kPointRounding = 1.0 / (1 << 22);
// Corners are moved to where their two grown pieces meet, as long as that is no farther out than this many growths.
// A convex corner sharper than that gets a blunt end, a notch is filled less far.
constexpr double kConvexReach = 2, kNotchReach = kGrowReach;
// Where a surface collapses in a direction (a pole), lengths are taken as this share of their mean: a line to the pole
// moves as a whole, and would lie far out at its other end. Both neighbours grow by the whole gap, so half is enough.
constexpr double kLeastSpeed = 0.2;

/// Which side of a loop is inside: left of its pieces' direction, right, or now one and now the other.
enum class Inside { Left, Right, Mixed };

/// The even-odd rule beside the middle of some pieces of the loop, weighed by their lengths: a line that closes a gap
/// may run backwards.
Inside inside_of(const Pieces& loop, const Pieces& all)
{
    constexpr size_t kSamples = 32;
    constexpr double kNoMoreThan = 0.02; // of the length may say otherwise
    constexpr double kCoincident = 1e-9; // uv_face
    double left = 0, right = 0;
    for (size_t k = 0; k < std::min(kSamples, loop.size()); ++k) {
        const CurvePiece& piece = loop[k * loop.size() / std::min(kSamples, loop.size())];
        const MonotonePiece m = monotone(piece);
        const double u = bezier3(m.u, 0.5), v = bezier3(m.v, 0.5);
        const Vec2d along = piece.p[3] - piece.p[0];
        const bool steep = std::abs(along.y) >= std::abs(along.x);
        bool odd = false;
        int here = 0; // the piece itself
        for (const CurvePiece& other : all) {
            const MonotonePiece o = monotone(other);
            if (steep ? !(o.v_lo() <= v && v < o.v_hi()) : !(o.u_lo() <= u && u < o.u_hi()))
                continue;
            const double off = steep ? u_at_v(o, v) - u : v_at_u(o, u) - v;
            here += std::abs(off) <= kCoincident;
            odd ^= off > kCoincident;
        }
        if (here != 1)
            continue; // walked twice, with no side of its own
        // `odd`: the side of larger u (steep) or v is inside
        const bool positive_is_left = steep ? along.y < 0 : along.x > 0;
        (odd == positive_is_left ? left : right) += length(along);
    }
    if (!(std::min(left, right) <= kNoMoreThan * (left + right)) || left == right)
        return Inside::Mixed;
    return left > right ? Inside::Left : Inside::Right;
}

/// The first fundamental form at a point, in mm per uv_face.
struct Metric {
    double speed_u, speed_v, root; // |S_u|, |S_v|, sqrt(EG - F^2)
    double dot_uv;                 // S_u . S_v
};

class Surface {
public:
    Surface(const CadSurface& surface, const Rect2d& domain)
        : surface_(surface), domain_(domain), size_{domain.hi.x - domain.lo.x, domain.hi.y - domain.lo.y}
    {
        const SurfaceExtent extent = surface_extent(surface, domain);
        least_ = {kLeastSpeed * extent.length_u_mm, kLeastSpeed * extent.length_v_mm};
        // the unit of a native patch spans its axis, whatever part of the surface the face is
        unit_mm_ = std::max({extent.length_u_mm, extent.length_v_mm, surface.radius + surface.minor_radius});
    }

    Metric at(Vec2d uv) const
    {
        constexpr double kLeastSine = 0.02; // between S_u and S_v; at less the surface is folded or collapsed
        const SurfaceDerivatives s = evaluate(surface_, domain_.lo.x + uv.x * size_.x, domain_.lo.y + uv.y * size_.y);
        Metric m;
        m.speed_u = std::max(norm(s.du) * size_.x, least_.x);
        m.speed_v = std::max(norm(s.dv) * size_.y, least_.y);
        m.dot_uv = trimray::dot(s.du, s.dv) * size_.x * size_.y;
        const double both = m.speed_u * m.speed_v;
        m.root = std::sqrt(std::max(both * both - m.dot_uv * m.dot_uv, kLeastSine * kLeastSine * both * both));
        return m;
    }
    double rounding_mm() const { return kHitRounding * unit_mm_; }

private:
    const CadSurface& surface_;
    Rect2d domain_;
    Vec2d size_, least_;
    double unit_mm_ = 0;
};

/// What a piece asks of a point that moves with it: n . d >= c, or n . d = 0 if it is held. In lengths of u and v
/// (speed times uv_face), n unit.
struct Demand {
    Vec2d n, along; // outwards, and the piece's direction
    double c = 0;
    bool held = false;
};

Demand demand_of(Vec2d direction, double grow_mm, bool inside_left, const Metric& m, double rounding_mm)
{
    Demand d;
    // the covector that is 0 along the piece and grows outwards, nu . d in uv_face
    const Vec2d nu = inside_left ? Vec2d{direction.y, -direction.x} : Vec2d{-direction.y, direction.x};
    const double length_mm = std::sqrt(std::max(0.0, direction.x * direction.x * m.speed_u * m.speed_u +
                                                         direction.y * direction.y * m.speed_v * m.speed_v +
                                                         2 * direction.x * direction.y * m.dot_uv));
    const Vec2d scaled{nu.x / m.speed_u, nu.y / m.speed_v};
    const double norm = length(scaled);
    if (!(norm > 0))
        return d;
    d.n = (1 / norm) * scaled;
    const Vec2d along{direction.x * m.speed_u, direction.y * m.speed_v};
    d.along = (1 / length(along)) * along;
    d.held = grow_mm == kHeld;
    // distance in mm of a move from the piece's line: nu . d root / length
    if (!d.held)
        d.c =
            ((grow_mm + rounding_mm) * length_mm / m.root + kPointRounding * (std::abs(nu.x) + std::abs(nu.y))) / norm;
    return d;
}

bool asks(const Demand& d)
{
    return d.n.x != 0 || d.n.y != 0;
}

/// The shortest move that both demands allow, and whether it was cut short at `reach` times the larger demand.
struct Move {
    Vec2d d;
    bool cut = false;
};

Move shortest_move(const Demand& a, const Demand& b, double reach)
{
    if (!asks(a) || !asks(b))
        return {asks(a) ? a.c * a.n : b.c * b.n};
    if (a.held && b.held)
        return {};
    const double turn = cross(a.n, b.n);
    if ((a.held || b.held) && std::abs(turn) < kSameDirection)
        return {};
    if (!a.held && !b.held) {
        if (const Vec2d d = a.c * a.n; dot(b.n, d) >= b.c)
            return {d};
        if (const Vec2d d = b.c * b.n; dot(a.n, d) >= a.c)
            return {d};
        // One direction, but for rounding: where both lines meet is anywhere along them, or nowhere
        if (std::abs(turn) < kSameDirection && dot(a.n, b.n) > 0) {
            const Vec2d middle = a.n + b.n;
            return {(std::max(a.c, b.c) / std::min(dot(middle, a.n), dot(middle, b.n))) * middle};
        }
    }
    const double limit = reach * std::max(a.c, b.c);
    // n_a . d = c_a, n_b . d = c_b
    const Vec2d d{(a.c * b.n.y - b.c * a.n.y) / turn, (b.c * a.n.x - a.c * b.n.x) / turn};
    const double far = length(d); // not finite where a piece turns back along its line
    if (far <= limit)
        return {d};
    return {std::isfinite(far) ? (limit / far) * d : Vec2d{}, true};
}

/// The sides of the domain move as wholes, so that what runs along them still does.
/// Side 0..3: u = 0, u = 1, v = 0, v = 1; -1: none.
int side_of(const CurvePiece& piece)
{
    const Vec2d a = piece.p[0], b = piece.p[3];
    if (a.x == b.x && (a.x == 0 || a.x == 1))
        return a.x == 0 ? 0 : 1;
    if (a.y == b.y && (a.y == 0 || a.y == 1))
        return a.y == 0 ? 2 : 3;
    return -1;
}

/// How far each side moves, uv_face: what the tracers' own slack at the domain's border leaves to do. 0 for one that a
/// held piece runs along.
using Sides = std::array<double, 4>;

Sides side_growth(const std::vector<TrimChain>& chains, const Surface& surface)
{
    Sides growth{};
    std::array<bool, 4> held{};
    for (const TrimChain& chain : chains)
        for (const CurvePiece& piece : chain.pieces) {
            const int side = side_of(piece);
            if (side < 0)
                continue;
            if (piece.grow_mm == kHeld) {
                held[side] = true;
                continue;
            }
            for (const double t : {0.0, 0.25, 0.5, 0.75, 1.0}) {
                const Metric m = surface.at(piece.p[0] + t * (piece.p[3] - piece.p[0]));
                const double per_uv = m.root / (side < 2 ? m.speed_v : m.speed_u);
                growth[side] = std::max(growth[side], (piece.grow_mm + surface.rounding_mm()) / per_uv +
                                                          kPointRounding - double(kDomainSlack));
            }
        }
    for (int side = 0; side < 4; ++side)
        if (held[side])
            growth[side] = 0;
    return growth;
}

/// Grows one loop.
class LoopGrower {
public:
    LoopGrower(const Pieces& pieces, bool inside_left, const Surface& surface, const Sides& sides)
        : pieces_(pieces), inside_left_(inside_left), surface_(surface), sides_(sides)
    {
    }

    Pieces run(double& largest_mm)
    {
        const size_t n = pieces_.size();
        std::vector<Vec2d> start(n), end(n); // of the grown pieces
        for (size_t i = 0; i < n; ++i)
            move_joint(i, (i + 1) % n, end[i], start[(i + 1) % n]);
        Pieces grown;
        for (size_t i = 0; i < n; ++i) {
            grown.push_back(move_piece(pieces_[i], start[i], end[i]));
            if (pieces_[i].grow_mm != kHeld)
                largest_mm = std::max(largest_mm, pieces_[i].grow_mm + surface_.rounding_mm());
            const Vec2d next = start[(i + 1) % n];
            if (end[i].x != next.x || end[i].y != next.y) { // the blunt end of a sharp corner
                const Vec2d third = (1 / 3.0) * (next - end[i]);
                CurvePiece blunt = pieces_[i];
                blunt.cubic = false;
                blunt.p[0] = end[i], blunt.p[1] = end[i] + third, blunt.p[2] = next - third, blunt.p[3] = next;
                grown.push_back(blunt);
            }
        }
        return grown;
    }

private:
    Demand demand(const CurvePiece& piece, Vec2d direction, const Metric& m) const
    {
        Demand d = demand_of(direction, piece.grow_mm, inside_left_, m, surface_.rounding_mm());
        const int side = side_of(piece);
        if (side < 0 || !asks(d))
            return d;
        d.c = sides_[side] * (side < 2 ? m.speed_u : m.speed_v);
        d.held = d.c == 0;
        return d;
    }

    /// Where the end of piece a and the start of piece b go: one point, or two at a sharp corner.
    void move_joint(size_t a, size_t b, Vec2d& end_a, Vec2d& start_b) const
    {
        const Vec2d p = pieces_[a].p[3];
        const Metric m = surface_.at(p);
        const Demand da = demand(pieces_[a], end_direction(pieces_[a]), m);
        const Demand db = demand(pieces_[b], start_direction(pieces_[b]), m);
        const bool turns_back = dot(da.along, db.along) < 0;
        double turn = cross(da.along, db.along);
        if (turns_back && std::abs(turn) < kSameDirection) // a cusp: its sides part farther off
            turn = cross(pieces_[a].p[3] - pieces_[a].p[0], pieces_[b].p[3] - pieces_[b].p[0]);
        const bool convex = inside_left_ ? turn > 0 : turn < 0;
        Move move = shortest_move(da, db, convex ? kConvexReach : kNotchReach);
        const auto moved = [&](Vec2d d) { return Vec2d{p.x + d.x / m.speed_u, p.y + d.y / m.speed_v}; };
        if (move.cut && convex && turns_back && !da.held && !db.held) {
            end_a = moved(da.c * (da.n + da.along));
            start_b = moved(db.c * (db.n - db.along));
            return;
        }
        Vec2d to = moved(move.d);
        for (const size_t i : {a, b})
            keep_on_side(pieces_[i], to);
        end_a = start_b = to;
    }

    /// A point that moved as far as its side did lies on it, bit for bit.
    void keep_on_side(const CurvePiece& piece, Vec2d& p) const
    {
        constexpr double kSamePoint = 1e-12;
        const int side = side_of(piece);
        if (side < 0)
            return;
        const double to = side % 2 == 0 ? -sides_[side] : 1 + sides_[side];
        double& x = side < 2 ? p.x : p.y;
        if (std::abs(x - to) <= kSamePoint)
            x = to;
    }

    CurvePiece move_piece(const CurvePiece& piece, Vec2d start, Vec2d end) const
    {
        CurvePiece out = piece;
        const Vec2d d0 = start - piece.p[0], d3 = end - piece.p[3];
        out.p[0] = start;
        out.p[3] = end;
        if (!piece.cubic) {
            out.p[1] = start + (1 / 3.0) * (end - start);
            out.p[2] = end - (1 / 3.0) * (end - start);
            return out;
        }
        if (piece.grow_mm == kHeld) {
            out.p[1] = piece.p[1] + d0;
            out.p[2] = piece.p[2] + d3;
            order_points(out);
            return out;
        }
        // Each leg of the control polygon moves out by the growth (Tiller & Hanson 1984): an inner point goes to where
        // its two legs meet again. All legs lie in one quadrant, so that is at most sqrt(2) growths away.
        const Vec2d legs[3] = {piece.p[1] - piece.p[0], piece.p[2] - piece.p[1], piece.p[3] - piece.p[2]};
        Vec2d inner[2];
        for (int i = 0; i < 2; ++i) {
            const Metric m = surface_.at(piece.p[i + 1]);
            const auto leg_demand = [&](Vec2d leg) {
                return demand_of(leg, piece.grow_mm, inside_left_, m, surface_.rounding_mm());
            };
            const Vec2d d = shortest_move(leg_demand(legs[i]), leg_demand(legs[i + 1]), kConvexReach).d;
            inner[i] = {d.x / m.speed_u, d.y / m.speed_v};
        }
        const double more = cover(piece, d0, inner[0], inner[1], d3);
        out.p[1] = piece.p[1] + more * inner[0];
        out.p[2] = piece.p[2] + more * inner[1];
        order_points(out);
        return out;
    }

    /// The factor of the inner points' moves that takes the whole piece as far out as it asks: between them and the
    /// ends the moves blend.
    double cover(const CurvePiece& piece, Vec2d d0, Vec2d d1, Vec2d d2, Vec2d d3) const
    {
        constexpr double kMostFactor = 2;
        const MonotonePiece m = monotone(piece);
        double factor = 1;
        for (const double t : {0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875}) {
            const double s = 1 - t, b0 = s * s * s, b1 = 3 * s * s * t, b2 = 3 * s * t * t, b3 = t * t * t;
            const Vec2d direction = (s * s) * (piece.p[1] - piece.p[0]) + (2 * s * t) * (piece.p[2] - piece.p[1]) +
                                    (t * t) * (piece.p[3] - piece.p[2]);
            const Metric metric = surface_.at({bezier3(m.u, t), bezier3(m.v, t)});
            const Demand asked = demand_of(direction, piece.grow_mm, inside_left_, metric, surface_.rounding_mm());
            const auto outwards = [&](Vec2d d) { return dot(asked.n, {d.x * metric.speed_u, d.y * metric.speed_v}); };
            const double ends = outwards(b0 * d0 + b3 * d3), middle = outwards(b1 * d1 + b2 * d2);
            if (middle > 0)
                factor = std::max(factor, (asked.c - ends) / middle);
        }
        return std::min(factor, kMostFactor);
    }

    const Pieces& pieces_;
    const bool inside_left_;
    const Surface& surface_;
    const Sides& sides_;
};

/// Whether a grown loop still goes around what it went around: an outer loop around more, a hole around a part of it.
bool keeps_its_way(const Pieces& before, const Pieces& after, bool inside_left)
{
    constexpr double kLeastShare = 0.25; // of a hole: a narrower one is turned inside out, or soon will be
    const double area = signed_area(before), share = signed_area(after) / area;
    const bool hole = (area > 0) != inside_left;
    return hole ? share > kLeastShare && share <= 1 : share >= 1;
}

/// As far as the domain may reach, in uv_file.
Rect2d farthest_domain(const CadSurface& s, const Rect2d& domain, const Rect2d& wanted)
{
    Rect2d far = wanted;
    const auto within_period = [](double period, double lo, double hi, double& far_lo, double& far_hi) {
        if (!(period > 0) || far_hi - far_lo <= period)
            return;
        const double room = std::max(0.0, 0.5 * (period - (hi - lo)));
        far_lo = std::max(far_lo, lo - room);
        far_hi = std::min(far_hi, hi + room);
    };
    within_period(s.period_u, domain.lo.x, domain.hi.x, far.lo.x, far.hi.x);
    within_period(s.period_v, domain.lo.y, domain.hi.y, far.lo.y, far.hi.y);
    const auto not_beyond = [](double end_lo, double end_hi, double lo, double hi, double& far_lo, double& far_hi) {
        far_lo = std::max(far_lo, std::min(end_lo, lo));
        far_hi = std::min(far_hi, std::max(end_hi, hi));
    };
    const double half_pi = 0.5 * std::numbers::pi;
    if (s.kind == kKindSphere)
        not_beyond(-half_pi, half_pi, domain.lo.y, domain.hi.y, far.lo.y, far.hi.y);
    if (s.kind == kKindCone) {
        const double apex = -s.radius / std::sin(s.half_angle);
        if (domain.lo.y >= apex)
            far.lo.y = std::max(far.lo.y, apex);
        if (domain.hi.y <= apex)
            far.hi.y = std::min(far.hi.y, apex);
    }
    if (s.kind == kKindBezier) {
        const auto ends = [](const std::vector<double>& knots, int degree) {
            return std::pair(held_to_surface(knots, degree, -1e300), held_to_surface(knots, degree, 1e300));
        };
        const auto u = ends(s.spline.knots_u, s.spline.degree_u), v = ends(s.spline.knots_v, s.spline.degree_v);
        if (!(s.period_u > 0))
            not_beyond(u.first, u.second, domain.lo.x, domain.hi.x, far.lo.x, far.hi.x);
        if (!(s.period_v > 0))
            not_beyond(v.first, v.second, domain.lo.y, domain.hi.y, far.lo.y, far.hi.y);
    }
    return far;
}

/// Into uv_face of the new domain; what lies beyond is pressed against its border.
void map_to_new_domain(Pieces& pieces, const Rect2d& bounds)
{
    const auto map = [](double x, double lo, double hi) { return std::clamp((x - lo) / (hi - lo), 0.0, 1.0); };
    for (CurvePiece& piece : pieces) {
        for (Vec2d& p : piece.p)
            p = {map(p.x, bounds.lo.x, bounds.hi.x), map(p.y, bounds.lo.y, bounds.hi.y)};
        order_points(piece);
    }
}

} // namespace

Rect2d grow_loops(std::vector<TrimChain>& chains, const CadSurface& surface, const Rect2d& domain, GrowReport& report)
{
    const Surface measured(surface, domain);
    const Sides sides = side_growth(chains, measured);
    Pieces all;
    for (const TrimChain& chain : chains)
        all.insert(all.end(), chain.pieces.begin(), chain.pieces.end());
    Rect2d bounds{{0, 0}, {1, 1}};
    for (TrimChain& chain : chains) {
        if (chain.pieces.size() < 2)
            continue; // no loop
        const Inside inside = inside_of(chain.pieces, all);
        double largest_mm = 0;
        if (inside != Inside::Mixed)
            if (Pieces grown = LoopGrower(chain.pieces, inside == Inside::Left, measured, sides).run(largest_mm);
                keeps_its_way(chain.pieces, grown, inside == Inside::Left)) {
                chain.pieces = std::move(grown);
                report.largest_mm = std::max(report.largest_mm, largest_mm);
                const Rect2d r = chain_bounds(chain.pieces);
                bounds.lo = {std::min(bounds.lo.x, r.lo.x), std::min(bounds.lo.y, r.lo.y)};
                bounds.hi = {std::max(bounds.hi.x, r.hi.x), std::max(bounds.hi.y, r.hi.y)};
                continue;
            }
        const Vec2d at = chain.pieces.front().p[0];
        report.not_grown.push_back(
            {TrimFindingKind::NotGrown,
             {std::lerp(domain.lo.x, domain.hi.x, at.x), std::lerp(domain.lo.y, domain.hi.y, at.y)},
             0,
             chain.loop,
             chain.loop,
             inside == Inside::Mixed ? NotGrownReason::CrossesItself : NotGrownReason::NoRoom});
    }
    const Vec2d size{domain.hi.x - domain.lo.x, domain.hi.y - domain.lo.y};
    const Rect2d wanted{{domain.lo.x + bounds.lo.x * size.x, domain.lo.y + bounds.lo.y * size.y},
                        {domain.lo.x + bounds.hi.x * size.x, domain.lo.y + bounds.hi.y * size.y}};
    const Rect2d grown = farthest_domain(surface, domain, wanted);
    const Rect2d grown_face{{(grown.lo.x - domain.lo.x) / size.x, (grown.lo.y - domain.lo.y) / size.y},
                            {(grown.hi.x - domain.lo.x) / size.x, (grown.hi.y - domain.lo.y) / size.y}};
    for (TrimChain& chain : chains)
        map_to_new_domain(chain.pieces, grown_face);
    return grown;
}

} // namespace trimray
