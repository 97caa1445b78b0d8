// Measurements of picked places: of one, between two, and of an edge. Values in mm and degrees with the points in the
// world between which they are drawn, and how they read in a unit.
#pragma once

#include "runtime/view/edge_measure.h"
#include "runtime/view/surface_facts.h"

#include <string>
#include <vector>

namespace trimray {

enum class DimensionKind {
    // between two
    Distance, // of the picked points; then its parts along the world's axes, with their signs from a to b
    DistanceX,
    DistanceY,
    DistanceZ,
    PlaneAngle,        // 0 to 90 degrees, as all angles between planes and axes
    PlaneDistance,     // of parallel planes
    PlaneAxisAngle,    // 0: the axis runs along the plane
    PlaneAxisDistance, // of an axis along a plane
    AxisAngle,
    AxisDistance,       // the shortest, of parallel and of skew axes; 0: they meet, or are one
    CentreDistance,     // of spheres and tori
    PlanePointDistance, // of the other's picked point
    AxisPointDistance,
    EqualDiameter, // both have it
    // of one
    Radius,
    Diameter,
    TubeRadius,
    HalfAngle,
    SmallestRadius, // of curvature, of a surface that has no other; infinite radii are left out
    LargestRadius,
    // of an edge
    EdgeLength,
    EdgeRadius,
    EdgeDiameter,
    EdgeSweep, // the angle of an arc
};

enum class DimensionUnit { Millimetre, Degree };

struct Dimension {
    DimensionKind kind = DimensionKind::Distance;
    DimensionUnit unit = DimensionUnit::Millimetre;
    double value = 0;
    // it is off from the file's by no more, as far as the pack tells (border_tolerance_mm), in its unit; 0: by the
    // pack's own rounding alone
    double error = 0;
    std::vector<reference::Vec3> anchors_mm; // from, to; of an arc from, its centre, to; may be empty
};

/// Planes and axes that differ by less are parallel: a thousandth of a degree, which is more than a pack's rounding and
/// less than what anyone draws.
inline constexpr double kParallel_deg = 1e-3;
/// Radii that differ by less, as a share, are equal: more than a pack's rounding.
inline constexpr double kEqualRadius = 1e-6;

/// Of one place: radii and angles of its surface.
std::vector<Dimension> dimensions_of(const SurfaceFacts& facts);
/// Between two places, the distance first.
std::vector<Dimension> dimensions_between(const SurfaceFacts& a, const SurfaceFacts& b);
/// Of an edge, the length first.
std::vector<Dimension> dimensions_of(const EdgeFacts& edge);

enum class LengthUnit { Millimetre, Centimetre, Metre, Inch };

/// "distance", "angle between planes": in lower case.
const char* name_of(DimensionKind kind);

/// "12.5 mm", "0.492126 in": seven digits, but none below a tenth of a micrometre nor, where it is given, below the
/// error, and no zeros at the end.
std::string length_text(double mm, LengthUnit unit, double error_mm = 0);
/// "45°": likewise, at most four digits after the point.
std::string angle_text(double degrees, double error_deg = 0);
/// The value alone, as far as it is known. Lengths in the given unit.
std::string to_text(const Dimension& dimension, LengthUnit unit);

} // namespace trimray
