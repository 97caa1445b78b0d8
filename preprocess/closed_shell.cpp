#include "preprocess/closed_shell.h"

#include "format/trim_piece.h"
#include "preprocess/bezier_patch.h"
#include "preprocess/trims/trim_grow.h"
#include "preprocess/vec3d.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace trimray {
namespace {

/// Integrals over a face, or several: of dA, of p dA, of the outward n dA, and of p . n dA.
struct Moments {
    double area = 0, flux = 0;
    Vec3d point, normal;

    void add(const Moments& other)
    {
        area += other.area;
        flux += other.flux;
        point = point + other.point;
        normal = normal + other.normal;
    }

    /// Three times the volume: the flux of p through the shell, p counted from its middle, so that errors are small.
    double volume3() const { return area > 0 ? flux - dot((1 / area) * point, normal) : 0; }
};

/// Where the line at v crosses the loops, in order of u; of a natural border the domain's two sides.
std::vector<double> crossings_at(const std::vector<MonotonePiece>& pieces, double v)
{
    if (pieces.empty())
        return {0, 1};
    std::vector<double> u;
    for (const MonotonePiece& piece : pieces)
        if (piece.v_lo() <= v && v < piece.v_hi())
            u.push_back(u_at_v(piece, v));
    std::sort(u.begin(), u.end());
    return u;
}

Moments moments_of(const CadFace& face, const TrimLoops& trims)
{
    constexpr int kRows = 8, kColumns = 8; // of samples: for a sign
    std::vector<MonotonePiece> pieces;
    for (const uint32_t word : trims.pieces)
        pieces.push_back(load_piece(trims.points.data(), 0, word));
    const Vec2d size{trims.domain.hi.x - trims.domain.lo.x, trims.domain.hi.y - trims.domain.lo.y};
    Moments sum;
    for (int row = 0; row < kRows; ++row) {
        const double v = (row + 0.5) / kRows;
        const std::vector<double> u = crossings_at(pieces, v);
        for (size_t i = 0; i + 1 < u.size(); i += 2)
            for (int column = 0; column < kColumns; ++column) {
                const double at = std::lerp(u[i], u[i + 1], (column + 0.5) / kColumns);
                const SurfaceDerivatives s =
                    evaluate(face.surface, trims.domain.lo.x + at * size.x, trims.domain.lo.y + v * size.y);
                const double share = (u[i + 1] - u[i]) * size.x * size.y / (kRows * kColumns);
                const Vec3d n = (face.reversed ? -share : share) * cross(s.du, s.dv);
                const double area = norm(n);
                sum.add({area, dot(s.p, n), area * s.p, n});
            }
    }
    return sum;
}

/// Sets of faces; each names another of its set, the first itself.
class Sets {
public:
    explicit Sets(size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), size_t{0}); }
    size_t first_of(size_t i)
    {
        while (parent_[i] != i)
            i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(size_t a, size_t b)
    {
        a = first_of(a), b = first_of(b);
        parent_[std::max(a, b)] = std::min(a, b);
    }

private:
    std::vector<size_t> parent_;
};

/// What an edge's uses by converted faces are.
struct EdgeWalks {
    int forward = 0, backward = 0;
    size_t face = 0; // one of them
};

} // namespace

ClosedShells find_closed_shells(const std::vector<ShellFace>& faces, size_t edge_count)
{
    std::vector<EdgeWalks> edges(edge_count);
    Sets sets(faces.size());
    const auto visit_uses = [&](auto&& visit) {
        for (size_t f = 0; f < faces.size(); ++f)
            if (faces[f].trims)
                for (const CadLoop& loop : faces[f].cad->loops)
                    for (const CadEdgeUse& use : loop)
                        if (!use.degenerate)
                            visit(f, use);
    };
    std::vector<uint8_t> closed(faces.size());
    visit_uses([&](size_t f, const CadEdgeUse& use) {
        EdgeWalks& walks = edges[use.edge];
        if (walks.forward + walks.backward > 0)
            sets.join(walks.face, f);
        walks.face = f;
        ++(use.reversed != faces[f].cad->reversed ? walks.backward : walks.forward);
        closed[f] = 1;
    });
    // from here on closed[] of a set's first face speaks for the set
    const std::vector<uint8_t> has_edges = std::exchange(closed, std::vector<uint8_t>(faces.size(), 1));
    visit_uses([&](size_t f, const CadEdgeUse& use) {
        const EdgeWalks& walks = edges[use.edge];
        if (walks.forward != 1 || walks.backward != 1)
            closed[sets.first_of(f)] = 0;
    });
    std::vector<Moments> moments(faces.size());
    for (size_t f = 0; f < faces.size(); ++f)
        if (has_edges[f] && closed[sets.first_of(f)])
            moments[sets.first_of(f)].add(moments_of(*faces[f].cad, *faces[f].trims));
    ClosedShells found;
    found.in_one.resize(faces.size());
    double volume3 = 0;
    for (size_t f = 0; f < faces.size(); ++f) {
        const size_t first = sets.first_of(f);
        const bool closes = has_edges[f] && closed[first];
        found.in_one[f] = closes && moments[first].volume3() > 0;
        volume3 += closes && first == f ? moments[f].volume3() : 0; // of a void it is negative, and its solid's larger
    }
    found.inside_out = volume3 < 0;
    for (const EdgeWalks& walks : edges)
        found.disputed_edges += walks.forward + walks.backward == 2 && walks.forward != 1;
    return found;
}

uint32_t rim_flags(const CadSurface& surface, const TrimLoops& trims)
{
    if (!(trims.largest_growth_mm > 0))
        return 0;
    constexpr int kSamples = 5;         // a side
    constexpr double kLeastShare = 0.2; // as grow_loops measures lengths, where a surface collapses
    const double reach_mm = kGrowReach * trims.largest_growth_mm;
    const SurfaceExtent extent = surface_extent(surface, trims.domain);
    const Vec2d size{trims.domain.hi.x - trims.domain.lo.x, trims.domain.hi.y - trims.domain.lo.y};
    // a disc of radius r on the surface spans r |S_v| / |S_u x S_v| of u on each side, and likewise of v
    Vec2d widest;
    for (int i = 0; i < kSamples; ++i)
        for (int j = 0; j < kSamples; ++j) {
            const SurfaceDerivatives s = evaluate(surface, trims.domain.lo.x + i * size.x / (kSamples - 1),
                                                  trims.domain.lo.y + j * size.y / (kSamples - 1));
            const Vec3d du = size.x * s.du, dv = size.y * s.dv;
            const double root = norm(cross(du, dv));
            const auto width = [&](double other_mm, double length_mm) {
                const double most = 1 / (kLeastShare * length_mm);
                return root > 0 ? std::min(other_mm / root, most) : most;
            };
            widest = {std::max(widest.x, width(norm(dv), extent.length_u_mm)),
                      std::max(widest.y, width(norm(du), extent.length_v_mm))};
        }
    // the least power of two that is no narrower
    const auto field = [&](double per_mm) {
        return static_cast<uint32_t>(std::clamp(-std::ceil(std::log2(reach_mm * per_mm)), 1.0, double(kFaceRimMask)));
    };
    return field(widest.x) << kFaceRimBit | field(widest.y) << (kFaceRimBit + kFaceRimBits);
}

} // namespace trimray
