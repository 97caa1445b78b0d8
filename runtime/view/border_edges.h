// The border of a face as edges: chains of the pieces of its trims, or of its domain's sides, from corner to corner. A
// pack does not say where an edge of the file ends; here one ends where the class changes, where the border turns, and
// where its curvature jumps, as from a line to an arc.
#pragma once

#include "format/trim_piece.h"
#include "runtime/view/placed_surface.h"

#include <optional>
#include <vector>

namespace trimray {

struct BorderEdge {
    std::vector<MonotonePiece> pieces; // uv_face, each begins where the one before it ends
    uint edge_class = kEdgeSharp;      // kEdge...
};

/// All edges but seams, poles and lines that close gaps, loop by loop.
std::vector<BorderEdge> border_edges(const PackImage& image, const PlacedSurface& surface);

/// A point of a piece on the surface and its derivatives by t in [0, 1], world mm.
struct BorderJet {
    reference::Vec3 p{}, d{}, dd{};
};
BorderJet border_at(const PlacedSurface& surface, const MonotonePiece& piece, double t);

/// How far a border may be off the file's edge in the world, mm: by what the converter allows a piece, by what it moves
/// borders outwards so that neighbours overlap, and by what the file itself allows its edges and the surface. Where
/// neighbours in the file miss each other by more, borders are moved by as much; a pack says so of faces with rims
/// alone.
double border_tolerance_mm(const PlacedSurface& surface);

struct NearestEdge {
    size_t edge = 0; // of those given
    reference::Vec3 foot_mm{};
    double distance_mm = 0;
};

/// The place of all edges that is nearest to a point in the world; nothing where there are no edges.
std::optional<NearestEdge> nearest_edge(const PlacedSurface& surface, std::span<const BorderEdge> edges,
                                        const reference::Vec3& point);

} // namespace trimray
