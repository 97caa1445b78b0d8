// Patches -> leaves: native surfaces by the turn of their arcs, Bezier patches by the turning of their control polygon,
// their aspect, and what it takes to prove that rays meet a leaf once, worst first, until all are good or the patch's
// budget is spent.
#include "format/bezier_net.h"
#include "format/derive.h"
#include "format/leaf_geometry.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <queue>
#include <utility>

#include <tbb/parallel_for.h>

namespace trimray {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kDeepestSplit = 15; // uv in steps of 1 / 32768
// Single precision evaluates S(u, v) of |q| <= 1 to a few eps a degree, and decodes the box to a few more.
constexpr double kRounding = 1.0 / (1 << 22);
// Control points are single precision, |q| <= 1: an edge shorter than this, patch units, may point anywhere. Where a
// side of a patch meets in one point, its polygon is nothing but such edges.
constexpr double kLeastEdge = 1e-6;
// A flat leaf shorter than this in its part (|p| <= 1) is not split for its aspect alone: its box is tight. Measured on
// 10 models: 0.02 makes twice the leaves for the same visits, no splitting at all up to three times the visits.
constexpr double kShortestForAspect = 0.1;
// Leaves shorter than this in their part may turn more, up to kMostTurning times: few rays meet them. Measured: half to
// a tenth of the leaves, the same share of wrong pixels (1e-5), faster. A turning of 0.4 instead of 0.2 rad makes a
// tenth fewer where the bend calls for splits as well, visits and Newton's steps the same.
constexpr double kSmallLeaf = 0.05;
constexpr double kMostTurning = 4;
// Along a straight leaf with weights w, Newton's error e becomes e^2 w' / w at the root. From the middle of a leaf
// whose weights differ by the ratio r it thus becomes at most e (r - 1) / 2: it does not grow below r = 3.
constexpr double kMostWeightRatio = 2;
// A leaf whose sides are shorter than this in its part, in the geometric mean, is not split for its bend: few rays meet
// it, and at sides without length bends do not fall. Measured on nine free-form models: 0.005 makes a tenth more leaves
// for frames 1 % faster, 0.02 a tenth fewer for frames 3 % slower.
constexpr double kSmallestForBend = 0.01;
// A split has not lessened a leaf's bend when this much of it is left (a half of a smooth leaf keeps 3/4), and after so
// many in a row no more follow: at a pole half a leaf bends as much as the whole.
constexpr double kNotLess = 0.9;
constexpr int kMostInVain = 3;

struct UvCell {
    int level[2] = {0, 0}; // splits in u and v
    uint index[2] = {0, 0};
};

void set_cell(const UvCell& cell, LeafRecord& leaf)
{
    uint lo[2], hi[2];
    for (int i = 0; i < 2; ++i) {
        const uint step = 32768u >> cell.level[i];
        lo[i] = cell.index[i] * step;
        hi[i] = lo[i] + step;
    }
    leaf.uv_lo = lo[0] | lo[1] << 16;
    leaf.uv_hi = hi[0] | hi[1] << 16;
}

void cell_range(const UvCell& cell, std::array<double, 2>& lo, std::array<double, 2>& hi)
{
    for (int i = 0; i < 2; ++i) {
        lo[i] = std::ldexp(cell.index[i], -cell.level[i]);
        hi[i] = std::ldexp(cell.index[i] + 1, -cell.level[i]);
    }
}

// ---- native surfaces -----------------------------------------------------------------------------------------------

Point3 normalised(const Point3& a, const Point3& fallback)
{
    const double length = std::sqrt(dot3(a, a));
    return length > 0 ? Point3{a[0] / length, a[1] / length, a[2] / length} : fallback;
}

/// Axes at the middle of the piece: along u, along v (straight: along the surface's own axis), and the normal.
std::array<Point3, 3> native_axes(const NativePiece& piece, bool straight)
{
    const double u = 0.5 * (piece.lo[0] + piece.hi[0]), v = 0.5 * (piece.lo[1] + piece.hi[1]);
    if (piece.kind == kKindPlane)
        return {Point3{1, 0, 0}, Point3{0, 1, 0}, Point3{0, 0, 1}};
    const Point3 radial{std::cos(u), std::sin(u), 0}, tangent{-std::sin(u), std::cos(u), 0};
    double out = 0, up = 1; // S_v = out * radial + up * z
    if (!straight && piece.kind == kKindCone) {
        up = 1 / std::sqrt(1 + piece.param[1] * piece.param[1]);
        out = piece.param[1] * up;
    } else if (!straight && piece.kind != kKindCylinder) {
        out = -std::sin(v);
        up = std::cos(v);
    }
    const Point3 along{out * radial[0], out * radial[1], up};
    return {tangent, along, cross3(tangent, along)};
}

void box_native(const NativePiece& piece, LeafRecord& leaf)
{
    double smallest = -1;
    for (const bool straight : {true, false}) {
        LeafRecord candidate = leaf;
        const std::array<Point3, 3> axes = encode_leaf_axes(native_axes(piece, straight), candidate);
        Point3 lo, hi, size;
        for (int i = 0; i < 3; ++i) {
            hi[i] = largest_along(piece, axes[i]);
            lo[i] = -largest_along(piece, {-axes[i][0], -axes[i][1], -axes[i][2]});
            size[i] = hi[i] - lo[i];
        }
        const double area = size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
        if (smallest >= 0 && !(area < smallest))
            continue;
        smallest = area;
        encode_leaf_extent(axes, lo, hi, 16 * kRounding, candidate);
        leaf = candidate;
    }
}

/// Arcs of more than 100 degrees are halved, so that a box hugs its arc: measured on 5 models, 7 to 17 % fewer leaves
/// visited for 3 to 18 % more leaves; arcs of 50 degrees gain nothing more.
int arc_level(double span)
{
    constexpr double kWidestArc = 100 * kPi / 180;
    int level = 0;
    while (span > kWidestArc && level < 3) {
        span /= 2;
        ++level;
    }
    return level;
}

void add_native_leaves(const PatchRecord& patch, uint patch_id, std::vector<LeafRecord>& leaves)
{
    const NativePiece whole = native_piece(patch, {0, 0}, {1, 1});
    UvCell cell;
    if (whole.kind != kKindPlane)
        cell.level[0] = arc_level(whole.hi[0] - whole.lo[0]);
    if (whole.kind == kKindSphere || whole.kind == kKindTorus)
        cell.level[1] = arc_level(whole.hi[1] - whole.lo[1]);
    for (cell.index[0] = 0; cell.index[0] < 1u << cell.level[0]; ++cell.index[0]) {
        for (cell.index[1] = 0; cell.index[1] < 1u << cell.level[1]; ++cell.index[1]) {
            LeafRecord leaf{};
            leaf.patch = patch_id;
            set_cell(cell, leaf);
            std::array<double, 2> lo, hi;
            cell_range(cell, lo, hi);
            box_native(native_piece(patch, lo, hi), leaf);
            leaves.push_back(leaf);
        }
    }
}

// ---- Bezier patches ------------------------------------------------------------------------------------------------

struct Shape {
    double turning[2] = {0, 0}; // rad
    double length[2] = {0, 0};  // patch units, mean of the polygons
    double weights[2] = {1, 1}; // largest over smallest along a line of the net
};

/// An angle by its sine and cosine times any length.
struct Turn {
    double sine = 0, cosine = 0; // sine >= 0

    double angle() const { return std::atan2(sine, cosine); }
    /// No less than angle() and cheaper: t = tan <= 1 has atan t <= t (15 + 4 t^2) / (15 + 9 t^2), within 4e-4 below
    /// 0.6
    double at_most() const
    {
        if (!(sine <= cosine))
            return kPi;
        const double t = cosine > 0 ? sine / cosine : 0, tt = t * t;
        return t * (15 + 4 * tt) / (15 + 9 * tt);
    }
};

Turn turn(const Point3& a, const Point3& b)
{
    const Point3 c = cross3(a, b);
    return {std::sqrt(dot3(c, c)), dot3(a, b)};
}

Point3 minus(const Point3& a, const Point3& b)
{
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

void project(const Net& net, std::vector<Point3>& points)
{
    points.resize(net.points.size());
    for (size_t i = 0; i < points.size(); ++i) {
        const Point4& p = net.points[i];
        points[i] = {p[0] / p[3], p[1] / p[3], p[2] / p[3]};
    }
}

/// Angle between the normals at the two ends of a patch's side, for twist; 0 where a normal does not exist.
double normal_turning(const Point3& du0, const Point3& dv0, const Point3& du1, const Point3& dv1)
{
    const Point3 n0 = cross3(du0, dv0), n1 = cross3(du1, dv1);
    constexpr double kLeastSine = 1e-4; // of the angle between the tangents, below which they give no normal
    for (const Point3* edge : {&du0, &dv0, &du1, &dv1})
        if (!(dot3(*edge, *edge) > kLeastEdge * kLeastEdge))
            return 0;
    const double size0 = dot3(du0, du0) * dot3(dv0, dv0), size1 = dot3(du1, du1) * dot3(dv1, dv1);
    if (!(dot3(n0, n0) > kLeastSine * kLeastSine * size0) || !(dot3(n1, n1) > kLeastSine * kLeastSine * size1))
        return 0;
    return turn(n0, n1).angle();
}

Shape measure(const Net& net, const std::vector<Point3>& p)
{
    Shape shape;
    std::vector<Turn> turns;
    for (int direction = 0; direction < 2; ++direction) {
        const int count = direction == 0 ? net.count_u : net.count_v,
                  lines = direction == 0 ? net.count_v : net.count_u;
        const int step = direction == 0 ? net.count_v : 1, next_line = direction == 0 ? 1 : net.count_v;
        double total = 0;
        for (int line = 0; line < lines; ++line) {
            const Point3* at = &p[size_t(line) * next_line];
            double length = 0, lightest = net.points[size_t(line) * next_line][3], heaviest = lightest;
            for (int i = 1; i < count; ++i) {
                const double w = net.points[size_t(line) * next_line + size_t(i) * step][3];
                lightest = std::min(lightest, w);
                heaviest = std::max(heaviest, w);
            }
            shape.weights[direction] = std::max(shape.weights[direction], heaviest / lightest);
            for (int i = 0; i + 1 < count; ++i) {
                const Point3 e = minus(at[(i + 1) * step], at[i * step]);
                length += std::sqrt(dot3(e, e));
            }
            const double shortest = std::max(1e-5 * length, kLeastEdge); // edges of rounding size have no direction
            Point3 last{};
            bool has_last = false;
            turns.clear();
            for (int i = 0; i + 1 < count; ++i) {
                const Point3 e = minus(at[(i + 1) * step], at[i * step]);
                if (!(dot3(e, e) > shortest * shortest))
                    continue;
                if (has_last)
                    turns.push_back(turn(last, e));
                last = e;
                has_last = true;
            }
            total += length;
            // most lines turn less than one before, which is seen without their angles
            double at_most = 0, turning = 0;
            for (const Turn& t : turns)
                at_most += t.at_most();
            if (at_most * (1 + 1e-9) <= shape.turning[direction]) // with room for rounding
                continue;
            for (const Turn& t : turns)
                turning += t.angle();
            shape.turning[direction] = std::max(shape.turning[direction], turning);
        }
        shape.length[direction] = total / lines;
    }
    // twist: the corners' normals
    const int nu = net.count_u, nv = net.count_v;
    Point3 du[2][2], dv[2][2];
    for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 2; ++j) {
            const int row = i * (nu - 1), column = j * (nv - 1);
            const int row0 = i * (nu - 2), column0 = j * (nv - 2);
            du[i][j] = minus(p[(row0 + 1) * nv + column], p[row0 * nv + column]);
            dv[i][j] = minus(p[row * nv + column0 + 1], p[row * nv + column0]);
        }
    }
    for (int k = 0; k < 2; ++k) {
        shape.turning[0] = std::max(shape.turning[0], normal_turning(du[0][k], dv[0][k], du[1][k], dv[1][k]));
        shape.turning[1] = std::max(shape.turning[1], normal_turning(du[k][0], dv[k][0], du[k][1], dv[k][1]));
    }
    return shape;
}

void box_net(const Net& net, const std::vector<Point3>& p, LeafRecord& leaf)
{
    const int nu = net.count_u, nv = net.count_v;
    Point3 du{}, dv{};
    for (int j = 0; j < nv; ++j)
        for (int c = 0; c < 3; ++c)
            du[c] += p[(nu - 1) * nv + j][c] - p[j][c];
    for (int i = 0; i < nu; ++i)
        for (int c = 0; c < 3; ++c)
            dv[c] += p[i * nv + nv - 1][c] - p[i * nv][c];
    const Point3 x = normalised(dot3(du, du) >= dot3(dv, dv) ? du : dv, {1, 0, 0});
    const Point3 any = std::abs(x[0]) < 0.7 ? Point3{1, 0, 0} : Point3{0, 1, 0};
    const Point3 z = normalised(cross3(du, dv), normalised(cross3(x, any), {0, 0, 1}));
    const std::array<Point3, 3> axes = encode_leaf_axes({x, cross3(z, x), z}, leaf);
    Point3 lo{1e300, 1e300, 1e300}, hi{-1e300, -1e300, -1e300};
    for (const Point3& q : p) {
        for (int i = 0; i < 3; ++i) {
            const double along = dot3(q, axes[i]);
            lo[i] = std::min(lo[i], along);
            hi[i] = std::max(hi[i], along);
        }
    }
    encode_leaf_extent(axes, lo, hi, (nu + nv + 14) * kRounding, leaf);
}

/// A piece of a patch waiting to be split or kept.
struct Piece {
    double excess = 0; // worst of its measures over their limits; kept when <= 1
    int direction = 0; // to split
    uint order = 0;    // of creation, to break ties
    UvCell cell;
    Net net;
    std::optional<LeafBend> bend; // where nothing else calls for a split
    double bend_before = 0; // bend over its limit of the piece that was split for it; 0: it was for something else
    int in_vain = 0;        // splits for it in a row that did not lessen it
};

struct WorstFirst {
    bool operator()(const Piece& a, const Piece& b) const
    {
        return a.excess != b.excess ? a.excess < b.excess : a.order > b.order;
    }
};

/// A patch that is split.
struct Whole {
    Net net;
    std::array<double, 2> rounding; // derivative_rounding
    double scale = 1;               // part units a patch unit
};

/// Sets the piece's bend and whether it is to be split for that. length: of its sides, in the part.
void judge_bend(Piece& piece, const Whole& patch, const double (&length)[2], const LeafOptions& options)
{
    std::array<double, 2> lo, hi;
    cell_range(piece.cell, lo, hi);
    const std::array<LeafBend, 2> by_side = leaf_bend_by_side(patch.net, patch.rounding, lo, hi);
    piece.bend = sum(by_side);
    // least_slope <= tan b where along + across / tan b <= 1/2
    const double b = options.leaf_slope_deg * (kPi / 180), per_slope = std::max(std::cos(b), 0.0) / std::sin(b);
    const auto over_limit = [&](const LeafBend& bend) {
        return std::isinf(bend.across) ? bend.across : 2 * (bend.along + bend.across * per_slope);
    };
    const double excess = over_limit(*piece.bend), of_u = over_limit(by_side[0]), of_v = over_limit(by_side[1]);
    const bool lessened = piece.bend_before == 0 || excess < kNotLess * piece.bend_before;
    piece.in_vain = lessened ? 0 : piece.in_vain + 1;
    piece.bend_before = excess;
    if (!(excess > 1) || piece.in_vain >= kMostInVain ||
        !(length[0] * length[1] >= kSmallestForBend * kSmallestForBend))
        return;
    const bool v_first = of_u == of_v ? length[1] > length[0] : of_v > of_u;
    for (const int direction : {v_first ? 1 : 0, v_first ? 0 : 1}) {
        if (piece.cell.level[direction] < kDeepestSplit) {
            piece.direction = direction;
            piece.excess = excess;
            return;
        }
    }
}

void judge(Piece& piece, const Whole& patch, const LeafOptions& options, std::vector<Point3>& scratch)
{
    project(piece.net, scratch);
    const Shape s = measure(piece.net, scratch);
    double excess[2], length[2];
    for (int i = 0; i < 2; ++i) {
        length[i] = s.length[i] * patch.scale; // in the part
        const double ease = std::clamp(std::sqrt(kSmallLeaf / length[i]), 1.0, kMostTurning);
        const double turning = s.turning[i] / (options.max_turning_rad * ease);
        const double aspect = length[i] > kShortestForAspect ? s.length[i] / (options.max_aspect * s.length[1 - i]) : 0;
        const double weights = std::log2(s.weights[i]) / std::log2(kMostWeightRatio);
        excess[i] = piece.cell.level[i] < kDeepestSplit ? std::max({turning, aspect, weights}) : 0;
    }
    piece.direction = excess[1] > excess[0] ? 1 : 0;
    piece.excess = excess[piece.direction];
    if (!(piece.excess > 1))
        judge_bend(piece, patch, length, options);
}

void add_bezier_leaves(PackImage& image, uint patch_id, const LeafOptions& options, std::vector<LeafRecord>& leaves)
{
    PatchRecord& patch = image.patches[patch_id];
    std::vector<Point3> scratch;
    std::vector<Piece> heap(1);
    Whole whole{load_net(image, patch), {}, patch.scale};
    whole.rounding = derivative_rounding(whole.net);
    for (int i = 0; i < 2; ++i)
        patch.param[i] = std::nextafter(static_cast<float>(whole.rounding[i]), HUGE_VALF);
    heap[0].net = whole.net;
    judge(heap[0], whole, options, scratch);
    const auto keep = [&](const Piece& piece) {
        LeafRecord leaf{};
        leaf.patch = patch_id;
        set_cell(piece.cell, leaf);
        std::array<double, 2> lo, hi;
        cell_range(piece.cell, lo, hi);
        encode_leaf_bend(piece.bend ? *piece.bend : leaf_bend(whole.net, lo, hi), leaf);
        project(piece.net, scratch);
        box_net(piece.net, scratch, leaf);
        leaves.push_back(leaf);
    };
    uint made = 0, kept = 0;
    while (!heap.empty()) {
        std::pop_heap(heap.begin(), heap.end(), WorstFirst{});
        Piece piece = std::move(heap.back());
        heap.pop_back();
        const bool budget_left = kept + heap.size() + 2 <= options.max_leaves_per_patch;
        if (!(piece.excess > 1) || !budget_left) {
            keep(piece);
            ++kept;
            continue;
        }
        if (!piece.bend)
            piece.bend_before = 0;
        piece.bend.reset();
        Piece upper;
        upper.bend_before = piece.bend_before;
        upper.in_vain = piece.in_vain;
        upper.net = halve(piece.net, piece.direction);
        ++piece.cell.level[piece.direction];
        piece.cell.index[piece.direction] *= 2;
        upper.cell = piece.cell;
        ++upper.cell.index[piece.direction];
        for (Piece* half : {&piece, &upper}) {
            half->order = ++made;
            judge(*half, whole, options, scratch);
            heap.push_back(std::move(*half));
            std::push_heap(heap.begin(), heap.end(), WorstFirst{});
        }
    }
}

} // namespace

void derive_leaves(PackImage& image, const LeafOptions& options, const std::function<bool()>& cancelled)
{
    constexpr size_t kChunk = 64; // patches a task: fixed, so that the order does not depend on threads
    const size_t chunks = (image.patches.size() + kChunk - 1) / kChunk;
    std::vector<std::vector<LeafRecord>> made(chunks);
    tbb::parallel_for(size_t{0}, chunks, [&](size_t chunk) {
        const size_t last = std::min(image.patches.size(), (chunk + 1) * kChunk);
        for (size_t p = chunk * kChunk; p < last && !(cancelled && cancelled()); ++p) {
            if ((image.patches[p].shape & 0xffu) == kKindBezier)
                add_bezier_leaves(image, uint(p), options, made[chunk]);
            else
                add_native_leaves(image.patches[p], uint(p), made[chunk]);
        }
    });
    image.leaves.clear();
    for (const std::vector<LeafRecord>& some : made)
        image.leaves.insert(image.leaves.end(), some.begin(), some.end());
    // leaves are in the order of patches, and a part's patches are consecutive
    uint next = 0;
    for (PartRecord& part : image.parts) {
        const uint end = part.first_patch + part.patch_count;
        part.first_leaf = next;
        while (next < image.leaves.size() && image.leaves[next].patch < end)
            ++next;
        part.leaf_count = next - part.first_leaf;
    }
}

} // namespace trimray
