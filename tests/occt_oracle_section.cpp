#include "tests/occt_oracle_impl.h"

#include <BRepAlgoAPI_Common.hxx>
#include <BRepBndLib.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepGProp.hxx>
#include <Bnd_Box.hxx>
#include <GProp_GProps.hxx>
#include <Standard_Failure.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS_Shape.hxx>
#include <gp_Pln.hxx>

#include <cmath>

namespace trimray::oracle {

std::optional<double> section_area_mm2(const std::string& path, const Point& point, const Point& normal)
{
    try {
        std::string error;
        const TopoDS_Shape shape = read_shape(path, error);
        int solids = 0;
        for (TopExp_Explorer solid(shape, TopAbs_SOLID); solid.More(); solid.Next())
            ++solids;
        if (solids != 1)
            return {};
        Bnd_Box box;
        BRepBndLib::Add(shape, box);
        const double far = std::sqrt(box.SquareExtent());
        const gp_Pln plane(gp_Pnt(point[0], point[1], point[2]), gp_Dir(normal[0], normal[1], normal[2]));
        BRepAlgoAPI_Common common(shape, BRepBuilderAPI_MakeFace(plane, -far, far, -far, far).Face());
        if (!common.IsDone() || common.HasErrors())
            return {};
        constexpr double kRelative = 1e-9;
        GProp_GProps properties;
        BRepGProp::SurfaceProperties(common.Shape(), properties, kRelative);
        return properties.Mass();
    } catch (const Standard_Failure&) {
        return {};
    }
}

} // namespace trimray::oracle
