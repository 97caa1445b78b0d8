// What the import's own files share: the kernel's shapes on their way into a CadModel. Only cad_import*.cpp include
// this. Kernel words stay here: a wire is a loop, a pole is a control point, a trsf is a transform.
#pragma once

#include "format/result.h"
#include "preprocess/import/cad_import.h"
#include "preprocess/import/cad_model.h"

#include <GeomAdaptor_Surface.hxx>
#include <NCollection_DataMap.hxx>
#include <Standard_Handle.hxx>
#include <TopLoc_Location.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopTools_ShapeMapHasher.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shape.hxx>

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

class Geom2d_Curve;
class Geom_Surface;
class TDocStd_Document;
class XSAlgo_AlgoContainer;

namespace trimray::kernel {

template <class T>
using ShapeMap = NCollection_DataMap<TopoDS_Shape, T, TopTools_ShapeMapHasher>;

/// A part before its faces are converted; `shape` has no location, so its axes are the part's.
struct PartShape {
    TopoDS_Shape shape;
    std::string name;
    std::optional<uint32_t> color_rgba;
    ShapeMap<uint32_t> colors;   // of sub-shapes: solids, shells, faces
    ShapeMap<std::string> names; // of sub-shapes
};

/// A file after reading and transfer: the assembly is ours, the parts' geometry still the kernel's.
struct LoadedFile {
    std::vector<PartShape> parts;
    std::vector<CadInstance> instances;
    std::vector<CadTreeNode> tree;
    std::vector<std::string> warnings;
    std::string source_format, source_unit;
    double read_seconds = 0, transfer_seconds = 0;
    size_t source_faces = 0; // faces that the file speaks of, where the reader can tell
    struct LostFace {
        std::string name, reason; // "#123", and the kernel's words
    };
    std::vector<LostFace> lost_faces; // those that the kernel made no shape of
};

enum class CadFormat { Step, Iges, BrepText, BrepBinary };

/// Tells a file's format by its first bytes; what it is called (empty: as in `path`) is for the error.
/// Fails: FileNotFound, FileNotReadable, EmptyCad, UnsupportedFormat (says what the file looks like).
Result<CadFormat> detect_format(const std::string& path, const std::string& file_name);

/// Reads and transfers a file. Fails as import_cad.
Result<LoadedFile> load_file(const std::string& path, CadFormat format, const ImportOptions& options,
                             const Progress& progress);

/// Walks a document's assembly into `file`: tree, instances, parts with the colours and names of their sub-shapes.
/// Fails: InvalidCad (an assembly that holds itself, or too many placements).
Status walk_document(const opencascade::handle<TDocStd_Document>& document, const std::string& root_name,
                     LoadedFile& file);

/// Adds a shape without a document as the only part (BREP).
Status add_bare_shape(const TopoDS_Shape& shape, const std::string& name, LoadedFile& file);

/// Replaces what the kernel does to every shape after transfer, for the life of the object: `full` is its own healing,
/// otherwise only the steps that faces need to have pcurves, seams and bounds.
class HealingPolicy {
public:
    explicit HealingPolicy(bool full);
    ~HealingPolicy();
    HealingPolicy(const HealingPolicy&) = delete;
    HealingPolicy& operator=(const HealingPolicy&) = delete;

private:
    opencascade::handle<XSAlgo_AlgoContainer> saved_;
};

// ---- geometry ------------------------------------------------------------------------------------------------------
/// What carries the uv of the kernel's surface to the uv of ours, per direction: first uv * scale + offset, then, where
/// `arc_count` > 0, an angle becomes the parameter of the rational quadratic arcs that stand for the circle.
struct UvAxisMap {
    double scale = 1, offset = 0;
    int arc_count = 0;
    double arc_first = 0, arc_step = 0; // angles: arc k runs from arc_first + k * arc_step, one step long
    bool closed = false;                // the arcs go round once, and the map repeats with them

    bool identity() const { return scale == 1 && offset == 0 && arc_count == 0; }
    double operator()(double x) const;
};
struct UvMap {
    UvAxisMap u, v;
    bool identity() const { return u.identity() && v.identity(); }
    bool affine() const { return u.arc_count == 0 && v.arc_count == 0; }
};

struct ConvertedSurface {
    CadSurface surface;
    UvMap uv_map;
};

/// True for surfaces of which only the part that a face needs is converted.
bool conversion_needs_bounds(const TopoDS_Face& face, const ImportOptions& options);

/// Converts a face's surface, its location applied. `bounds` are the face's in the kernel's uv, and are looked at only
/// where conversion_needs_bounds.
/// Fails: InvalidSurface, UnsupportedSurface, with the reason.
Result<ConvertedSurface> convert_surface(const TopoDS_Face& face, const Rect2d& bounds, const ImportOptions& options,
                                         double tolerance_mm);

/// Returns a native surface over `bounds` (its own uv) as a rational B-spline, exactly: circles become quadratic arcs
/// of at most 90 degrees, and the map carries angles over to their parameters (HARD_CASES 22).
ConvertedSurface native_as_spline(const ConvertedSurface& native, const Rect2d& bounds);

/// A smooth function of (u, v) and the parameters where it may be less than smooth (ends included).
struct SampledSurface {
    std::function<Vec3d(double, double)> point;
    std::vector<double> breaks_u, breaks_v;
};

/// Returns a polynomial B-spline that follows `source` in its own parameters, C0 at inner knots with jumps of the
/// tangent below the tolerance over the span, and stores in `deviation_mm` the largest distance measured between nodes.
/// Fails: UnsupportedSurface when 128 spans a direction do not reach the tolerance.
Result<SplineSurface> approximate_surface(const SampledSurface& source, double tolerance_mm, double& deviation_mm);

/// The same for a curve in uv: piecewise quintic through `point`, within `tolerance` of it.
Result<SplineCurve2d> approximate_curve2d(const std::function<Vec2d(double)>& point, std::vector<double> breaks,
                                          double tolerance);

/// Converts one pcurve between two of its parameters. Fails: InvalidTrim.
struct ConvertedPcurve {
    SplineCurve2d curve;
    double first = 0, last = 0;
};
Result<ConvertedPcurve> convert_pcurve(const opencascade::handle<Geom2d_Curve>& curve, double first, double last);

/// Carries a pcurve over to the converted surface's parameters: exactly where the map is affine or the pcurve runs
/// along u or v, else within 1e-7 of an arc. Fails: InvalidTrim.
Result<ConvertedPcurve> map_pcurve(const ConvertedPcurve& pcurve, const UvMap& map);

/// A pcurve as a function of its parameter.
using PcurvePoint = std::function<Vec2d(double)>;

/// Measures a face's pcurves against the curves in space of their edges. Not to be shared between threads.
class PcurveGauge {
public:
    explicit PcurveGauge(const TopoDS_Face& face);

    /// How far S(pcurve(t)), first <= t <= last, lies from the edge's curve in space: of samples, refined around the
    /// worst of them. Zeros where the edge has no curve (a pole).
    struct Deviation {
        double mm = 0;
        double along_mm = 0; // the part of it along the surface, which another pcurve could take away
    };
    Deviation deviation(const TopoDS_Edge& edge, const PcurvePoint& pcurve, double first, double last) const;

    /// The edge's curve projected onto the surface, point by point from `pcurve` on (so on its side of a seam), within
    /// `tolerance_mm`, over the same parameters. `deviation_mm` is that of `pcurve`.
    /// Fails: InvalidTrim (the curves do not run alike, or no smooth curve follows the projected points).
    Result<SplineCurve2d> projected(const TopoDS_Edge& edge, const PcurvePoint& pcurve, double first, double last,
                                    double deviation_mm, double tolerance_mm) const;

private:
    TopLoc_Location location_;
    GeomAdaptor_Surface surface_; // without the location
};

/// The face's loops in the walk's order, in the kernel's uv. `face` must be oriented forward. Edges without a pcurve
/// are projected onto the surface, which changes the shape, so only where `may_project`; otherwise they are an error.
/// A pcurve farther from its edge's curve than the edge's tolerance and `resolution_mm` is replaced by a projection of
/// that curve if the projection is much nearer.
/// Fails: InvalidTrim, with the reason.
Result<std::vector<CadLoop>> collect_loops(const TopoDS_Face& face, const TopTools_IndexedMapOfShape& edges,
                                           bool may_project, double resolution_mm);

/// Converts a part: faces, edges, and the faces that could not be converted.
CadPart convert_part(const PartShape& source, uint32_t part_index, const ImportOptions& options,
                     std::vector<CadDroppedFace>& dropped, const Progress& progress);

/// How finely the kernel is to mesh.
struct MeshDetail {
    double deflection_mm;
    double angle_rad; // between neighbouring segments
    bool normals;     // of the surfaces, and positions about the middle of the part
};

/// Fills part.mesh, of the faces that were converted; leaves it empty, with a warning, where the kernel fails.
void mesh_part(const TopoDS_Shape& shape, const MeshDetail& detail, CadPart& part, std::vector<std::string>& warnings);

/// The shape's box, mm; none where it is void or endless.
struct ShapeBox {
    std::array<double, 3> lo, hi;
};
std::optional<ShapeBox> box_of(const TopoDS_Shape& shape);

/// Diagonal of the shape's box, mm; 0 where it has none.
double diagonal_mm(const TopoDS_Shape& shape);

/// Runs `action`, turning the kernel's exceptions and caught signals into a sentence; nothing if all went well.
std::optional<std::string> failure_of(const std::function<void()>& action);

} // namespace trimray::kernel
