#include "preprocess/patch_cut.h"

#include "format/bezier_net.h"
#include "preprocess/vec3d.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace trimray {
namespace {

// A piece whose points rounding moves by less than this share of what it may move the whole patch's is small enough: a
// thousandth of a pixel where pixels are so small that the patch's own rounding is one.
constexpr double kNegligible = 1.0 / 1024;

/// A net's control points in space, and their box.
struct Hull {
    std::vector<Vec3d> points;
    ControlBox box;

    /// How far the farthest point of the box is from p.
    double reach(const Vec3d& p) const
    {
        return norm({std::max(p.x - box.lo.x, box.hi.x - p.x), std::max(p.y - box.lo.y, box.hi.y - p.y),
                     std::max(p.z - box.lo.z, box.hi.z - p.z)});
    }
};

Hull hull_of(const Net& net)
{
    Hull hull{{}, control_box(net.points)};
    hull.points.reserve(net.points.size());
    for (const auto& [wx, wy, wz, w] : net.points)
        hull.points.push_back({wx / w, wy / w, wz / w});
    return hull;
}

/// max over neighbours a, b along the direction of |P_b - P_a| + (r - 1) |H - S|, in mm; see patch_speed.
double largest_step_mm(const Net& net, const Hull& hull, int direction)
{
    const size_t step = direction == 0 ? size_t(net.count_v) : 1;
    double largest = 0;
    for (int i = 0; i < net.count_u - (direction == 0 ? 1 : 0); ++i)
        for (int j = 0; j < net.count_v - (direction == 1 ? 1 : 0); ++j) {
            const size_t a = size_t(i) * net.count_v + j, b = a + step;
            const double w_a = net.points[a][3], w_b = net.points[b][3];
            const double ratio = std::max(w_a, w_b) / std::min(w_a, w_b);
            const double edge = norm(hull.points[b] - hull.points[a]);
            const double reach = ratio > 1 ? hull.reach(hull.points[w_a > w_b ? a : b]) : 0;
            largest = std::max(largest, edge + (ratio - 1) * reach);
        }
    return largest;
}

/// Bounds of |S_u| and |S_v| over the whole net, in mm.
PatchSpeed speed_mm(const Net& net, const Hull& hull)
{
    return {(net.count_u - 1) * largest_step_mm(net, hull, 0), (net.count_v - 1) * largest_step_mm(net, hull, 1)};
}

/// The same from the bounds over the net's sixteen parts, whose weights are nearer to each other.
PatchSpeed refined_speed_mm(const Net& net, const PatchSpeed& rough)
{
    std::vector<Net> parts{net};
    for (const int direction : {0, 1, 0, 1})
        for (size_t i = 0, count = parts.size(); i < count; ++i)
            parts.push_back(halve(parts[i], direction)); // parts[i] keeps the lower half
    PatchSpeed largest;
    for (const Net& part : parts) {
        const PatchSpeed speed = speed_mm(part, hull_of(part)); // by parameters of the part, a quarter of the net's
        largest = {std::max(largest.u, 4 * speed.u), std::max(largest.v, 4 * speed.v)};
    }
    return {std::min(rough.u, largest.u), std::min(rough.v, largest.v)};
}

Net net_of(const BezierPatch& patch)
{
    return {patch.degree_u + 1, patch.degree_v + 1, patch.control_points};
}

struct Limits {
    double least_mm = 0;                   // below it no piece is fast
    std::array<double, 2> narrowest{0, 0}; // sides of pieces, in uv_patch of the patch that is cut
};

Limits limits_of(const BezierPatch& patch)
{
    // what a piece's ends in uv_file, in double, may be off is a thousandth of it
    const auto narrowest = [](double lo, double hi) {
        return 1024 * 0x1p-52 * std::max(std::abs(lo), std::abs(hi)) / (hi - lo);
    };
    const double size_mm = control_box(patch.control_points).half_diagonal();
    const Rect2d& d = patch.domain;
    return {kNegligible * largest_speed(patch.degree_u, patch.degree_v) * size_mm,
            {narrowest(d.lo.x, d.hi.x), narrowest(d.lo.y, d.hi.y)}};
}

struct Piece {
    Net net;
    std::array<double, 2> lo{0, 0}, hi{1, 1}; // in uv_patch of the patch that is cut
    PatchSpeed speed_mm;                      // by its own parameters
    bool fast = false;

    /// How far rounding of u and v moves a point, in 2^24 mm
    double moved() const { return speed_mm.u + speed_mm.v; }
    /// Along which it is faster, 0: u, 1: v
    int direction() const { return speed_mm.v > speed_mm.u ? 1 : 0; }
    /// The largest k so that 2^-k of it is no narrower than a piece may be, and of use; below 1: it is not to be cut.
    int finest_cut(const Limits& limits) const
    {
        constexpr int kFinest = 24;
        const int d = direction();
        return std::min(kFinest, int(std::floor(std::log2((hi[d] - lo[d]) / limits.narrowest[d]))));
    }
};

Piece judged(Net net, const std::array<double, 2>& lo, const std::array<double, 2>& hi, const Limits& limits)
{
    const Hull hull = hull_of(net);
    const double own_mm = largest_speed(net.count_u - 1, net.count_v - 1) * hull.box.half_diagonal();
    const double most_mm = std::max(own_mm, limits.least_mm);
    PatchSpeed speed = speed_mm(net, hull);
    if (speed.u + speed.v > most_mm)
        speed = refined_speed_mm(net, speed);
    const bool fast = speed.u + speed.v > most_mm;
    return {std::move(net), lo, hi, speed, fast};
}

/// The piece below t of a direction, or above.
Piece part_of(const Piece& piece, int direction, double t, bool lower, const Limits& limits)
{
    std::array<double, 2> lo = piece.lo, hi = piece.hi;
    (lower ? hi : lo)[direction] = std::lerp(piece.lo[direction], piece.hi[direction], t);
    return judged(part_of(piece.net, direction, lower ? 0 : t, lower ? t : 1), lo, hi, limits);
}

/// Cuts where both halves are as fast: the farther the cut is from a light side, the faster the half beside it.
std::pair<Piece, Piece> halves(const Piece& piece, const Limits& limits)
{
    const int direction = piece.direction(), finest = piece.finest_cut(limits);
    const auto cut = [&](int k) { // 1 - finest .. finest - 1: from 2^-finest to 1 - 2^-finest
        const double t = k <= 0 ? std::ldexp(0.5, k) : 1 - std::ldexp(0.5, -k);
        return std::pair{part_of(piece, direction, t, true, limits), part_of(piece, direction, t, false, limits)};
    };
    const auto speed = [&](const Piece& half) { return direction == 0 ? half.speed_mm.u : half.speed_mm.v; };
    int low = 1 - finest, high = finest - 1;
    std::pair<Piece, Piece> best = cut(0);
    double best_speed = std::max(speed(best.first), speed(best.second));
    while (low <= high) {
        const int middle = low + (high - low) / 2;
        std::pair<Piece, Piece> made = cut(middle);
        const double lower = speed(made.first), upper = speed(made.second);
        (lower > upper ? high : low) = middle + (lower > upper ? -1 : 1);
        if (std::max(lower, upper) < best_speed) {
            best_speed = std::max(lower, upper);
            best = std::move(made);
        }
    }
    return best;
}

} // namespace

PatchSpeed patch_speed(const BezierPatch& patch)
{
    const Net net = net_of(patch);
    const Hull hull = hull_of(net);
    const double size_mm = hull.box.half_diagonal();
    const PatchSpeed speed = refined_speed_mm(net, speed_mm(net, hull));
    return {speed.u / size_mm, speed.v / size_mm};
}

double largest_speed(int degree_u, int degree_v)
{
    return std::sqrt(2.0) * (6 + 2 * (degree_u + degree_v));
}

CutPatch cut_by_weights(BezierPatch patch)
{
    CutPatch cut;
    if (!patch.rational) {
        cut.pieces.push_back(std::move(patch));
        return cut;
    }
    const Limits limits = limits_of(patch);
    std::vector<Piece> pieces{judged(net_of(patch), {0, 0}, {1, 1}, limits)};
    while (pieces.size() < kMostPieces) {
        auto worst = pieces.end();
        for (auto p = pieces.begin(); p != pieces.end(); ++p)
            if (p->fast && p->finest_cut(limits) > 0 && (worst == pieces.end() || p->moved() > worst->moved()))
                worst = p;
        if (worst == pieces.end())
            break;
        auto [lower, upper] = halves(*worst, limits);
        *worst = std::move(lower);
        pieces.push_back(std::move(upper));
    }
    cut.too_fast = std::any_of(pieces.begin(), pieces.end(), [](const Piece& piece) { return piece.fast; });
    if (pieces.size() == 1) {
        cut.pieces.push_back(std::move(patch));
        return cut;
    }
    for (const Piece& piece : pieces) {
        cut.speed_mm.u = std::max(cut.speed_mm.u, piece.speed_mm.u / (piece.hi[0] - piece.lo[0]));
        cut.speed_mm.v = std::max(cut.speed_mm.v, piece.speed_mm.v / (piece.hi[1] - piece.lo[1]));
    }
    std::sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) { return a.lo < b.lo; });
    for (Piece& piece : pieces) {
        BezierPatch& made = cut.pieces.emplace_back(BezierPatch{patch.degree_u, patch.degree_v, true, {}, {}});
        const Rect2d& d = patch.domain;
        made.domain = {{std::lerp(d.lo.x, d.hi.x, piece.lo[0]), std::lerp(d.lo.y, d.hi.y, piece.lo[1])},
                       {std::lerp(d.lo.x, d.hi.x, piece.hi[0]), std::lerp(d.lo.y, d.hi.y, piece.hi[1])}};
        made.control_points = std::move(piece.net.points);
    }
    return cut;
}

} // namespace trimray
