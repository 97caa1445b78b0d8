#include "tests/occt_models.h"

#include <BRepAlgoAPI_Cut.hxx>
#include <BRepBndLib.hxx>
#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakeVertex.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepFilletAPI_MakeFillet.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCone.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakeHalfSpace.hxx>
#include <BRepPrimAPI_MakePrism.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <Geom2d_Curve.hxx>
#include <GeomAPI_PointsToBSpline.hxx>
#include <GeomAPI_PointsToBSplineSurface.hxx>
#include <Geom_BSplineCurve.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Geom_BezierCurve.hxx>
#include <Geom_BezierSurface.hxx>
#include <Geom_Circle.hxx>
#include <Geom_ConicalSurface.hxx>
#include <Geom_CylindricalSurface.hxx>
#include <Geom_Ellipse.hxx>
#include <Geom_Hyperbola.hxx>
#include <Geom_Line.hxx>
#include <Geom_OffsetCurve.hxx>
#include <Geom_OffsetSurface.hxx>
#include <Geom_Parabola.hxx>
#include <Geom_Plane.hxx>
#include <Geom_RectangularTrimmedSurface.hxx>
#include <Geom_SphericalSurface.hxx>
#include <Geom_SurfaceOfLinearExtrusion.hxx>
#include <Geom_SurfaceOfRevolution.hxx>
#include <Geom_ToroidalSurface.hxx>
#include <Geom_TrimmedCurve.hxx>
#include <IGESControl_Writer.hxx>
#include <Precision.hxx>
#include <STEPControl_Reader.hxx>
#include <Standard_Failure.hxx>
#include <TColgp_Array1OfPnt.hxx>
#include <TColgp_Array2OfPnt.hxx>
#include <TopExp_Explorer.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <gp_Ax1.hxx>
#include <gp_Ax2.hxx>
#include <gp_Ax3.hxx>
#include <gp_Circ.hxx>
#include <gp_Cylinder.hxx>
#include <gp_Pln.hxx>
#include <gp_Trsf.hxx>

#include <cmath>
#include <utility>

namespace trimray::oracle {

namespace {

constexpr double kFaceTolerance = 1e-7;

Handle(Geom_BSplineCurve) wavy_curve(double z_step)
{
    TColgp_Array1OfPnt points(1, 7);
    for (int i = 1; i <= 7; ++i)
        points(i) = gp_Pnt(10 + 3 * std::sin(1.3 * i), z_step > 0 ? 0 : 4.0 * i, z_step * i);
    return GeomAPI_PointsToBSpline(points, 3, 5).Curve();
}

TopoDS_Shape with_hole(const Handle(Geom_Surface) & surface, const gp_Ax2& drill, double radius)
{
    const TopoDS_Shape face = BRepBuilderAPI_MakeFace(surface, kFaceTolerance).Shape();
    const TopoDS_Shape tool = BRepPrimAPI_MakeCylinder(drill, radius, 100).Shape();
    return BRepAlgoAPI_Cut(face, tool).Shape();
}

bool write_shape(const TopoDS_Shape& shape, const std::string& path)
{
    if (path.ends_with(".igs")) { // the faces one by one: none shares an edge
        IGESControl_Writer writer("MM", 0);
        return writer.AddShape(shape) && writer.Write(path.c_str());
    }
    return !shape.IsNull() && BRepTools::Write(shape, path.c_str());
}

TopoDS_Shape read_step(const std::string& path)
{
    STEPControl_Reader reader;
    if (reader.ReadFile(path.c_str()) != IFSelect_RetDone)
        return {};
    reader.TransferRoots();
    return reader.OneShape();
}

TopoDS_Shape rounded_box()
{
    const TopoDS_Shape box = BRepPrimAPI_MakeBox(10, 8, 6).Shape();
    BRepFilletAPI_MakeFillet round(box);
    for (TopExp_Explorer edge(box, TopAbs_EDGE); edge.More(); edge.Next())
        round.Add(1.5, TopoDS::Edge(edge.Current()));
    return round.Shape();
}

/// A tube 10 mm high over the closed curve of these edges.
TopoDS_Shape tube_over(const TopoDS_Shape& curve)
{
    return BRepPrimAPI_MakePrism(curve, gp_Vec(0, 0, 10)).Shape();
}

/// A closed curve with one corner, at its ends.
TopoDS_Shape drop_curve()
{
    TColgp_Array1OfPnt points(1, 4);
    points(1) = points(4) = gp_Pnt(0, 0, 0);
    points(2) = gp_Pnt(12, 8, 0);
    points(3) = gp_Pnt(12, -8, 0);
    return BRepBuilderAPI_MakeEdge(Handle(Geom_Curve)(new Geom_BezierCurve(points))).Shape();
}

TopoDS_Shape half_tubes()
{
    const gp_Circ circle(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 5);
    const TopoDS_Vertex a = BRepBuilderAPI_MakeVertex(gp_Pnt(5, 0, 0)), b = BRepBuilderAPI_MakeVertex(gp_Pnt(-5, 0, 0));
    return tube_over(
        BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(circle, a, b), BRepBuilderAPI_MakeEdge(circle, b, a)).Shape());
}

TopoDS_Shape three_sheets()
{
    BRep_Builder builder;
    TopoDS_Compound spokes;
    builder.MakeCompound(spokes);
    const TopoDS_Vertex hub = BRepBuilderAPI_MakeVertex(gp_Pnt(0, 0, 0));
    for (const gp_Pnt& tip : {gp_Pnt(10, 0, 0), gp_Pnt(-5, 8, 0), gp_Pnt(-5, -8, 0)})
        builder.Add(spokes, BRepBuilderAPI_MakeEdge(hub, BRepBuilderAPI_MakeVertex(tip)).Shape());
    return tube_over(spokes);
}

TopoDS_Shape touching_boxes()
{
    BRep_Builder builder;
    TopoDS_Compound boxes;
    builder.MakeCompound(boxes);
    builder.Add(boxes, BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), gp_Pnt(10, 10, 10)).Shape());
    builder.Add(boxes, BRepPrimAPI_MakeBox(gp_Pnt(10, 0, 0), gp_Pnt(20, 10, 10)).Shape());
    return boxes;
}

gp_Trsf mirrored_in_x()
{
    gp_Trsf mirror;
    mirror.SetMirror(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0)));
    return mirror;
}

/// A piece of a surface.
struct Piece {
    KindOfFace kind;
    Handle(Geom_Surface) surface;
    double u0, u1, v0, v1;
};

/// The surface within its own bounds.
Piece whole(const KindOfFace& kind, const Handle(Geom_Surface) & surface)
{
    Piece piece{kind, surface, 0, 0, 0, 0};
    surface->Bounds(piece.u0, piece.u1, piece.v0, piece.v1);
    return piece;
}

Handle(Geom_BSplineSurface) wavy_sheet()
{
    TColgp_Array2OfPnt points(1, 6, 1, 6);
    for (int i = 1; i <= 6; ++i)
        for (int j = 1; j <= 6; ++j)
            points(i, j) = gp_Pnt(3.0 * i - 10, 3.0 * j - 10, 2 * std::sin(0.9 * i) * std::cos(0.7 * j));
    return GeomAPI_PointsToBSplineSurface(points, 3, 5).Surface();
}

Handle(Geom_BezierSurface) bezier_sheet()
{
    TColgp_Array2OfPnt points(1, 4, 1, 3);
    for (int i = 1; i <= 4; ++i)
        for (int j = 1; j <= 3; ++j)
            points(i, j) = gp_Pnt(5.0 * i - 12, 7.0 * j - 14, (i * j) % 3 * 3.0);
    return new Geom_BezierSurface(points);
}

/// Curves in the plane y = 0, about 10 mm from the z axis and as long; revolved about z or extruded along y.
std::vector<std::pair<const char*, Handle(Geom_Curve)>> profile_curves()
{
    const gp_Ax2 middle(gp_Pnt(8, 0, 0), gp_Dir(0, -1, 0), gp_Dir(1, 0, 0));
    const auto piece = [](const Handle(Geom_Curve) & curve, double from, double to) {
        return Handle(Geom_Curve)(new Geom_TrimmedCurve(curve, from, to));
    };
    TColgp_Array1OfPnt points(1, 4);
    points(1) = gp_Pnt(6, 0, -6);
    points(2) = gp_Pnt(12, 0, -2);
    points(3) = gp_Pnt(4, 0, 2);
    points(4) = gp_Pnt(9, 0, 6);
    const Handle(Geom_BSplineCurve) spline = GeomAPI_PointsToBSpline(points, 3, 5).Curve();
    return {{"a line", piece(new Geom_Line(gp_Pnt(7, 0, 0), gp_Dir(0.4, 0, 1)), -6, 6)},
            {"a circle", piece(new Geom_Circle(middle, 5), 0.5, 3)},
            {"an ellipse", piece(new Geom_Ellipse(middle, 5, 3), 0.5, 3)},
            {"a parabola", piece(new Geom_Parabola(middle, 2), -5, 5)},
            {"a hyperbola", piece(new Geom_Hyperbola(middle, 2, 3), -1, 1)},
            {"a Bezier curve", new Geom_BezierCurve(points)},
            {"a spline", spline},
            {"an offset curve", new Geom_OffsetCurve(spline, 1, gp_Dir(0, 1, 0))}};
}

std::vector<Piece> pieces_of_every_kind()
{
    const gp_Ax3 axes(gp_Pnt(), gp_Dir(0, 0, 1));
    const Handle(Geom_Surface) plane = new Geom_Plane(axes), cylinder = new Geom_CylindricalSurface(axes, 7),
                               cone = new Geom_ConicalSurface(axes, 0.4, 5),
                               sphere = new Geom_SphericalSurface(axes, 8),
                               torus = new Geom_ToroidalSurface(axes, 8, 3), sheet = wavy_sheet();
    std::vector<Piece> pieces{
        {{"plane", "plane"}, plane, -8, 8, -8, 8},
        {{"cylinder", "cylinder"}, cylinder, 0.5, 4, -8, 8},
        {{"cone", "cone"}, cone, 0.5, 4, -8, 8},
        {{"sphere", "sphere"}, sphere, 0.5, 4, -1, 1.2},
        {{"torus", "torus"}, torus, 0.5, 4, 1, 5},
        whole({"Bezier surface", "bezier"}, bezier_sheet()),
        whole({"spline surface", "bspline"}, sheet),
        whole({"trimmed cylinder", "cylinder"}, new Geom_RectangularTrimmedSurface(cylinder, 1.0, 3.0, -5.0, 5.0)),
        {{"offset of a plane", "offset"}, new Geom_OffsetSurface(plane, 4), -8, 8, -8, 8},
        {{"offset of a cylinder", "offset"}, new Geom_OffsetSurface(cylinder, 2), 0.5, 4, -8, 8},
        {{"offset of a cone", "offset"}, new Geom_OffsetSurface(cone, 2), 0.5, 4, -8, 8},
        {{"offset of a torus", "offset"}, new Geom_OffsetSurface(torus, 1), 0.5, 4, 1, 5},
        whole({"offset of a spline surface", "offset"}, new Geom_OffsetSurface(sheet, 2)),
        whole({"offset of an offset", "offset"}, new Geom_OffsetSurface(new Geom_OffsetSurface(sheet, 2), -1)),
    };
    for (const auto& [name, curve] : profile_curves()) {
        const double first = curve->FirstParameter(), last = curve->LastParameter();
        const Handle(Geom_Surface) extruded = new Geom_SurfaceOfLinearExtrusion(curve, gp_Dir(0.3, 1, 0.2)),
                                   revolved = new Geom_SurfaceOfRevolution(curve, gp_Ax1(gp_Pnt(), gp_Dir(0, 0, 1)));
        pieces.push_back({{name, "extrusion"}, extruded, first, last, -8, 8});
        pieces.push_back({{name, "revolution"}, revolved, 0.5, 3, first, last});
        pieces.push_back({{name, "offset"}, new Geom_OffsetSurface(extruded, 1), first, last, -8, 8});
        pieces.push_back({{name, "offset"}, new Geom_OffsetSurface(revolved, 1), 0.5, 3, first, last});
    }
    return pieces;
}

} // namespace

std::vector<KindOfFace> kinds_of_faces()
{
    std::vector<KindOfFace> kinds;
    for (const Piece& piece : pieces_of_every_kind())
        kinds.push_back(piece.kind);
    return kinds;
}

bool write_every_kind(const std::string& path)
{
    try {
        BRep_Builder builder;
        TopoDS_Compound all;
        builder.MakeCompound(all);
        int place = 0;
        for (const Piece& piece : pieces_of_every_kind()) {
            gp_Trsf there;
            there.SetTranslation(gp_Vec(place % kKindsPerRow, place / kKindsPerRow, 0) * kKindStep_mm);
            ++place;
            const TopoDS_Shape face =
                BRepBuilderAPI_MakeFace(piece.surface, piece.u0, piece.u1, piece.v0, piece.v1, kFaceTolerance).Shape();
            builder.Add(all, BRepBuilderAPI_Transform(face, there, true).Shape());
        }
        return write_shape(all, path);
    } catch (const Standard_Failure&) {
        return false;
    }
}

bool write_swept_model(const std::string& path)
{
    try {
        BRep_Builder builder;
        TopoDS_Compound all;
        builder.MakeCompound(all);

        const Handle(Geom_Surface) extruded = new Geom_RectangularTrimmedSurface(
            new Geom_SurfaceOfLinearExtrusion(wavy_curve(0), gp_Dir(0, 0, 1)), 0, 20, false);
        builder.Add(all, with_hole(extruded, gp_Ax2(gp_Pnt(-50, 16, 10), gp_Dir(1, 0, 0)), 4));

        const Handle(Geom_Surface) revolved =
            new Geom_SurfaceOfRevolution(wavy_curve(4), gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)));
        const TopoDS_Shape vase = with_hole(revolved, gp_Ax2(gp_Pnt(0, 0, 16), gp_Dir(0.3, -1, 0.1)), 3);
        gp_Trsf aside;
        aside.SetTranslation(gp_Vec(40, 0, 0));
        builder.Add(all, BRepBuilderAPI_Transform(vase, aside, true).Shape());

        TColgp_Array2OfPnt points(1, 6, 1, 6);
        for (int i = 1; i <= 6; ++i)
            for (int j = 1; j <= 6; ++j)
                points(i, j) = gp_Pnt(5.0 * i, 40 + 5.0 * j, 3 * std::sin(0.9 * i) * std::cos(0.7 * j));
        const Handle(Geom_BSplineSurface) sheet = GeomAPI_PointsToBSplineSurface(points, 3, 5).Surface();
        const Handle(Geom_Surface) offset = new Geom_OffsetSurface(sheet, 2);
        builder.Add(all, with_hole(offset, gp_Ax2(gp_Pnt(17, 57, -50), gp_Dir(0, 0, 1)), 4));
        builder.Add(all, BRepBuilderAPI_MakeFace(Handle(Geom_Surface)(sheet), kFaceTolerance).Shape());
        return write_shape(all, path);
    } catch (const Standard_Failure&) {
        return false;
    }
}

bool write_flat_cone(const std::string& path)
{
    try {
        return write_shape(BRepPrimAPI_MakeCone(10, 4, 1e-5).Shape(), path);
    } catch (const Standard_Failure&) {
        return false;
    }
}

bool write_left_handed_copy(const std::string& from, const std::string& path)
{
    try {
        return write_shape(BRepBuilderAPI_Transform(read_step(from), mirrored_in_x(), true).Shape(), path);
    } catch (const Standard_Failure&) {
        return false;
    }
}

bool write_placed_copies(const std::string& from, const std::string& path)
{
    try {
        const TopoDS_Shape shape = read_step(from);
        Bnd_Box box;
        BRepBndLib::Add(shape, box, false);
        double lo[3], hi[3];
        box.Get(lo[0], lo[1], lo[2], hi[0], hi[1], hi[2]);
        const double size = std::hypot(hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]);

        gp_Trsf turned, moved, mirrored_away;
        turned.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(1, 2, 3)), 0.7);
        moved.SetTranslation(gp_Vec(size, 0.2 * size, 0));
        mirrored_away.SetTranslation(gp_Vec(-0.3 * size, size, 0.1 * size));
        BRep_Builder builder;
        TopoDS_Compound all;
        builder.MakeCompound(all);
        builder.Add(all, shape);
        builder.Add(all, shape.Moved(TopLoc_Location(moved * turned)));
        TopoDS_Shape image = shape;
        image.Location(TopLoc_Location(mirrored_away * mirrored_in_x()), false); // false: mirror images are meant
        builder.Add(all, image);
        return write_shape(all, path);
    } catch (const Standard_Failure&) {
        return false;
    }
}

bool write_pieces_of_endless_surfaces(const std::string& path)
{
    try {
        BRep_Builder builder;
        TopoDS_Compound all;
        builder.MakeCompound(all);
        const auto add = [&](const Handle(Geom_Surface) & surface, double u0, double u1, double v0, double v1) {
            builder.Add(all, BRepBuilderAPI_MakeFace(surface, u0, u1, v0, v1, kFaceTolerance).Shape());
        };
        const auto axes = [](double x) { return gp_Ax3(gp_Pnt(x, 0, 0), gp_Dir(0, 0, 1)); };
        const Handle(Geom_Surface) plane = new Geom_Plane(axes(0));
        const Handle(Geom_Surface) wave = new Geom_SurfaceOfLinearExtrusion(
            Handle(Geom_Curve)::DownCast(wavy_curve(0)->Translated(gp_Vec(40, -16, 0))), gp_Dir(0, 0, 1));
        add(plane, -10, 10, -10, 10);
        add(new Geom_CylindricalSurface(axes(25), 8), 0.3, 2.5, 2, 18);
        add(new Geom_ConicalSurface(axes(80), 0.3, 4), 3, 6, 1, 20);
        double u0 = 0, u1 = 0, v0 = 0, v1 = 0;
        wave->Bounds(u0, u1, v0, v1);
        add(wave, u0, u1, 3, 17);
        add(new Geom_OffsetSurface(new Geom_Plane(axes(100)), 5), -10, 10, -10, 10);
        add(new Geom_OffsetSurface(wave, 3), u0, u1, 5, 15);
        return write_shape(all, path);
    } catch (const Standard_Failure&) {
        return false;
    }
}

bool write_endless_faces(const std::string& path)
{
    try {
        BRep_Builder builder;
        TopoDS_Compound all;
        builder.MakeCompound(all);
        const gp_Pln ground(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), above(gp_Pnt(0, 0, 5), gp_Dir(0, 0, 1));
        const double end = Precision::Infinite();
        builder.Add(all, BRepBuilderAPI_MakeFace(ground, 0, 1, 0, 1).Shape());
        builder.Add(all, BRepBuilderAPI_MakeFace(above).Shape());
        const gp_Ax3 axes(gp_Pnt(20, 0, 0), gp_Dir(0, 0, 1));
        builder.Add(all, BRepBuilderAPI_MakeFace(gp_Cylinder(axes, 5)).Shape());
        const Handle(Geom_Surface) wave = new Geom_SurfaceOfLinearExtrusion(wavy_curve(0), gp_Dir(0, 0, 1));
        builder.Add(all, BRepBuilderAPI_MakeFace(wave, kFaceTolerance).Shape());
        builder.Add(all, BRepBuilderAPI_MakeFace(above, 0, end, -end, end).Shape());
        const TopoDS_Face plane = BRepBuilderAPI_MakeFace(above).Face();
        builder.Add(all, BRepPrimAPI_MakeHalfSpace(plane, gp_Pnt(0, 0, 9)).Solid());
        return write_shape(all, path);
    } catch (const Standard_Failure&) {
        return false;
    }
}

bool write_solid(const std::string& name, const std::string& path)
{
    const gp_Circ circle(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 5);
    try {
        if (name == "box")
            return write_shape(BRepPrimAPI_MakeBox(10, 8, 6).Shape(), path);
        if (name == "rounded box")
            return write_shape(rounded_box(), path);
        if (name == "cylinder")
            return write_shape(BRepPrimAPI_MakeCylinder(5, 10).Shape(), path);
        if (name == "cone")
            return write_shape(BRepPrimAPI_MakeCone(5, 0, 10).Shape(), path);
        if (name == "sphere")
            return write_shape(BRepPrimAPI_MakeSphere(5).Shape(), path);
        if (name == "tube")
            return write_shape(tube_over(BRepBuilderAPI_MakeEdge(circle).Shape()), path);
        if (name == "creased tube")
            return write_shape(tube_over(drop_curve()), path);
        if (name == "half tubes")
            return write_shape(half_tubes(), path);
        if (name == "three sheets")
            return write_shape(three_sheets(), path);
        if (name == "touching boxes")
            return write_shape(touching_boxes(), path);
        return false;
    } catch (const Standard_Failure&) {
        return false;
    }
}

bool write_slanted_cylinder(double shift_u, double growth_mm, const std::string& path)
{
    try {
        const gp_Pln plane(gp_Ax3(gp_Pnt(0, 0, 5), gp_Dir(-0.5, 0, 1)));
        const TopoDS_Shape above =
            BRepPrimAPI_MakeHalfSpace(BRepBuilderAPI_MakeFace(plane, -50, 50, -50, 50).Face(), gp_Pnt(0, 0, 50))
                .Solid();
        const TopoDS_Shape solid = BRepAlgoAPI_Cut(BRepPrimAPI_MakeCylinder(5, 20).Shape(), above).Shape();
        for (TopExp_Explorer f(solid, TopAbs_FACE); f.More(); f.Next()) {
            const TopoDS_Face face = TopoDS::Face(f.Current().Oriented(TopAbs_FORWARD));
            if (Handle(Geom_CylindricalSurface)::DownCast(BRep_Tool::Surface(face)).IsNull())
                continue;
            for (TopExp_Explorer e(face, TopAbs_EDGE); e.More(); e.Next()) {
                const TopoDS_Edge edge = TopoDS::Edge(e.Current());
                double first = 0, last = 0;
                const auto rim = Handle(Geom_Ellipse)::DownCast(BRep_Tool::Curve(edge, first, last));
                if (rim.IsNull())
                    continue;
                const auto moved =
                    Handle(Geom2d_Curve)::DownCast(BRep_Tool::CurveOnSurface(edge, face, first, last)->Copy());
                moved->Translate(gp_Vec2d(shift_u, 0));
                const Handle(Geom_Ellipse) grown =
                    new Geom_Ellipse(rim->Position(), rim->MajorRadius() + growth_mm, rim->MinorRadius() + growth_mm);
                BRep_Builder builder;
                builder.UpdateEdge(edge, moved, face, kFaceTolerance);
                builder.UpdateEdge(edge, grown, kFaceTolerance);
                return write_shape(solid, path);
            }
        }
        return false;
    } catch (const Standard_Failure&) {
        return false;
    }
}

bool write_scaled_neighbour(const std::string& from, const std::string& other, double scale, const std::string& path)
{
    try {
        gp_Trsf larger;
        larger.SetScale(gp_Pnt(0, 0, 0), scale);
        TopoDS_Shape scaled = read_step(from);
        scaled.Location(TopLoc_Location(larger), false); // false: scaling is meant
        BRep_Builder builder;
        TopoDS_Compound all;
        builder.MakeCompound(all);
        builder.Add(all, scaled);
        builder.Add(all, read_step(other));
        return write_shape(all, path);
    } catch (const Standard_Failure&) {
        return false;
    }
}

} // namespace trimray::oracle
