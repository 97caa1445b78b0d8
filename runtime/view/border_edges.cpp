#include "runtime/view/border_edges.h"

#include <algorithm>
#include <cmath>

namespace trimray {
namespace {

using reference::cross;
using reference::dot;
using reference::length;
using reference::Vec3;
using reference::operator+;
using reference::operator-;
using reference::operator*;

constexpr double kFit = 1e-6; // of the face's longer side: what the converter lets a piece leave its curve by

double longer_side_mm(const PlacedSurface& surface)
{
    const float(&extent)[2] = surface.face().extent_mm;
    return surface.stretch() * double(std::max(extent[0], extent[1]));
}

struct ClassedPiece {
    MonotonePiece uv;
    uint edge_class = kEdgeSharp;
};
using Loop = std::vector<ClassedPiece>;

ClassedPiece line_piece(const UvPoint& from, const UvPoint& to, uint edge_class)
{
    ClassedPiece piece;
    piece.edge_class = edge_class;
    piece.uv.u[0] = from[0], piece.uv.v[0] = from[1];
    piece.uv.u[3] = to[0], piece.uv.v[3] = to[1];
    set_thirds(piece.uv);
    return piece;
}

/// The sides of the domain in a loop, cut where patches meet.
Loop natural_loop(const PlacedSurface& surface)
{
    // axis along which a side runs, the other's value, whether it runs downwards, its number in border_classes
    struct Side {
        size_t axis;
        double at;
        bool down;
        uint number;
    };
    constexpr Side kSides[] = {{0, 0, false, 2}, {1, 1, false, 1}, {0, 1, true, 3}, {1, 0, true, 0}};
    constexpr double kBeside = 1e-6;
    Loop loop;
    for (const Side& side : kSides) {
        std::vector<double> stops{0, 1};
        for (const PatchRecord& patch : surface.patches()) {
            if ((patch.shape & 0xffu) != kKindBezier)
                continue;
            const size_t across = 1 - side.axis;
            const double a = patch.uv_offset[across], b = a + patch.uv_scale[across];
            if (std::min(std::abs(a - side.at), std::abs(b - side.at)) > kBeside)
                continue;
            const double begin = patch.uv_offset[side.axis];
            for (const double stop : {begin, begin + patch.uv_scale[side.axis]})
                if (stop > kBeside && stop < 1 - kBeside)
                    stops.push_back(stop);
        }
        std::sort(stops.begin(), stops.end());
        stops.erase(std::unique(stops.begin(), stops.end(), [](double a, double b) { return b - a <= kBeside; }),
                    stops.end());
        stops.back() = 1;
        if (side.down)
            std::reverse(stops.begin(), stops.end());
        const uint edge_class = surface.face().border_classes >> 2 * side.number & 3u;
        for (size_t i = 0; i + 1 < stops.size(); ++i) {
            UvPoint from, to;
            from[side.axis] = stops[i], to[side.axis] = stops[i + 1];
            from[1 - side.axis] = to[1 - side.axis] = side.at;
            loop.push_back(line_piece(from, to, edge_class));
        }
    }
    return loop;
}

/// The chains of pieces that are drawn without a gap. One that comes back to its beginning ends there.
std::vector<Loop> trim_loops(const PackImage& image, const FaceRecord& face)
{
    std::vector<Loop> loops;
    bool joins = false; // the next piece belongs to the last loop, if it begins where that ends
    for (uint i = 0; i < face.piece_count; ++i) {
        const uint word = image.trim_pieces[face.first_piece + i];
        const ClassedPiece piece{load_piece(image.trim_points.data(), face.first_point, word),
                                 word >> kPieceClassShift & 3u};
        if (joins) {
            const MonotonePiece& last = loops.back().back().uv;
            joins = last.u[3] == piece.uv.u[0] && last.v[3] == piece.uv.v[0];
        }
        if (!joins)
            loops.emplace_back();
        loops.back().push_back(piece);
        const MonotonePiece& first = loops.back().front().uv;
        joins = first.u[0] != piece.uv.u[3] || first.v[0] != piece.uv.v[3];
    }
    return loops;
}

/// How a piece leaves its end (t = 1) or its beginning (t = 0).
struct PieceEnd {
    Vec3 direction{}, bend{}; // unit; curvature vector, 1/mm
    double chord_mm = 0;      // of the piece
};
PieceEnd piece_end(const PlacedSurface& surface, const MonotonePiece& piece, double t)
{
    constexpr double kStep = 1e-3, kVanishing = 1e-6;
    PieceEnd end;
    end.chord_mm = length(border_at(surface, piece, 1).p - border_at(surface, piece, 0).p);
    BorderJet jet = border_at(surface, piece, t);
    if (length(jet.d) <= kVanishing * end.chord_mm) // two control points in one place, or a pole
        jet = border_at(surface, piece, t > 0 ? 1 - kStep : kStep);
    const double speed = length(jet.d);
    if (speed > 0) {
        end.direction = jet.d * (1 / speed);
        end.bend = (jet.dd - end.direction * dot(jet.dd, end.direction)) * (1 / (speed * speed));
    }
    return end;
}

/// Whether the border turns, or its curvature jumps, by more than fitted pieces do along one edge.
bool is_corner(const PieceEnd& before, const PieceEnd& after, double fit_mm)
{
    constexpr double kTurn = 0.0175;      // rad: a degree
    constexpr double kJump = 0.3;         // of the larger curvature
    constexpr double kLeastTurning = 0.1; // rad, of the piece with it: less shows no arc
    const double chord = std::min(before.chord_mm, after.chord_mm);
    // a cubic that is off by fit may be off by 8 fit / chord in direction and 32 fit / chord^2 in curvature
    const double turn =
        std::atan2(length(cross(before.direction, after.direction)), dot(before.direction, after.direction));
    if (turn > kTurn + 8 * fit_mm / chord)
        return true;
    const double bend_before = length(before.bend), bend_after = length(after.bend);
    const PieceEnd& sharper = bend_before > bend_after ? before : after;
    const double larger = length(sharper.bend);
    return larger * sharper.chord_mm > kLeastTurning &&
           length(before.bend - after.bend) > kJump * larger + 32 * fit_mm / (chord * chord);
}

/// Cuts a loop at its corners. Pieces too short to have a direction go with the edge before them.
void cut_at_corners(const PlacedSurface& surface, const Loop& loop, std::vector<BorderEdge>& edges)
{
    constexpr double kTooShort = 10; // fits
    const double fit_mm = kFit * longer_side_mm(surface);
    const size_t count = loop.size();
    std::vector<size_t> long_ones;
    for (size_t i = 0; i < count; ++i) {
        const MonotonePiece& uv = loop[i].uv;
        const Vec3 from = border_at(surface, uv, 0).p, middle = border_at(surface, uv, 0.5).p;
        if (std::max(length(middle - from), length(border_at(surface, uv, 1).p - from)) > kTooShort * fit_mm)
            long_ones.push_back(i);
    }
    if (long_ones.empty())
        return;
    const MonotonePiece &first = loop.front().uv, &last = loop.back().uv;
    const bool closed = first.u[0] == last.u[3] && first.v[0] == last.v[3];
    std::vector<size_t> begins; // pieces at which an edge begins
    if (!closed)
        begins.push_back(0);
    for (size_t k = closed ? 0 : 1; k < long_ones.size(); ++k) {
        const ClassedPiece& before = loop[long_ones[(k + long_ones.size() - 1) % long_ones.size()]];
        const ClassedPiece& after = loop[long_ones[k]];
        if (before.edge_class != after.edge_class ||
            is_corner(piece_end(surface, before.uv, 1), piece_end(surface, after.uv, 0), fit_mm))
            begins.push_back(long_ones[k]);
    }
    if (begins.empty())
        begins.push_back(0); // round and round: one closed edge
    for (size_t k = 0; k < begins.size(); ++k) {
        const size_t from = begins[k], to = k + 1 < begins.size() ? begins[k + 1] : begins[0] + count;
        const size_t end = closed ? to : std::min(to, count);
        BorderEdge edge;
        edge.edge_class =
            loop[*std::find_if(long_ones.begin(), long_ones.end(), [&](size_t i) { return i >= from; })].edge_class;
        for (size_t i = from; i < end; ++i)
            edge.pieces.push_back(loop[i % count].uv);
        if (edge.edge_class != kEdgeSeam)
            edges.push_back(std::move(edge));
    }
}

/// The t in [lo, hi] at which f is least; f has one minimum there. Golden sections.
template <class F>
double least_at(F f, double lo, double hi)
{
    constexpr double kGolden = 0.6180339887498949;
    constexpr int kSections = 45; // of an interval below 1: down to where squares of distances tell no more
    double a = hi - kGolden * (hi - lo), b = lo + kGolden * (hi - lo), fa = f(a), fb = f(b);
    for (int i = 0; i < kSections; ++i) {
        if (fa < fb) {
            hi = b, b = a, fb = fa;
            a = hi - kGolden * (hi - lo), fa = f(a);
        } else {
            lo = a, a = b, fa = fb;
            b = lo + kGolden * (hi - lo), fb = f(b);
        }
    }
    return (lo + hi) / 2;
}

double distance_to_chord(const Vec3& p, const Vec3& a, const Vec3& b)
{
    const Vec3 along = b - a;
    const double square = dot(along, along), t = square > 0 ? std::clamp(dot(p - a, along) / square, 0.0, 1.0) : 0.0;
    return length(p - a - along * t);
}

} // namespace

std::vector<BorderEdge> border_edges(const PackImage& image, const PlacedSurface& surface)
{
    std::vector<BorderEdge> edges;
    if ((surface.face().flags & kFaceNaturalBorder) != 0)
        cut_at_corners(surface, natural_loop(surface), edges);
    else
        for (const Loop& loop : trim_loops(image, surface.face()))
            cut_at_corners(surface, loop, edges);
    return edges;
}

BorderJet border_at(const PlacedSurface& surface, const MonotonePiece& piece, double t)
{
    // C and its derivatives by t, and those of S(C(t)) by the chain rule
    double c[2], c1[2], c2[2];
    for (size_t k = 0; k < 2; ++k) {
        const double* p = k == 0 ? piece.u : piece.v;
        if (piece.cubic) {
            const double s = 1 - t;
            c[k] = bezier3(p, t);
            c1[k] = 3 * (s * s * (p[1] - p[0]) + 2 * s * t * (p[2] - p[1]) + t * t * (p[3] - p[2]));
            c2[k] = 6 * (s * (p[2] - 2 * p[1] + p[0]) + t * (p[3] - 2 * p[2] + p[1]));
        } else {
            c[k] = p[0] + t * (p[3] - p[0]);
            c1[k] = p[3] - p[0];
            c2[k] = 0;
        }
    }
    const SurfaceJet s = surface.at({c[0], c[1]});
    return {s.p, s.du * c1[0] + s.dv * c1[1],
            s.duu * (c1[0] * c1[0]) + s.duv * (2 * c1[0] * c1[1]) + s.dvv * (c1[1] * c1[1]) + s.du * c2[0] +
                s.dv * c2[1]};
}

double border_tolerance_mm(const PlacedSurface& surface)
{
    const FaceRecord& face = surface.face();
    const uint k_u = face.flags >> kFaceRimBit & kFaceRimMask,
               k_v = face.flags >> (kFaceRimBit + kFaceRimBits) & kFaceRimMask;
    double grown_mm = 3 * kFit * longer_side_mm(surface); // by its own fit, its neighbour's and rounding
    if (k_u > 0 && k_v > 0) {
        // a rim is as wide as the border is moved at most, at corners: kRimWidth times as far as elsewhere
        constexpr double kRimWidth = 4;
        const double rim_mm = std::min(std::ldexp(double(face.extent_mm[0]), -int(k_u)),
                                       std::ldexp(double(face.extent_mm[1]), -int(k_v)));
        grown_mm = surface.stretch() * rim_mm / kRimWidth;
    }
    return grown_mm + kFit * longer_side_mm(surface) +
           surface.stretch() * (2 * double(face.tolerance_mm) + double(face.deviation_mm));
}

std::optional<NearestEdge> nearest_edge(const PlacedSurface& surface, std::span<const BorderEdge> edges,
                                        const Vec3& point)
{
    constexpr int kChords = 8; // a piece; a whole circle's chords then leave it by 0.1 of their length
    struct Candidate {
        size_t edge;
        const MonotonePiece* piece;
        double chord_mm, distance_mm;
        int nearest; // chord
    };
    std::vector<Candidate> candidates;
    double best = std::numeric_limits<double>::infinity();
    for (size_t e = 0; e < edges.size(); ++e)
        for (const MonotonePiece& piece : edges[e].pieces) {
            Candidate candidate{e, &piece, 0, std::numeric_limits<double>::infinity(), 0};
            Vec3 from = border_at(surface, piece, 0).p;
            for (int i = 0; i < kChords; ++i) {
                const Vec3 to = border_at(surface, piece, (i + 1.0) / kChords).p;
                candidate.chord_mm = std::max(candidate.chord_mm, length(to - from));
                if (const double d = distance_to_chord(point, from, to); d < candidate.distance_mm) {
                    candidate.distance_mm = d;
                    candidate.nearest = i;
                }
                from = to;
            }
            best = std::min(best, candidate.distance_mm);
            candidates.push_back(candidate);
        }
    std::optional<NearestEdge> nearest;
    for (const Candidate& c : candidates) {
        if (c.distance_mm > best + c.chord_mm / 2)
            continue;
        const double lo = std::max((c.nearest - 1.0) / kChords, 0.0), hi = std::min((c.nearest + 2.0) / kChords, 1.0);
        const auto distance = [&](double t) { return length(border_at(surface, *c.piece, t).p - point); };
        double t = least_at(distance, lo, hi);
        for (const double end : {lo, hi})
            if (distance(end) <= distance(t))
                t = end;
        if (const double d = distance(t); !nearest || d < nearest->distance_mm)
            nearest = NearestEdge{c.edge, border_at(surface, *c.piece, t).p, d};
    }
    return nearest;
}

} // namespace trimray
