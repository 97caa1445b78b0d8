// Faces made by hand for tests of the converter: planes and cylinders with loops of lines and circles in uv_file.
#pragma once

#include "preprocess/import/cad_model.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace trimray {

inline SplineCurve2d line_curve(Vec2d a, Vec2d b)
{
    return {1, false, {0, 0, 1, 1}, {{a.x, a.y, 1}, {b.x, b.y, 1}}};
}

inline CadEdgeUse use_of(SplineCurve2d curve, bool reversed = false)
{
    CadEdgeUse use;
    use.first = curve.knots[curve.degree];
    use.last = curve.knots[curve.control_points.size()];
    use.pcurve = std::move(curve);
    use.reversed = reversed;
    return use;
}

inline CadLoop polygon_loop(const std::vector<Vec2d>& corners)
{
    CadLoop loop;
    for (size_t i = 0; i < corners.size(); ++i)
        loop.push_back(use_of(line_curve(corners[i], corners[(i + 1) % corners.size()])));
    return loop;
}

/// A full circle as the kernel writes it: a rational quadratic of four quadrants.
inline SplineCurve2d circle_curve(Vec2d c, double r, bool clockwise = false)
{
    const double h = std::sqrt(0.5);
    const double x[9] = {1, 1, 0, -1, -1, -1, 0, 1, 1}, y[9] = {0, 1, 1, 1, 0, -1, -1, -1, 0};
    SplineCurve2d curve{2, true, {0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4}, {}};
    for (int i = 0; i < 9; ++i) {
        const double w = i % 2 == 0 ? 1 : h;
        curve.control_points.push_back({w * (c.x + r * x[i]), w * (c.y + (clockwise ? -r : r) * y[i]), w});
    }
    return curve;
}

inline CadFace plane_face(std::vector<CadLoop> loops)
{
    CadFace face;
    face.surface.kind = kKindPlane;
    face.surface.natural_bounds = {{-1e100, -1e100}, {1e100, 1e100}};
    face.loops = std::move(loops);
    uint32_t edge = 0; // each its own
    for (CadLoop& loop : face.loops)
        for (CadEdgeUse& use : loop)
            use.edge = edge++;
    return face;
}

inline CadSurface cylinder_surface(double radius)
{
    CadSurface surface;
    surface.kind = kKindCylinder;
    surface.radius = radius;
    surface.period_u = 2 * M_PI;
    surface.natural_bounds = {{0, -1e100}, {2 * M_PI, 1e100}};
    return surface;
}

inline CadSurface sphere_surface(double radius)
{
    CadSurface surface;
    surface.kind = kKindSphere;
    surface.radius = radius;
    surface.period_u = 2 * M_PI;
    surface.natural_bounds = {{0, -M_PI / 2}, {2 * M_PI, M_PI / 2}};
    return surface;
}

inline CadSurface torus_surface(double radius, double minor_radius)
{
    CadSurface surface;
    surface.kind = kKindTorus;
    surface.radius = radius;
    surface.minor_radius = minor_radius;
    surface.period_u = surface.period_v = 2 * M_PI;
    surface.natural_bounds = {{0, 0}, {2 * M_PI, 2 * M_PI}};
    return surface;
}

inline CadFace cylinder_face(double radius, std::vector<CadLoop> loops)
{
    CadFace face = plane_face(std::move(loops));
    face.surface = cylinder_surface(radius);
    return face;
}

/// The loop walked the other way round.
inline CadLoop turned(CadLoop loop)
{
    std::reverse(loop.begin(), loop.end());
    for (CadEdgeUse& use : loop)
        use.reversed = !use.reversed;
    return loop;
}

} // namespace trimray
