#include "tests/occt_solids.h"

#include <BRepAlgoAPI_Cut.hxx>
#include <BRepAlgoAPI_Fuse.hxx>
#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakePolygon.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepCheck_Analyzer.hxx>
#include <BRepFilletAPI_MakeFillet.hxx>
#include <BRepOffsetAPI_ThruSections.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakeRevol.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRepPrimAPI_MakeTorus.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <BinTools.hxx>
#include <Geom2d_Curve.hxx>
#include <GeomAPI_Interpolate.hxx>
#include <Geom_BSplineCurve.hxx>
#include <Geom_Surface.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPControl_Controller.hxx>
#include <STEPControl_Writer.hxx>
#include <Standard_Failure.hxx>
#include <TColgp_HArray1OfPnt.hxx>
#include <TopExp_Explorer.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Solid.hxx>
#include <TopoDS_Wire.hxx>
#include <gp_Ax1.hxx>
#include <gp_Ax2.hxx>
#include <gp_Trsf.hxx>

#include <cmath>

namespace trimray::oracle {

namespace {

TopoDS_Shape rounded_box()
{
    const TopoDS_Shape box = BRepPrimAPI_MakeBox(60, 40, 30).Shape();
    BRepFilletAPI_MakeFillet fillet(box);
    for (TopExp_Explorer edge(box, TopAbs_EDGE); edge.More(); edge.Next())
        fillet.Add(6, TopoDS::Edge(edge.Current()));
    return fillet.Shape();
}

TopoDS_Shape drilled_cylinder()
{
    TopoDS_Shape solid = BRepPrimAPI_MakeCylinder(20, 60).Shape();
    const TopoDS_Shape across = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, -50, 30), gp_Dir(0, 1, 0)), 9, 100).Shape();
    const TopoDS_Shape from_top = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(5, 3, 40), gp_Dir(0, 0, 1)), 6, 40).Shape();
    const TopoDS_Shape from_side =
        BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(12, 0, 10), gp_Dir(1, 0.2, 0)), 4, 40).Shape();
    for (const TopoDS_Shape& tool : {across, from_top, from_side})
        solid = BRepAlgoAPI_Cut(solid, tool).Shape();
    return solid;
}

TopoDS_Shape sphere_and_torus()
{
    const TopoDS_Shape ring = BRepPrimAPI_MakeTorus(30, 8).Shape();
    const TopoDS_Shape ball = BRepPrimAPI_MakeSphere(gp_Pnt(28, 6, 4), 12).Shape();
    return BRepAlgoAPI_Fuse(ring, ball).Shape();
}

Handle(Geom_BSplineCurve) curve_through(const double (*points)[3], int count)
{
    Handle(TColgp_HArray1OfPnt) through = new TColgp_HArray1OfPnt(1, count);
    for (int i = 0; i < count; ++i)
        through->SetValue(i + 1, gp_Pnt(points[i][0], points[i][1], points[i][2]));
    GeomAPI_Interpolate interpolate(through, false, 1e-7);
    interpolate.Perform();
    return interpolate.Curve();
}

TopoDS_Shape revolved_spline()
{
    const double profile[6][3] = {{15, 0, -30}, {22, 0, -15}, {14, 0, 0}, {25, 0, 12}, {18, 0, 22}, {20, 0, 30}};
    BRepBuilderAPI_MakeWire wire(BRepBuilderAPI_MakeEdge(curve_through(profile, 6)).Edge());
    wire.Add(BRepBuilderAPI_MakeEdge(gp_Pnt(20, 0, 30), gp_Pnt(0, 0, 30)).Edge());
    wire.Add(BRepBuilderAPI_MakeEdge(gp_Pnt(0, 0, 30), gp_Pnt(0, 0, -30)).Edge());
    wire.Add(BRepBuilderAPI_MakeEdge(gp_Pnt(0, 0, -30), gp_Pnt(15, 0, -30)).Edge());
    return BRepPrimAPI_MakeRevol(BRepBuilderAPI_MakeFace(wire.Wire()).Face(), gp_Ax1(gp_Pnt(), gp_Dir(0, 0, 1)))
        .Shape();
}

TopoDS_Shape loft()
{
    BRepOffsetAPI_ThruSections sections(true, false, 1e-7);
    for (int level = 0; level < 4; ++level) {
        BRepBuilderAPI_MakePolygon outline;
        for (int corner = 0; corner < 5; ++corner) {
            const double angle = 1.2566370614359172 * corner + 0.3 * level, r = 20 + 6 * std::sin(2.0 * level + corner);
            outline.Add(gp_Pnt(r * std::cos(angle), r * std::sin(angle), 18.0 * level));
        }
        outline.Close();
        sections.AddWire(outline.Wire());
    }
    return sections.Shape();
}

TopoDS_Shape make(Solid solid)
{
    switch (solid) {
    case Solid::Box:
        return BRepPrimAPI_MakeBox(60, 40, 30).Shape();
    case Solid::RoundedBox:
        return rounded_box();
    case Solid::DrilledCylinder:
        return drilled_cylinder();
    case Solid::SphereAndTorus:
        return sphere_and_torus();
    case Solid::RevolvedSpline:
        return revolved_spline();
    default:
        return loft();
    }
}

/// So that nothing lies along an axis.
gp_Trsf turned()
{
    gp_Trsf turn;
    turn.SetRotation(gp_Ax1(gp_Pnt(3, 1, 2), gp_Dir(1, 2, 3)), 0.7);
    return turn;
}

/// A compound that places the shape.
TopoDS_Shape placed(const TopoDS_Shape& shape, const gp_Trsf& transform)
{
    const BRep_Builder builder;
    TopoDS_Compound all;
    builder.MakeCompound(all);
    builder.Add(all, shape.Moved(TopLoc_Location(transform)));
    return all;
}

/// Quietly. `unit` is that of the file; `assembly`: a compound's placements stay placements.
bool write_step(const TopoDS_Shape& shape, const char* unit, bool assembly, const std::string& path)
{
    const Message_SequenceOfPrinters printers = Message::DefaultMessenger()->Printers();
    Message::DefaultMessenger()->ChangePrinters().Clear();
    STEPControl_Controller::Init();
    Interface_Static::SetCVal("write.step.unit", unit);
    Interface_Static::SetIVal("write.step.assembly", assembly);
    STEPControl_Writer writer;
    const bool written =
        writer.Transfer(shape, STEPControl_AsIs) == IFSelect_RetDone && writer.Write(path.c_str()) == IFSelect_RetDone;
    Message::DefaultMessenger()->ChangePrinters() = printers;
    return written;
}

bool valid_and_closed(const TopoDS_Shape& shape)
{
    if (shape.IsNull() || !BRepCheck_Analyzer(shape).IsValid())
        return false;
    bool any = false;
    for (TopExp_Explorer shell(shape, TopAbs_SHELL); shell.More(); shell.Next()) {
        any = true;
        if (!BRep_Tool::IsClosed(shell.Current()))
            return false;
    }
    return any;
}

} // namespace

const char* solid_name(Solid solid)
{
    switch (solid) {
    case Solid::Box:
        return "box";
    case Solid::RoundedBox:
        return "rounded box";
    case Solid::DrilledCylinder:
        return "drilled cylinder";
    case Solid::SphereAndTorus:
        return "sphere and torus";
    case Solid::RevolvedSpline:
        return "revolved spline";
    default:
        return "loft";
    }
}

bool write_closed_solid(Solid solid, const std::string& path)
{
    try {
        const TopoDS_Shape shape = BRepBuilderAPI_Transform(make(solid), turned(), true).Shape();
        return valid_and_closed(shape) && BRepTools::Write(shape, path.c_str());
    } catch (const Standard_Failure&) {
        return false;
    }
}

bool write_laid_out(Solid solid, const Layout& layout, const std::string& path)
{
    try {
        gp_Trsf scaled, moved;
        scaled.SetScale(gp_Pnt(), layout.scale);
        moved.SetTranslation(gp_Vec(layout.shift_mm[0], layout.shift_mm[1], layout.shift_mm[2]));
        TopoDS_Shape shape =
            BRepBuilderAPI_Transform(make(solid), (layout.placed ? gp_Trsf() : moved) * scaled * turned(), true)
                .Shape();
        if (layout.placed)
            shape = placed(shape, moved);
        if (!path.ends_with(".step"))
            return BinTools::Write(shape, path.c_str());
        return write_step(shape, layout.unit, layout.placed, path);
    } catch (const Standard_Failure&) {
        return false;
    }
}

bool write_closed_face(ClosedFace kind, const std::string& path)
{
    try {
        const bool sphere = kind == ClosedFace::Sphere || kind == ClosedFace::SphereSeamOnly;
        const TopoDS_Shape solid =
            sphere ? BRepPrimAPI_MakeSphere(20).Shape()
            : kind == ClosedFace::Cylinder
                ? BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, -15), gp_Dir(0, 0, 1)), 20, 30).Shape()
                : BRepPrimAPI_MakeTorus(30, 8).Shape();
        TopoDS_Face face =
            TopoDS::Face(TopExp_Explorer(solid, TopAbs_FACE).Current()); // the cylinder's wall, not a lid
        if (kind == ClosedFace::SphereSeamOnly || kind == ClosedFace::TorusSeamAlongV ||
            kind == ClosedFace::TorusSeamAlongU) {
            TopLoc_Location place;
            const Handle(Geom_Surface) surface = BRep_Tool::Surface(face, place);
            const BRep_Builder builder;
            TopoDS_Wire wire;
            builder.MakeWire(wire);
            for (TopExp_Explorer at(face, TopAbs_EDGE); at.More(); at.Next()) {
                const TopoDS_Edge& edge = TopoDS::Edge(at.Current());
                double first = 0, last = 0;
                const Handle(Geom2d_Curve) pcurve = BRep_Tool::CurveOnSurface(edge, face, first, last);
                const bool along_v = std::abs(pcurve->Value(first).X() - pcurve->Value(last).X()) < 1e-9;
                if (along_v != (kind == ClosedFace::TorusSeamAlongU) && !BRep_Tool::Degenerated(edge))
                    builder.Add(wire, edge);
            }
            builder.MakeFace(face, surface, place, 1e-7);
            builder.Add(face, wire);
        }
        return BRepTools::Write(face, path.c_str());
    } catch (const Standard_Failure&) {
        return false;
    }
}

bool write_drilled_seam(double turn, const std::string& path)
{
    try {
        const gp_Ax2 axes(gp_Pnt(), gp_Dir(0, 0, 1), gp_Dir(std::cos(turn), std::sin(turn), 0));
        const TopoDS_Shape cylinder = BRepPrimAPI_MakeCylinder(axes, 20, 60).Shape();
        const TopoDS_Shape drill = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, 30), gp_Dir(1, 0, 0)), 8, 40).Shape();
        const TopoDS_Shape shape = BRepAlgoAPI_Cut(cylinder, drill).Shape();
        return valid_and_closed(shape) && BRepTools::Write(shape, path.c_str());
    } catch (const Standard_Failure&) {
        return false;
    }
}

bool write_slotted_cylinder(const std::string& path)
{
    try {
        const gp_Ax2 axes(gp_Pnt(), gp_Dir(0, 0, 1), gp_Dir(std::cos(kSlotSeam), std::sin(kSlotSeam), 0));
        gp_Trsf turn;
        turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 30), gp_Dir(1, 0, 0)), kSlotTurn);
        const TopoDS_Shape box = BRepPrimAPI_MakeBox(gp_Pnt(10, -5, 15), gp_Pnt(40, 5, 45)).Shape();
        const TopoDS_Shape slot = BRepBuilderAPI_Transform(box, turn, true).Shape();
        const TopoDS_Shape shape = BRepAlgoAPI_Cut(BRepPrimAPI_MakeCylinder(axes, 20, 60).Shape(), slot).Shape();
        return valid_and_closed(shape) && BRepTools::Write(shape, path.c_str());
    } catch (const Standard_Failure&) {
        return false;
    }
}

bool write_flipped(Solid solid, Flip flip, const std::string& path)
{
    try {
        const TopoDS_Shape shape = BRepBuilderAPI_Transform(make(solid), turned(), true).Shape();
        const BRep_Builder builder;
        TopoDS_Shell shell;
        builder.MakeShell(shell);
        for (TopExp_Explorer face(shape, TopAbs_FACE); face.More(); face.Next()) {
            const bool first = shell.NbChildren() == 0;
            const bool turn = flip == Flip::Faces || (flip == Flip::OneFace && first);
            builder.Add(shell, turn ? face.Current().Reversed() : face.Current());
        }
        shell.Closed(true);
        TopoDS_Solid flipped;
        builder.MakeSolid(flipped);
        builder.Add(flipped, shell);
        TopoDS_Compound all; // a file's only shape is taken to be the right way round
        builder.MakeCompound(all);
        builder.Add(all, flip == Flip::Solid ? flipped.Reversed() : TopoDS_Shape(flipped));
        return BRepTools::Write(all, path.c_str());
    } catch (const Standard_Failure&) {
        return false;
    }
}

} // namespace trimray::oracle
