// Parts: faces and edges of a shape, each face converted or dropped with a reason, and triangles.
#include "preprocess/import/cad_import_kernel.h"
#include "preprocess/trims/border_gap.h"
#include "preprocess/trims/edge_class.h"

#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepTools.hxx>
#include <BRep_Tool.hxx>
#include <GeomLib.hxx>
#include <Poly_Triangulation.hxx>
#include <Precision.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <gp_Vec.hxx>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <variant>

namespace trimray::kernel {
namespace {

Rect2d uv_bounds(const TopoDS_Face& face)
{
    Rect2d bounds;
    BRepTools::UVBounds(face, bounds.lo.x, bounds.hi.x, bounds.lo.y, bounds.hi.y);
    return bounds;
}

Result<CadFace> convert_face(const TopoDS_Face& face, const TopTools_IndexedMapOfShape& edges,
                             const ImportOptions& options, double tolerance_mm, bool may_project)
{
    const TopoDS_Face forward = TopoDS::Face(face.Oriented(TopAbs_FORWARD));
    CadFace out;
    out.reversed = face.Orientation() == TopAbs_REVERSED;
    out.tolerance_mm = BRep_Tool::Tolerance(face);
    Result<std::vector<CadLoop>> loops = collect_loops(forward, edges, may_project, tolerance_mm);
    if (!loops)
        return loops.error();
    const Rect2d bounds = conversion_needs_bounds(forward, options) ? uv_bounds(forward) : Rect2d();
    Result<ConvertedSurface> surface = convert_surface(forward, bounds, options, tolerance_mm);
    if (!surface)
        return surface.error();
    out.surface = std::move(surface->surface);
    out.loops = std::move(*loops);
    if (!surface->uv_map.identity())
        for (CadLoop& loop : out.loops)
            for (CadEdgeUse& use : loop) {
                Result<ConvertedPcurve> mapped =
                    map_pcurve({std::move(use.pcurve), use.first, use.last}, surface->uv_map);
                if (!mapped)
                    return mapped.error();
                use.pcurve = std::move(mapped->curve);
                use.first = mapped->first;
                use.last = mapped->last;
            }
    const Rect2d& natural = out.surface.natural_bounds;
    const bool endless = natural.hi.x - natural.lo.x > 1e99 || natural.hi.y - natural.lo.y > 1e99;
    if (out.loops.empty() && endless)
        return Error{ErrorCode::InvalidSurface, "surface", "it is infinite and has no loops to bound it"};
    for (const CadLoop& loop : out.loops)
        for (const CadEdgeUse& use : loop)
            out.tolerance_mm = std::max(out.tolerance_mm, BRep_Tool::Tolerance(TopoDS::Edge(edges(use.edge + 1))));
    return out;
}

/// Colours of faces: the face's own, else that of the smallest sub-shape that holds it, else the part's.
ShapeMap<uint32_t> face_colors(const PartShape& source)
{
    ShapeMap<uint32_t> colors;
    for (const TopAbs_ShapeEnum kind : {TopAbs_COMPOUND, TopAbs_COMPSOLID, TopAbs_SOLID, TopAbs_SHELL, TopAbs_FACE}) {
        TopTools_IndexedMapOfShape holders;
        TopExp::MapShapes(source.shape, kind, holders);
        for (int i = 1; i <= holders.Extent(); ++i)
            if (source.colors.IsBound(holders(i)))
                for (TopExp_Explorer face(holders(i), TopAbs_FACE); face.More(); face.Next())
                    colors.Bind(face.Current(), source.colors.Find(holders(i)));
    }
    return colors;
}

/// Unit normals S_u x S_v at the triangulation's nodes, in the axes of the surface without the face's location. Where
/// the surface has none that the kernel finds: the mean of the triangles' there.
std::vector<gp_Vec> node_normals(const TopoDS_Face& face, const Poly_Triangulation& triangulation)
{
    TopLoc_Location location;
    const Handle(Geom_Surface)& surface = BRep_Tool::Surface(face, location);
    std::vector<gp_Vec> of_triangles(static_cast<size_t>(triangulation.NbNodes()));
    for (int i = 1; i <= triangulation.NbTriangles(); ++i) {
        int node[3];
        triangulation.Triangle(i).Get(node[0], node[1], node[2]);
        const gp_Pnt a = triangulation.Node(node[0]);
        const gp_Vec across = gp_Vec(a, triangulation.Node(node[1])).Crossed(gp_Vec(a, triangulation.Node(node[2])));
        for (const int n : node)
            of_triangles[static_cast<size_t>(n - 1)] += across;
    }
    std::vector<gp_Vec> normals;
    for (int i = 1; i <= triangulation.NbNodes(); ++i) {
        const gp_Vec& mean = of_triangles[static_cast<size_t>(i - 1)];
        gp_Dir normal;
        constexpr int kFound = 1; // 0: a regular point, 1: a pole
        if (triangulation.HasUVNodes() &&
            GeomLib::NormEstim(surface, triangulation.UVNode(i), Precision::Confusion(), normal) <= kFound)
            normals.emplace_back(normal);
        else
            normals.push_back(mean.SquareMagnitude() > 0 ? mean.Normalized() : gp_Vec(0, 0, 1));
    }
    return normals;
}

/// Appends the face's triangles, as far as the kernel made any.
void append_triangles(const TopoDS_Face& face, uint32_t number, bool with_normals, CadMesh& mesh)
{
    TopLoc_Location location;
    const Handle(Poly_Triangulation) triangulation = BRep_Tool::Triangulation(face, location);
    if (triangulation.IsNull())
        return;
    const gp_Trsf transform = location.Transformation();
    const bool reversed = face.Orientation() == TopAbs_REVERSED;
    const auto first = static_cast<uint32_t>(mesh.positions.size() / 3);
    for (int i = 1; i <= triangulation->NbNodes(); ++i) {
        const gp_XYZ p = triangulation->Node(i).Transformed(transform).XYZ();
        for (int c = 1; c <= 3; ++c)
            mesh.positions.push_back(static_cast<float>(p.Coord(c) - mesh.origin_mm[static_cast<size_t>(c - 1)]));
    }
    if (with_normals)
        for (const gp_Vec& normal : node_normals(face, *triangulation)) {
            const gp_XYZ n = (reversed ? normal.Reversed() : normal).Transformed(transform).XYZ();
            for (int c = 1; c <= 3; ++c)
                mesh.normals.push_back(static_cast<float>(n.Coord(c)));
        }
    const bool flip = reversed != transform.IsNegative();
    for (int i = 1; i <= triangulation->NbTriangles(); ++i) {
        int a = 0, b = 0, c = 0;
        triangulation->Triangle(i).Get(a, b, c);
        if (flip)
            std::swap(b, c);
        for (const int node : {a, b, c})
            mesh.triangles.push_back(first + static_cast<uint32_t>(node - 1));
        mesh.triangle_face.push_back(number);
    }
}

} // namespace

CadPart convert_part(const PartShape& source, uint32_t part_index, const ImportOptions& options,
                     std::vector<CadDroppedFace>& dropped, const Progress&)
{
    CadPart part;
    part.name = source.name;
    const TopoDS_Shape& shape = source.shape;
    TopTools_IndexedMapOfShape faces, edges;
    TopExp::MapShapes(shape, TopAbs_FACE, faces);
    TopExp::MapShapes(shape, TopAbs_EDGE, edges);
    const ShapeMap<uint32_t> colors = face_colors(source);
    double tolerance_mm = options.approximation_tolerance_mm;
    if (!(tolerance_mm > 0))
        tolerance_mm = std::max(1e-6 * diagonal_mm(shape), 1e-9);

    for (int i = 1; i <= edges.Extent(); ++i) {
        const TopoDS_Edge edge = TopoDS::Edge(edges(i));
        CadEdge out;
        out.tolerance_mm = BRep_Tool::Tolerance(edge);
        out.smooth = BRep_Tool::MaxContinuity(edge) >= GeomAbs_G1;
        part.edges.push_back(out);
    }

    // each face on its own, on all cores; what needs the shape changed (a missing pcurve) is tried again alone
    using Outcome = std::variant<std::monostate, CadFace, std::string>;
    std::vector<Outcome> outcomes(static_cast<size_t>(faces.Extent()));
    const auto convert = [&](size_t i, bool may_project) {
        std::optional<Result<CadFace>> converted;
        const auto failure = failure_of([&] {
            converted =
                convert_face(TopoDS::Face(faces(static_cast<int>(i) + 1)), edges, options, tolerance_mm, may_project);
        });
        if (failure)
            outcomes[i] = *failure;
        else if (!*converted)
            outcomes[i] = fmt::format("{}: {}", converted->error().where, converted->error().detail);
        else
            outcomes[i] = std::move(**converted);
    };
    tbb::parallel_for(size_t{0}, outcomes.size(), [&](size_t i) { convert(i, false); });
    for (size_t i = 0; i < outcomes.size(); ++i) {
        if (std::holds_alternative<std::string>(outcomes[i]))
            convert(i, true);
        const TopoDS_Shape& face = faces(static_cast<int>(i) + 1);
        const auto face_in_part = static_cast<uint32_t>(i);
        const std::string name = source.names.IsBound(face) ? source.names.Find(face) : std::string();
        if (const std::string* reason = std::get_if<std::string>(&outcomes[i])) {
            dropped.push_back({part_index, face_in_part, name, *reason});
            continue;
        }
        CadFace& out = std::get<CadFace>(outcomes[i]);
        out.face_in_part = face_in_part;
        out.name = name;
        out.color_rgba = colors.IsBound(face) ? std::optional(colors.Find(face)) : source.color_rgba;
        part.faces.push_back(std::move(out));
    }
    classify_edges(part, diagonal_mm(shape));
    measure_border_gaps(part, diagonal_mm(shape));
    return part;
}

void mesh_part(const TopoDS_Shape& shape, const MeshDetail& detail, CadPart& part, std::vector<std::string>& warnings)
{
    if (!(detail.deflection_mm > 0))
        return;
    IMeshTools_Parameters parameters;
    parameters.Deflection = detail.deflection_mm;
    parameters.Angle = detail.angle_rad;
    parameters.InParallel = true;
    const char* what = detail.normals ? "mesh" : "proxy mesh";
    CadMesh& mesh = part.mesh;
    const auto failure = failure_of([&] {
        BRepMesh_IncrementalMesh mesher(shape, parameters);
        if (const auto box = box_of(shape); box && detail.normals)
            for (size_t c = 0; c < 3; ++c)
                mesh.origin_mm[c] = (box->lo[c] + box->hi[c]) / 2;
        TopTools_IndexedMapOfShape faces;
        TopExp::MapShapes(shape, TopAbs_FACE, faces);
        for (size_t k = 0; k < part.faces.size(); ++k) {
            const TopoDS_Face face = TopoDS::Face(faces(static_cast<int>(part.faces[k].face_in_part) + 1));
            append_triangles(face, static_cast<uint32_t>(k), detail.normals, mesh);
        }
    });
    if (failure) {
        mesh = {};
        warnings.push_back(fmt::format("part \"{}\": no {}: {}", part.name, what, *failure));
    } else if (mesh.triangles.empty()) {
        warnings.push_back(fmt::format("part \"{}\": no {}: the kernel made no triangles", part.name, what));
    }
}

} // namespace trimray::kernel
