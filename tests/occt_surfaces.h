// Our surfaces as the CAD kernel's and back, for tests that compare the two.
#pragma once

#include "preprocess/import/cad_model.h"

#include <Geom_BSplineCurve.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Geom_ConicalSurface.hxx>
#include <Geom_CylindricalSurface.hxx>
#include <Geom_Plane.hxx>
#include <Geom_SphericalSurface.hxx>
#include <Geom_ToroidalSurface.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColStd_Array2OfReal.hxx>
#include <TColgp_Array1OfPnt.hxx>
#include <TColgp_Array2OfPnt.hxx>
#include <gp_Ax3.hxx>

#include <vector>

namespace trimray::test {

/// Flat knots as distinct values and multiplicities.
struct DistinctKnots {
    TColStd_Array1OfReal values;
    TColStd_Array1OfInteger multiplicities;
};

inline DistinctKnots distinct(const std::vector<double>& flat)
{
    std::vector<double> values;
    std::vector<int> multiplicities;
    for (const double t : flat) {
        if (values.empty() || t != values.back()) {
            values.push_back(t);
            multiplicities.push_back(0);
        }
        ++multiplicities.back();
    }
    const int n = int(values.size());
    DistinctKnots out{TColStd_Array1OfReal(1, n), TColStd_Array1OfInteger(1, n)};
    for (int i = 0; i < n; ++i) {
        out.values(i + 1) = values[i];
        out.multiplicities(i + 1) = multiplicities[i];
    }
    return out;
}

inline Handle(Geom_BSplineSurface) to_kernel(const SplineSurface& s)
{
    TColgp_Array2OfPnt poles(1, s.count_u, 1, s.count_v);
    TColStd_Array2OfReal weights(1, s.count_u, 1, s.count_v);
    for (int i = 0; i < s.count_u; ++i) {
        for (int j = 0; j < s.count_v; ++j) {
            const auto& [x, y, z, w] = s.control_points[size_t(i) * s.count_v + j];
            poles(i + 1, j + 1) = gp_Pnt(x / w, y / w, z / w);
            weights(i + 1, j + 1) = w;
        }
    }
    const DistinctKnots u = distinct(s.knots_u), v = distinct(s.knots_v);
    return new Geom_BSplineSurface(poles, weights, u.values, v.values, u.multiplicities, v.multiplicities, s.degree_u,
                                   s.degree_v);
}

/// Periods are cut open at the first knot, as the importer does; period_u and period_v keep them.
inline CadSurface from_kernel(const Handle(Geom_BSplineSurface) & kernel)
{
    CadSurface out;
    out.kind = kKindBezier;
    out.source_kind = "bspline";
    const Handle(Geom_BSplineSurface) open = Handle(Geom_BSplineSurface)::DownCast(kernel->Copy());
    if (kernel->IsUPeriodic()) {
        out.period_u = kernel->UPeriod();
        open->SetUNotPeriodic();
    }
    if (kernel->IsVPeriodic()) {
        out.period_v = kernel->VPeriod();
        open->SetVNotPeriodic();
    }
    SplineSurface& s = out.spline;
    s.degree_u = open->UDegree();
    s.degree_v = open->VDegree();
    s.count_u = open->NbUPoles();
    s.count_v = open->NbVPoles();
    s.rational = open->IsURational() || open->IsVRational();
    for (const double t : open->UKnotSequence())
        s.knots_u.push_back(t);
    for (const double t : open->VKnotSequence())
        s.knots_v.push_back(t);
    for (int i = 1; i <= s.count_u; ++i) {
        for (int j = 1; j <= s.count_v; ++j) {
            const gp_Pnt p = open->Pole(i, j);
            const double w = s.rational ? open->Weight(i, j) : 1; // opening a period leaves zeros there otherwise
            s.control_points.push_back({w * p.X(), w * p.Y(), w * p.Z(), w});
        }
    }
    double u0, u1, v0, v1;
    open->Bounds(u0, u1, v0, v1);
    out.natural_bounds = {{u0, v0}, {u1, v1}};
    return out;
}

inline gp_Ax3 to_kernel(const CadFrame& f)
{
    gp_Ax3 axes(gp_Pnt(f.origin.x, f.origin.y, f.origin.z), gp_Dir(f.z.x, f.z.y, f.z.z), gp_Dir(f.x.x, f.x.y, f.x.z));
    if (gp_Vec(f.x.x, f.x.y, f.x.z).Crossed(gp_Vec(f.y.x, f.y.y, f.y.z)).Dot(gp_Vec(f.z.x, f.z.y, f.z.z)) < 0)
        axes.YReverse();
    return axes;
}

inline Handle(Geom_Surface) native_to_kernel(const CadSurface& s)
{
    const gp_Ax3 axes = to_kernel(s.frame);
    switch (s.kind) {
    case kKindPlane:
        return new Geom_Plane(axes);
    case kKindCylinder:
        return new Geom_CylindricalSurface(axes, s.radius);
    case kKindCone:
        return new Geom_ConicalSurface(axes, s.half_angle, s.radius);
    case kKindSphere:
        return new Geom_SphericalSurface(axes, s.radius);
    default:
        return new Geom_ToroidalSurface(axes, s.radius, s.minor_radius);
    }
}

} // namespace trimray::test
