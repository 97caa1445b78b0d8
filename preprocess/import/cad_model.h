// CadModel: a CAD file's model in our own structs, in double and in millimetres. cad_import fills it; nothing after it
// sees the CAD kernel. Surfaces and curves are as in the file (no approximation unless deviation_mm says so).
#pragma once

#include "format/pack_layout.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace trimray {

struct Vec2d {
    double x = 0, y = 0;
};
struct Vec3d {
    double x = 0, y = 0, z = 0;
};
struct Rect2d {
    Vec2d lo, hi;
};

/// A B-spline curve in uv_file. Clamped or not, never periodic (the importer unrolls periods).
/// Shapes: knots are flat (multiplicities written out), n + degree + 1 of them for n control points.
/// control_points are (w x, w y, w); polynomial curves have w = 1 everywhere and rational = false.
struct SplineCurve2d {
    int degree = 1;
    bool rational = false;
    std::vector<double> knots;
    std::vector<std::array<double, 3>> control_points;
};

/// What became of a pcurve that runs farther from its edge's curve than the edge's tolerance.
enum class PcurveState : uint8_t {
    WithinTolerance,
    Rebuilt,     // replaced by the curve's projection onto the surface, which is much nearer
    Small,       // kept: less than the pack resolves
    OffSurface,  // kept: it is the curve that lies off the surface
    NotBettered, // kept: no projection is much nearer
    NotMeasured, // kept: the kernel gave up on it
};

/// One use of an edge in a loop of a face: the pcurve is followed from `first` to `last`, or backwards if `reversed`.
struct CadEdgeUse {
    SplineCurve2d pcurve;
    double first = 0, last = 0; // within the pcurve's knots
    bool reversed = false;
    bool seam = false;            // the edge is used twice by this face, on a closed surface's seam
    bool degenerate = false;      // a pole or apex: a line in uv that is one point in space
    uint32_t edge = 0;            // index into CadPart::edges
    double deviation_mm = 0;      // largest distance of the pcurve, on the surface, from the edge's curve in space
    double file_deviation_mm = 0; // of the file's pcurve, where another took its place
    PcurveState state = PcurveState::WithinTolerance;
    uint32_t edge_class = kEdgeSharp; // classify_edges
    double gap_mm = 0;                // what this face's border and a neighbour's may miss each other by along the edge
};

struct CadEdge {
    double tolerance_mm = 0;
    bool smooth = false; // its faces meet with continuous tangents, as the file or the kernel says; seldom told
};

using CadLoop = std::vector<CadEdgeUse>; // in the order of the walk; `edges` order may be incomplete in bad files

/// Axis system of a native surface. y is given, not derived: left-handed systems exist.
struct CadFrame {
    Vec3d origin, x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
};

/// A B-spline surface. Shapes: knots flat; control_points[i * count_v + j] = (w x, w y, w z, w), i along u, j along v.
/// Periodic directions are already cut open by the importer at the kernel's first knot, so knots[degree] ..
/// knots[count] is one period and the first and last rows of points coincide in space; `period_u` > 0 says so.
struct SplineSurface {
    int degree_u = 1, degree_v = 1;
    int count_u = 0, count_v = 0;
    bool rational = false;
    std::vector<double> knots_u, knots_v;
    std::vector<std::array<double, 4>> control_points;
};

struct CadSurface {
    uint32_t kind = kKindPlane;        // kKind...
    CadFrame frame;                    // native kinds; uv in mm and radians
    double radius = 0;                 // cylinder, sphere; cone: at v = 0; torus: major
    double minor_radius = 0;           // torus
    double half_angle = 0;             // cone, radians
    SplineSurface spline;              // kKindBezier
    double period_u = 0, period_v = 0; // 0: not periodic
    Rect2d natural_bounds;             // of the surface itself; infinite sides are +-1e100
    double deviation_mm = 0;           // of an approximation; 0: exact
    std::string source_kind;           // "plane", "bspline", "extrusion", "offset", ... for reports
};

struct CadFace {
    CadSurface surface;
    std::vector<CadLoop> loops; // empty: the surface's natural bounds
    bool reversed = false;
    std::string name;
    std::optional<uint32_t> color_rgba; // face's own, else its solid's
    double tolerance_mm = 0;
    uint32_t face_in_part = 0; // in the file's order, over converted and dropped faces
};

struct CadDroppedFace {
    uint32_t part = 0, face_in_part = 0;
    std::string name, reason;
};

/// Triangles of a part: coarse ones for the proxy, or those of a mesh (ImportOptions::mesh_deflection). Units: mm, part
/// axes. triangle_face is an index into CadPart::faces.
struct CadMesh {
    std::array<double, 3> origin_mm{}; // of the positions; the proxy's is 0
    std::vector<float> positions;      // x, y, z
    std::vector<float> normals;        // x, y, z; of the surface there, unit, outward; the proxy has none
    std::vector<uint32_t> triangles;
    std::vector<uint32_t> triangle_face;
};

struct CadPart {
    std::string name;
    std::vector<CadFace> faces;
    std::vector<CadEdge> edges;
    CadMesh mesh;
};

struct CadInstance {
    uint32_t part = 0;
    std::array<double, 12> transform{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}; // row-major 3x4, mm
    std::string name;
    std::optional<uint32_t> color_rgba;
    uint32_t tree_node = 0;
};

struct CadTreeNode {
    uint32_t parent = 0; // parents come first; the root is its own
    std::string name;
    std::optional<uint32_t> color_rgba;
};

struct CadModel {
    std::vector<CadPart> parts;
    std::vector<CadInstance> instances;
    std::vector<CadTreeNode> tree;
    std::vector<CadDroppedFace> dropped;
    std::vector<std::string> warnings;
    std::string source_format, source_unit; // "STEP AP214", "MM"
    double mesh_deflection_mm = 0;          // of a mesh with normals
    double read_seconds = 0, transfer_seconds = 0, faces_seconds = 0, mesh_seconds = 0;
};

} // namespace trimray
