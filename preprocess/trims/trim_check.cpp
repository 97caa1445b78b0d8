#include "preprocess/trims/trim_check.h"

#include "preprocess/trims/trim_chain.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

namespace trimray {
namespace {

/// A piece that is compared with others.
struct Piece {
    MonotonePiece curve;
    size_t loop = 0;  // in the list of checked loops
    size_t place = 0; // in its loop
    int use = 0;
    uint32_t edge = 0;

    Vec2d start() const { return {curve.u[0], curve.v[0]}; }
    Vec2d end() const { return {curve.u[3], curve.v[3]}; }
};

bool near(Vec2d a, Vec2d b, double distance)
{
    return std::abs(a.x - b.x) <= distance && std::abs(a.y - b.y) <= distance;
}

bool boxes_touch(const MonotonePiece& a, const MonotonePiece& b)
{
    return a.u_lo() <= b.u_hi() + kTouching && b.u_lo() <= a.u_hi() + kTouching && a.v_lo() <= b.v_hi() + kTouching &&
           b.v_lo() <= a.v_hi() + kTouching;
}

void halve(const MonotonePiece& m, MonotonePiece& first, MonotonePiece& second)
{
    first.cubic = second.cubic = m.cubic;
    for (const auto& [c, a, b] : {std::tuple(m.u, first.u, second.u), std::tuple(m.v, first.v, second.v)}) {
        // de Casteljau at the middle
        const double ab = 0.5 * (c[0] + c[1]), bc = 0.5 * (c[1] + c[2]), cd = 0.5 * (c[2] + c[3]);
        const double abc = 0.5 * (ab + bc), bcd = 0.5 * (bc + cd), middle = 0.5 * (abc + bcd);
        a[0] = c[0], a[1] = ab, a[2] = abc, a[3] = middle;
        b[0] = middle, b[1] = bcd, b[2] = cd, b[3] = c[3];
    }
}

double size_of(const MonotonePiece& m)
{
    return std::max(m.u_hi() - m.u_lo(), m.v_hi() - m.v_lo());
}

/// A point where two pieces come within kTouching of each other, by halving whichever is larger; the box of a monotone
/// piece is that of its ends. `budget` ends the search of pieces that run beside each other just out of reach.
std::optional<Vec2d> common_point(const MonotonePiece& a, const MonotonePiece& b, int& budget)
{
    if (!boxes_touch(a, b) || --budget < 0)
        return std::nullopt;
    if (size_of(a) <= kTouching && size_of(b) <= kTouching)
        return Vec2d{a.u[0], a.v[0]};
    const bool split_a = size_of(a) >= size_of(b);
    MonotonePiece halves[2];
    halve(split_a ? a : b, halves[0], halves[1]);
    for (const MonotonePiece& half : halves)
        if (const auto found = split_a ? common_point(half, b, budget) : common_point(a, half, budget))
            return found;
    return std::nullopt;
}

/// Whether one piece is clearly on both sides of the other: at the ends of the range of v, or of u, that they share.
bool pass_each_other(const MonotonePiece& a, const MonotonePiece& b)
{
    const double v0 = std::max(a.v_lo(), b.v_lo()), v1 = std::min(a.v_hi(), b.v_hi());
    const double u0 = std::max(a.u_lo(), b.u_lo()), u1 = std::min(a.u_hi(), b.u_hi());
    const auto changes = [](double first, double second) {
        return std::min(std::abs(first), std::abs(second)) > 4 * kTouching && (first < 0) != (second < 0);
    };
    return (v0 < v1 && changes(u_at_v(a, v0) - u_at_v(b, v0), u_at_v(a, v1) - u_at_v(b, v1))) ||
           (u0 < u1 && changes(v_at_u(a, u0) - v_at_u(b, u0), v_at_u(a, u1) - v_at_u(b, u1)));
}

/// Whether `b` follows `a` in their loop, over nothing or over pieces too short to matter.
bool follows(const Piece& a, const Piece& b, size_t count)
{
    constexpr size_t kShortPieces = 3;
    const size_t steps = (b.place + count - a.place) % count;
    return a.loop == b.loop && (steps == 1 || (steps <= kShortPieces && near(a.end(), b.start(), 4 * kTouching)));
}

class Contacts {
public:
    Contacts(const std::vector<CheckedLoop>& loops, const CadFace& face)
    {
        std::vector<const CadEdgeUse*> uses;
        for (const CadLoop& loop : face.loops)
            for (const CadEdgeUse& use : loop)
                uses.push_back(&use);
        for (size_t i = 0; i < loops.size(); ++i)
            for (size_t k = 0; k < loops[i].pieces->size(); ++k) {
                const CurvePiece& piece = (*loops[i].pieces)[k];
                if (piece.use == kNoUse || uses[static_cast<size_t>(piece.use)]->edge_class == kEdgeSeam)
                    continue;
                pieces_.push_back({monotone(piece), i, k, piece.use, uses[static_cast<size_t>(piece.use)]->edge});
            }
        std::sort(pieces_.begin(), pieces_.end(), [](const Piece& a, const Piece& b) {
            return std::pair(a.curve.v_lo(), std::pair(a.loop, a.place)) <
                   std::pair(b.curve.v_lo(), std::pair(b.loop, b.place));
        });
    }

    /// Calls found(a, b, place) for pairs with a common point, as long as it returns true.
    template <class Found>
    void for_each(const std::vector<CheckedLoop>& loops, Found&& found) const
    {
        std::vector<const Piece*> active; // those that the sweep along v has not passed
        for (const Piece& piece : pieces_) {
            std::erase_if(active,
                          [&](const Piece* other) { return other->curve.v_hi() + kTouching < piece.curve.v_lo(); });
            for (const Piece* other : active) {
                const size_t count = loops[piece.loop].pieces->size();
                if (!boxes_touch(piece.curve, other->curve) || follows(piece, *other, count) ||
                    follows(*other, piece, count) || (piece.edge == other->edge && piece.use != other->use))
                    continue;
                int budget = 2000;
                const auto place = common_point(piece.curve, other->curve, budget);
                if (place && !found(piece, *other, *place))
                    return;
            }
            active.push_back(&piece);
        }
    }

private:
    std::vector<Piece> pieces_;
};

/// A loop's pieces and their bounding rectangle.
struct Outline {
    std::vector<MonotonePiece> pieces;
    Rect2d box{{1, 1}, {0, 0}};

    bool around(Vec2d point) const
    {
        bool inside = false;
        if (point.x > box.hi.x || point.y < box.lo.y || point.y > box.hi.y)
            return false;
        for (const MonotonePiece& m : pieces)
            if (m.v_lo() <= point.y && point.y < m.v_hi())
                inside ^= point.x < u_at_v(m, point.y);
        return inside;
    }
};

std::vector<Outline> outlines_of(const std::vector<CheckedLoop>& loops)
{
    std::vector<Outline> outlines;
    for (const CheckedLoop& loop : loops) {
        Outline& outline = outlines.emplace_back();
        for (const CurvePiece& piece : *loop.pieces)
            outline.pieces.push_back(monotone(piece));
        outline.box = chain_bounds(*loop.pieces);
    }
    return outlines;
}

void find_turned(const std::vector<CheckedLoop>& loops, const Rect2d& domain, std::vector<TrimFinding>& findings)
{
    // a loop thinner than its rounding has no direction
    constexpr double kLeastArea = 1e-9; // of the domain
    const std::vector<Outline> outlines = outlines_of(loops);
    for (size_t i = 0; i < loops.size(); ++i) {
        const std::vector<CurvePiece>& pieces = *loops[i].pieces;
        // what was pressed against the border of a period lies on another loop
        const auto own =
            std::find_if(pieces.begin(), pieces.end(), [](const CurvePiece& p) { return p.use != kNoUse; });
        const double area = signed_area(pieces);
        const bool known = std::any_of(findings.begin(), findings.end(), [&](const TrimFinding& f) {
            return f.kind == TrimFindingKind::TurnedLoop && f.loop == loops[i].loop; // another period's copy of it
        });
        if (loops[i].loop < 0 || own == pieces.end() || !(std::abs(area) > kLeastArea) || known)
            continue;
        const MonotonePiece m = monotone(*own);
        const Vec2d middle{bezier3(m.u, 0.5), bezier3(m.v, 0.5)};
        size_t depth = 0;
        for (size_t other = 0; other < outlines.size(); ++other)
            depth += other != i && outlines[other].around(middle);
        if ((area > 0) != (depth % 2 == 0))
            findings.push_back(
                {TrimFindingKind::TurnedLoop,
                 {std::lerp(domain.lo.x, domain.hi.x, middle.x), std::lerp(domain.lo.y, domain.hi.y, middle.y)},
                 0,
                 loops[i].loop,
                 loops[i].loop});
    }
}

const char* not_grown_text(NotGrownReason reason)
{
    switch (reason) {
    case NotGrownReason::CrossesItself:
        return "it crosses itself or another loop";
    case NotGrownReason::NoRoom:
        return "it is narrower than that";
    case NotGrownReason::Surface:
        break;
    }
    return "beyond its knots the surface has weights that are not positive";
}

} // namespace

const char* finding_name(TrimFindingKind kind)
{
    switch (kind) {
    case TrimFindingKind::OpenLoop:
        return "loop is open";
    case TrimFindingKind::TurnedLoop:
        return "loop is turned round";
    case TrimFindingKind::TouchingLoops:
        return "loops touch";
    case TrimFindingKind::CrossingLoops:
        return "loops cross";
    case TrimFindingKind::NotGrown:
        break;
    }
    return "loop is not grown";
}

std::string finding_detail(const TrimFinding& finding)
{
    const std::string at = fmt::format("at u {:.9g}, v {:.9g}", finding.uv_file.x, finding.uv_file.y);
    switch (finding.kind) {
    case TrimFindingKind::OpenLoop:
        return fmt::format("a gap of {:.3g} mm {} was closed by a straight line", finding.gap_mm, at);
    case TrimFindingKind::TurnedLoop:
        return fmt::format("loop {} {} runs the other way than its place among the loops asks for", finding.loop, at);
    case TrimFindingKind::TouchingLoops:
    case TrimFindingKind::CrossingLoops:
        break;
    case TrimFindingKind::NotGrown:
        return fmt::format("{} {} was not moved outwards by what its neighbours may miss it by: {}",
                           finding.loop < 0 ? "a border" : fmt::format("loop {}", finding.loop), at,
                           not_grown_text(finding.reason));
    }
    if (finding.loop == finding.other)
        return fmt::format("loop {} meets itself {}", finding.loop, at);
    return fmt::format("loops {} and {} meet {}", finding.loop, finding.other, at);
}

void check_loops(const std::vector<CheckedLoop>& loops, const CadFace& face, const Rect2d& domain,
                 std::vector<TrimFinding>& findings)
{
    const size_t before = findings.size();
    const Contacts contacts(loops, face);
    contacts.for_each(loops, [&](const Piece& a, const Piece& b, Vec2d place) {
        const bool crossing = pass_each_other(a.curve, b.curve);
        findings.push_back(
            {crossing ? TrimFindingKind::CrossingLoops : TrimFindingKind::TouchingLoops,
             {std::lerp(domain.lo.x, domain.hi.x, place.x), std::lerp(domain.lo.y, domain.hi.y, place.y)},
             0,
             loops[b.loop].loop,
             loops[a.loop].loop});
        return findings.size() < before + kMostContacts;
    });
    if (findings.size() == before) // loops that meet have no clear place among each other
        find_turned(loops, domain, findings);
}

} // namespace trimray
