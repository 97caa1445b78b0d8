// An edge measured: its length on the surface, its ends, and whether it is a straight line or a circle.
#pragma once

#include "runtime/view/border_edges.h"
#include "runtime/view/surface_facts.h"

#include <optional>
#include <vector>

namespace trimray {

enum class EdgeShape { Straight, Circle, Other };

struct EdgeFacts {
    uint edge_class = kEdgeSharp; // kEdge...
    double length_mm = 0;
    double length_error_mm = 0;     // of the sum, by the two rules of quadrature: more than it is off
    double border_tolerance_mm = 0; // how far the border may lie from the file's edge
    // What that may change the length by: a curve beside another, ends moved, is longer or shorter by the distance
    // times the angle that it turns by, all turns added up
    double beside_error_mm = 0;
    reference::Vec3 from_mm{}, to_mm{};
    bool closed = false; // its ends are one point

    EdgeShape shape = EdgeShape::Other;
    double off_shape_mm = 0; // the farthest of its points from the line or circle
    double radius_mm = 0;    // of a circle, with what it may be off by
    double radius_error_mm = 0;
    reference::Vec3 centre_mm{}, axis{}; // of a circle; unit

    std::vector<reference::Vec3> line_mm; // points along it, for drawing
};

EdgeFacts measure_edge(const PlacedSurface& surface, const BorderEdge& edge);

struct PickedEdge {
    EdgeFacts facts;
    reference::Vec3 foot_mm{}; // its point nearest to the picked one
    double distance_mm = 0;    // of both
};

/// The edge of the picked face that is nearest to the picked point; nothing where the face has none.
std::optional<PickedEdge> picked_edge(const PackImage& image, const SurfaceFacts& picked);

} // namespace trimray
