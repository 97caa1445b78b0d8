#include "format/derive_kd.h"

#include "format/alike_trims.h"
#include "format/monotone_set.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

namespace trimray {
namespace {

// What a query costs, in units of one step down the tree.
constexpr double kRunCost = 2;    // reading a run and comparing with its box
constexpr double kSearchCost = 1; // a step of the binary search
constexpr double kLineCost = 1;
constexpr double kCubicCost = 6; // bisection: few steps away from the curve, 24 beside it
// A further node of a face with n pieces must save at least this / n of a step a query.
constexpr double kNodeWorth = 0.05;
constexpr uint kPatience = 2;       // planes that do not pay by themselves, below each other
constexpr double kLeastSide = 1e-6; // no node is narrower: a float near 1 has few values there
constexpr size_t kQuantiles = 12;   // of the ends in a node, where there are more

constexpr uint kMostFacePieces = 1u << 26;        // of four points at most: run and piece words number 2^28
constexpr size_t kMostElements = size_t{1} << 30; // of an array; a lane's offset in floats has 31 bits

struct Box {
    std::array<double, 2> lo{}, hi{}; // [lo, hi) in u and in v

    double area() const { return (hi[0] - lo[0]) * (hi[1] - lo[1]); }
};

/// Pieces first .. last of a set, and the part of them within the box at hand: from its lower end to its upper one.
struct ClippedRun {
    uint set, first, last;
    std::array<std::array<double, 2>, 2> end; // u, v of the lower and of the upper end

    double lo(int axis) const { return std::min(end[0][axis], end[1][axis]); }
    double hi(int axis) const { return std::max(end[0][axis], end[1][axis]); }
    uint piece_count() const { return last - first + 1; }
};
using Runs = std::vector<ClippedRun>;

struct FaceTree {
    std::vector<KdNode> nodes;
    std::vector<KdRun> runs;
    std::vector<float> points;

    size_t size_bytes() const
    {
        return nodes.size() * sizeof(KdNode) + runs.size() * sizeof(KdRun) + points.size() * sizeof(float);
    }
};

class TreeBuilder {
public:
    explicit TreeBuilder(const MonotoneSets& all) : all_(all) {}

    FaceTree build()
    {
        Runs runs;
        const double infinity = std::numeric_limits<double>::infinity();
        const Box plane{{-infinity, -infinity}, {infinity, infinity}};
        for (uint s = 0; s < all_.sets.size(); ++s) {
            const uint last = all_.sets[s].piece_count - 1;
            const Joint a = joint(all_, all_.sets[s], 0), b = joint(all_, all_.sets[s], last + 1);
            runs.push_back({s, 0, last, {{{a.u, a.v}, {b.u, b.v}}}});
        }
        const Box domain{{0, 0}, {1, 1}};
        Runs within = runs;
        for (int axis = 0; axis < 2; ++axis)
            for (const bool upper : {false, true})
                within = clipped(within, axis, upper ? domain.lo[axis] : domain.hi[axis], upper, domain);
        size_t pieces = 0;
        for (const ClippedRun& run : within)
            pieces += run.piece_count();
        node_worth_ = kNodeWorth / static_cast<double>(std::max<size_t>(pieces, 1));
        const bool inside = class_after({plane, runs, false}, domain, within);
        const uint root = draft({domain, std::move(within), inside}, 1, kPatience);

        FaceTree tree;
        tree.nodes.resize(1);
        emit(drafts_[root], 0, tree);
        tree.points = all_.points;
        return tree;
    }

private:
    /// A rectangle, what passes through it, and the class at the end of its rays (kd_layout.h).
    struct Region {
        Box box;
        Runs runs;
        bool inside = false;
    };
    /// A node that may still be taken back.
    struct Draft {
        Region region; // of a leaf
        int axis = -1; // -1: a leaf
        float plane = 0;
        std::array<uint, 2> child{};
        double cost = 0;  // of a query that comes here
        size_t nodes = 1; // of the subtree
    };
    struct Plane {
        int axis;
        float at;
        double cost;
    };

    // ---- runs ------------------------------------------------------------------------------------------------------
    const MonotoneSet& set_of(const ClippedRun& run) const { return all_.sets[run.set]; }
    double piece_cost(const ClippedRun& run) const { return set_of(run).cubic ? kCubicCost : kLineCost; }

    /// kd_layout.h, crossed(run), in double.
    bool crossed(const ClippedRun& run, const Box& box, double u, double v) const
    {
        const MonotoneSet& set = set_of(run);
        const Joint a = joint(all_, set, run.first), b = joint(all_, set, run.last + 1);
        if (v < a.v)
            return a.u >= box.hi[0];
        if (v >= b.v)
            return b.u >= box.hi[0];
        uint first = run.first, count = run.piece_count();
        while (count > 1) {
            const uint half = count / 2;
            const bool beyond = joint(all_, set, first + half).v <= v;
            first += beyond ? half : 0;
            count = beyond ? count - half : half;
        }
        const MonotonePiece piece = set_piece(all_, set, first);
        return u < piece.u_lo() || (u < piece.u_hi() && u < u_at_v(piece, v));
    }

    /// Whether u falls along the run; v never does.
    bool u_falls(const ClippedRun& run) const
    {
        return joint(all_, set_of(run), set_of(run).piece_count).u < joint(all_, set_of(run), 0).u;
    }

    /// First piece of the run that ends beyond `at`, in the direction in which the run goes.
    uint first_ending_beyond(const ClippedRun& run, int axis, bool falls, double at) const
    {
        uint first = run.first, count = run.last - run.first;
        while (count > 0) {
            const uint half = count / 2;
            const Joint end = joint(all_, set_of(run), first + half + 1);
            const double x = axis == 0 ? end.u : end.v;
            if (falls ? x < at : x > at) {
                count = half;
            } else {
                first += half + 1;
                count -= half + 1;
            }
        }
        return first;
    }

    /// The run's part on one side of a plane: at and above it, or below. Nothing is left of what only touches it: on
    /// either side that is the same for all queries.
    std::optional<ClippedRun> clipped(const ClippedRun& run, int axis, double plane, bool upper) const
    {
        if (upper ? run.hi(axis) <= plane : run.lo(axis) >= plane)
            return std::nullopt;
        if (upper ? run.lo(axis) >= plane : run.hi(axis) <= plane)
            return run;
        const bool falls = axis == 0 && u_falls(run);
        ClippedRun part = run;
        const int cut = upper != falls ? 0 : 1; // the end that is cut off
        uint k = first_ending_beyond(run, axis, falls, plane);
        if (cut == 0) {
            part.first = k;
        } else {
            // the last that begins before the plane; between the two lie pieces along it
            while (k > run.first && begins_at(run, k, axis, plane))
                --k;
            part.last = k;
        }
        const MonotonePiece piece = set_piece(all_, set_of(run), k);
        part.end[cut][axis] = plane;
        part.end[cut][1 - axis] = axis == 0 ? v_at_u(piece, plane) : u_at_v(piece, plane);
        return part;
    }
    bool begins_at(const ClippedRun& run, uint k, int axis, double at) const
    {
        const Joint begin = joint(all_, set_of(run), k);
        return (axis == 0 ? begin.u : begin.v) == at;
    }

    /// Whether piece k lies along a side of the box, or beyond.
    bool along_a_side(const ClippedRun& run, uint k, const Box& box) const
    {
        const Joint a = joint(all_, set_of(run), k), b = joint(all_, set_of(run), k + 1);
        return (a.u == b.u && (a.u <= box.lo[0] || a.u >= box.hi[0])) ||
               (a.v == b.v && (a.v <= box.lo[1] || a.v >= box.hi[1]));
    }

    /// Of the runs, which lie on both sides of a plane through a larger box, those parts that are in the box. Nothing
    /// is left of pieces along its sides.
    Runs clipped(const Runs& runs, int axis, double plane, bool upper, const Box& box) const
    {
        Runs out;
        for (const ClippedRun& run : runs) {
            std::optional<ClippedRun> part = clipped(run, axis, plane, upper);
            if (!part)
                continue;
            for (; part->first < part->last && along_a_side(*part, part->first, box); ++part->first) {
                const Joint end = joint(all_, set_of(run), part->first + 1);
                part->end[0] = {end.u, end.v};
            }
            for (; part->first < part->last && along_a_side(*part, part->last, box); --part->last) {
                const Joint end = joint(all_, set_of(run), part->last);
                part->end[1] = {end.u, end.v};
            }
            if (!along_a_side(*part, part->first, box))
                out.push_back(*part);
        }
        return out;
    }

    /// The class of a part of a region, from what changes between them: it is the same for all queries, so any tells.
    bool class_after(const Region& whole, const Box& box, const Runs& runs) const
    {
        const double u = 0.5 * (box.lo[0] + box.hi[0]), v = 0.5 * (box.lo[1] + box.hi[1]);
        bool inside = whole.inside;
        for (const ClippedRun& run : whole.runs)
            inside ^= crossed(run, whole.box, u, v);
        for (const ClippedRun& run : runs)
            inside ^= crossed(run, box, u, v);
        return inside;
    }

    /// Whether a run answers the same throughout the box, and what: one that lies along a line of constant v, and whose
    /// ends are both left of the box's right side or both not.
    std::optional<bool> constant_answer(const ClippedRun& run, const Box& box) const
    {
        const Joint a = joint(all_, set_of(run), run.first), b = joint(all_, set_of(run), run.last + 1);
        const bool below = a.u >= box.hi[0], above = b.u >= box.hi[0];
        return a.v == b.v && below == above ? std::optional(below) : std::nullopt;
    }

    /// The region as a leaf has it. Parts of it may need the runs that the whole does not.
    Region without_constant_runs(Region region) const
    {
        std::erase_if(region.runs, [&](const ClippedRun& run) {
            const std::optional<bool> answer = constant_answer(run, region.box);
            region.inside ^= answer.value_or(false);
            return answer.has_value();
        });
        return region;
    }

    // ---- costs -----------------------------------------------------------------------------------------------------
    /// Of reading the run and, in the share of the box that its pieces' boxes take, of solving one.
    static double run_cost(double solved_share, double piece_count, double piece_cost)
    {
        // n pieces of a run of about equal size take 1 / n of the run's box
        return kRunCost + solved_share * (kSearchCost * std::log2(piece_count) + piece_cost / piece_count);
    }

    double leaf_cost(const Region& region) const
    {
        double cost = 0;
        for (const ClippedRun& run : region.runs) {
            if (constant_answer(run, region.box))
                continue;
            // the run's box is that of its whole pieces
            const Joint a = joint(all_, set_of(run), run.first), b = joint(all_, set_of(run), run.last + 1);
            const auto [u_lo, u_hi] = std::minmax(a.u, b.u);
            const double u = std::min(u_hi, region.box.hi[0]) - std::max(u_lo, region.box.lo[0]);
            const double v = std::min(b.v, region.box.hi[1]) - std::max(a.v, region.box.lo[1]);
            const double share = std::max(u, 0.0) * std::max(v, 0.0) / region.box.area();
            cost += run_cost(share, run.piece_count(), piece_cost(run));
        }
        return cost;
    }

    /// Of a query if the region were divided by the plane and its parts were leaves, tight around what is in them.
    double split_cost(const Region& region, int axis, double plane) const
    {
        const Box& box = region.box;
        const double area = box.area();
        const double low_share = (plane - box.lo[axis]) / (box.hi[axis] - box.lo[axis]);
        double cost = 1;
        for (const ClippedRun& run : region.runs) {
            const double lo = run.lo(axis), hi = run.hi(axis);
            if (lo == plane && hi == plane)
                continue; // along the plane: in neither part
            const double share = (hi - lo) * (run.hi(1 - axis) - run.lo(1 - axis)) / area;
            const double low = hi > lo ? std::clamp((plane - lo) / (hi - lo), 0.0, 1.0) : (plane > lo ? 1 : 0);
            for (const auto& [part, part_share] : {std::pair{low, low_share}, std::pair{1 - low, 1 - low_share}})
                if (part > 0) // the run as its chord: its box shrinks on both sides
                    cost += part_share * run_cost(part * part * share / part_share,
                                                  std::max(1.0, part * run.piece_count()), piece_cost(run));
        }
        return cost;
    }

    /// Ends of what lies in the region, and places between.
    std::vector<float> candidate_planes(const Region& region, int axis) const
    {
        std::vector<double> ends;
        for (const ClippedRun& run : region.runs)
            ends.insert(ends.end(), {run.end[0][axis], run.end[1][axis]});
        std::sort(ends.begin(), ends.end());
        ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
        std::vector<double> places;
        for (size_t i = 0; i < std::min(ends.size(), kQuantiles); ++i)
            places.push_back(ends[ends.size() <= kQuantiles ? i : (i * (ends.size() - 1)) / (kQuantiles - 1)]);
        for (size_t i = 0; i + 1 < ends.size() && ends.size() <= kQuantiles; ++i)
            places.push_back(0.5 * (ends[i] + ends[i + 1]));
        const double lo = region.box.lo[axis], hi = region.box.hi[axis];
        for (const double share : {0.25, 0.5, 0.75})
            places.push_back(lo + share * (hi - lo));
        std::vector<float> planes;
        for (const double place : places)
            if (const float plane = static_cast<float>(place); plane >= lo + kLeastSide && plane <= hi - kLeastSide)
                planes.push_back(plane);
        return planes;
    }

    std::optional<Plane> best_plane(const Region& region) const
    {
        std::optional<Plane> best;
        for (int axis = 0; axis < 2; ++axis)
            for (const float at : candidate_planes(region, axis)) {
                const double cost = split_cost(region, axis, at);
                if (!best || cost < best->cost)
                    best = Plane{axis, at, cost};
            }
        return best;
    }

    // ---- the tree --------------------------------------------------------------------------------------------------
    Region part_of(const Region& region, const Plane& plane, bool upper) const
    {
        Region part;
        part.box = region.box;
        (upper ? part.box.lo : part.box.hi)[plane.axis] = plane.at;
        part.runs = clipped(region.runs, plane.axis, plane.at, upper, part.box);
        part.inside = class_after(region, part.box, part.runs);
        return part;
    }

    /// Drafts the region's subtree and returns its place in drafts_.
    uint draft(Region region, uint depth, uint patience)
    {
        Draft leaf;
        leaf.cost = leaf_cost(region);
        const double share = region.box.area();
        // not even a subtree that costs nothing would save its two nodes' worth
        std::optional<Plane> plane;
        if (share * leaf.cost > 2 * node_worth_ && depth < kMaxKdDepth)
            plane = best_plane(region);
        if (plane) {
            const bool pays = share * (leaf.cost - plane->cost) > 2 * node_worth_;
            patience = pays ? kPatience : patience - 1;
        }
        if (plane && patience > 0) {
            const size_t drafted = drafts_.size();
            Draft node;
            node.axis = plane->axis;
            node.plane = plane->at;
            node.cost = 1;
            for (const bool upper : {false, true}) {
                Region part = part_of(region, *plane, upper);
                const double part_share = part.box.area() / share;
                node.child[upper] = draft(std::move(part), depth + 1, patience);
                node.cost += part_share * drafts_[node.child[upper]].cost;
                node.nodes += drafts_[node.child[upper]].nodes;
            }
            const double worth = node_worth_ * static_cast<double>(node.nodes - 1);
            if (!same_leaf(node) && share * (leaf.cost - node.cost) > worth) {
                drafts_.push_back(std::move(node));
                return static_cast<uint>(drafts_.size() - 1);
            }
            if (same_leaf(node)) {
                region.runs.clear();
                region.inside = drafts_[node.child[0]].region.inside;
                leaf.cost = 0;
            }
            drafts_.resize(drafted);
        }
        leaf.region = without_constant_runs(std::move(region));
        drafts_.push_back(std::move(leaf));
        return static_cast<uint>(drafts_.size() - 1);
    }

    /// Whether both children are leaves without runs, of one class: pieces that lie on each other.
    bool same_leaf(const Draft& node) const
    {
        const Draft &a = drafts_[node.child[0]], &b = drafts_[node.child[1]];
        return a.axis < 0 && b.axis < 0 && a.region.runs.empty() && b.region.runs.empty() &&
               a.region.inside == b.region.inside;
    }

    KdRun run_record(const ClippedRun& run, const Box& box) const
    {
        const MonotoneSet& set = set_of(run);
        const uint first_point = set.first_point + run.first * set.points_a_piece();
        const bool below = joint(all_, set, run.first).u >= box.hi[0];
        const bool above = joint(all_, set, run.last + 1).u >= box.hi[0];
        return {first_point << kKdPointShift | (set.cubic ? kKdRunCubic : 0) | (below ? kKdRunBelow : 0) |
                    (above ? kKdRunAbove : 0),
                run.piece_count()};
    }

    void emit(const Draft& node, size_t at, FaceTree& tree) const
    {
        if (node.axis >= 0) {
            const auto first_child = static_cast<uint>(tree.nodes.size());
            tree.nodes[at] = {(node.axis == 0 ? kKdSplitU : kKdSplitV) | first_child << kKdNumberShift,
                              std::bit_cast<uint>(node.plane)};
            tree.nodes.resize(tree.nodes.size() + 2);
            emit(drafts_[node.child[0]], first_child, tree);
            emit(drafts_[node.child[1]], first_child + 1, tree);
            return;
        }
        const Region& region = node.region;
        const uint inside = region.inside ? kKdInside : 0;
        if (region.runs.size() > 1) {
            tree.nodes[at] = {kKdLeafRuns | inside | static_cast<uint>(region.runs.size()) << kKdNumberShift,
                              static_cast<uint>(tree.runs.size())};
            for (const ClippedRun& run : region.runs)
                tree.runs.push_back(run_record(run, region.box));
            return;
        }
        const KdRun run = region.runs.empty() ? KdRun{0, 0} : run_record(region.runs[0], region.box);
        tree.nodes[at] = {kKdLeafRun | inside | run.piece_count << kKdNumberShift, run.word};
    }

    const MonotoneSets& all_;
    double node_worth_ = 0;
    std::vector<Draft> drafts_;
};

FaceTree face_tree(const PackImage& image, const FaceRecord& face)
{
    if (face.piece_count != 0)
        return TreeBuilder(monotone_sets(image, face)).build();
    FaceTree tree; // a natural border is all in; a face without any trims has no inside
    tree.nodes.push_back({kKdLeafRun | ((face.flags & kFaceNaturalBorder) != 0 ? kKdInside : 0), 0});
    return tree;
}

struct FaceTrees {
    std::vector<FaceTree> built; // of the first face of each kind
    std::vector<uint> alike;

    const FaceTree& of(size_t face) const { return built[alike[face]]; }
};

FaceTrees face_trees(const PackImage& image)
{
    FaceTrees trees{std::vector<FaceTree>(image.faces.size()), first_alike(image)};
    tbb::parallel_for(size_t{0}, image.faces.size(), [&](size_t f) {
        if (trees.alike[f] == f)
            trees.built[f] = face_tree(image, image.faces[f]);
    });
    return trees;
}

} // namespace

size_t KdTrims::size_bytes() const
{
    return nodes.size() * sizeof(KdNode) + runs.size() * sizeof(KdRun) + points.size() * sizeof(float) +
           faces.size() * sizeof(KdFace);
}

Result<KdTrims> derive_kd(const PackImage& image)
{
    size_t pieces = 0;
    for (size_t f = 0; f < image.faces.size(); ++f) {
        pieces += image.faces[f].piece_count;
        if (image.faces[f].piece_count > kMostFacePieces)
            return Error{ErrorCode::UnsupportedPackFeature, fmt::format("face {}", f),
                         fmt::format("{} trim pieces are too many for a kd-tree", image.faces[f].piece_count)};
    }
    // otherwise a small pack could ask for any amount of work and memory
    if (pieces > image.trim_pieces.size())
        return Error{ErrorCode::InvalidPack, "FACE",
                     fmt::format("the faces have {} trim pieces together, the pack has {}: a kd-tree needs faces that "
                                 "share none",
                                 pieces, image.trim_pieces.size())};

    const FaceTrees trees = face_trees(image);
    KdTrims out;
    for (size_t f = 0; f < image.faces.size(); ++f) {
        const FaceTree& tree = trees.of(f);
        out.faces.push_back({static_cast<uint>(out.nodes.size()), static_cast<uint>(out.runs.size()),
                             static_cast<uint>(out.points.size() / 2)});
        out.nodes.insert(out.nodes.end(), tree.nodes.begin(), tree.nodes.end());
        out.runs.insert(out.runs.end(), tree.runs.begin(), tree.runs.end());
        out.points.insert(out.points.end(), tree.points.begin(), tree.points.end());
        if (std::max({out.nodes.size(), out.runs.size(), out.points.size()}) > kMostElements)
            return Error{ErrorCode::UnsupportedPackFeature, fmt::format("face {}", f),
                         "the pack has too many trim pieces for kd-trees"};
    }
    return out;
}

double kd_trim_bytes(const PackImage& image)
{
    const FaceTrees trees = face_trees(image);
    double bytes = 0;
    for (size_t f = 0; f < image.faces.size(); ++f)
        bytes += static_cast<double>(trees.of(f).size_bytes() + sizeof(KdFace));
    return bytes;
}

} // namespace trimray
