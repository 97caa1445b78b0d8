// The oracle's curvatures: the kernel's own at a surface's parameters.
#include "tests/occt_oracle_impl.h"

#include <BRepAdaptor_Surface.hxx>
#include <BRep_Tool.hxx>
#include <GeomLProp_SLProps.hxx>
#include <Geom_Surface.hxx>
#include <Standard_Failure.hxx>
#include <Standard_Type.hxx>

#include <algorithm>
#include <array>
#include <cmath>

namespace trimray::oracle {
namespace {

const char* surface_name(GeomAbs_SurfaceType type)
{
    constexpr std::array<const char*, 11> names = {"plane",   "cylinder", "cone",      "sphere", "torus", "bezier",
                                                   "bspline", "revolved", "extrusion", "offset", "other"};
    return size_t(type) < names.size() ? names[size_t(type)] : "other";
}

} // namespace

std::optional<KernelCurvatures> Oracle::curvatures(const OracleHit& hit, const Point& outward) const
{
    constexpr double kResolution = 1e-12; // mm: below it a derivative is none
    const PlacedFace& placed = impl_->placed[size_t(hit.face)];
    const TopoDS_Face& face = impl_->unique[placed.unique];
    const Handle(Geom_Surface) surface = BRep_Tool::Surface(face);
    GeomLProp_SLProps properties(surface, hit.u, hit.v, 2, kResolution);
    if (!properties.IsNormalDefined() || !properties.IsCurvatureDefined())
        return std::nullopt;
    KernelCurvatures k;
    const gp_Dir normal = properties.Normal().Transformed(placed.to_world);
    // a transform of directions keeps their length, and mirrors them where it mirrors
    k.normal = {normal.X(), normal.Y(), normal.Z()};
    double along = 0;
    for (size_t i = 0; i < 3; ++i)
        along += k.normal[i] * outward[i];
    // the kernel's are positive where the surface bends towards its normal
    const double turn = along < 0 ? 1 : -1, per_mm = turn * placed.local_scale;
    const double a = properties.MaxCurvature() * per_mm, b = properties.MinCurvature() * per_mm;
    k.larger = std::max(a, b);
    k.smaller = std::min(a, b);
    k.mean = properties.MeanCurvature() * per_mm;
    k.gaussian = properties.GaussianCurvature() * per_mm * per_mm;
    k.surface = surface_name(BRepAdaptor_Surface(face, false).GetType());
    return k;
}

} // namespace trimray::oracle
