// A Bezier patch as a surface over [0, 1]^2, so that it can be evaluated as splines are.
#pragma once

#include "preprocess/bezier_patch.h"

namespace trimray::test {

inline CadSurface as_surface(const BezierPatch& patch)
{
    CadSurface s;
    s.kind = kKindBezier;
    s.spline.degree_u = patch.degree_u;
    s.spline.degree_v = patch.degree_v;
    s.spline.count_u = patch.degree_u + 1;
    s.spline.count_v = patch.degree_v + 1;
    s.spline.rational = patch.rational;
    s.spline.knots_u.assign(patch.degree_u + 1, 0.0);
    s.spline.knots_u.insert(s.spline.knots_u.end(), patch.degree_u + 1, 1.0);
    s.spline.knots_v.assign(patch.degree_v + 1, 0.0);
    s.spline.knots_v.insert(s.spline.knots_v.end(), patch.degree_v + 1, 1.0);
    s.spline.control_points = patch.control_points;
    return s;
}

} // namespace trimray::test
