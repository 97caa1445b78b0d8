// The area that trims leave of a surface, by numerical integration over the inside of their loops.
#pragma once

#include "format/trim_piece.h"
#include "preprocess/bezier_patch.h"
#include "preprocess/trims/trim_loop.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace trimray {

/// Integral of |S_u x S_v| over the inside (even-odd), in mm^2: Gauss points in v between the heights at which pieces
/// end, in u within each inside stretch. Good to about 1e-6 where the surface is smooth.
inline double trimmed_area(const CadSurface& surface, const TrimLoops& loops)
{
    constexpr double kX[4] = {0.0694318442029737, 0.3300094782075719, 0.6699905217924281, 0.9305681557970263};
    constexpr double kW[4] = {0.1739274225687269, 0.3260725774312731, 0.3260725774312731, 0.1739274225687269};
    const double width = loops.domain.hi.x - loops.domain.lo.x, height = loops.domain.hi.y - loops.domain.lo.y;
    std::vector<double> heights{0, 1};
    std::vector<MonotonePiece> pieces;
    for (const uint32_t word : loops.pieces) {
        pieces.push_back(load_piece(loops.points.data(), 0, word));
        heights.push_back(pieces.back().v[0]);
    }
    const bool simple = surface.kind == kKindPlane || surface.kind == kKindCylinder || surface.kind == kKindCone;
    const int rows = pieces.size() > 200 ? 2 : simple ? 64 : 8;
    for (int i = 1; i < rows; ++i)
        heights.push_back(static_cast<double>(i) / rows);
    if (surface.kind == kKindBezier)
        for (const double k : surface.spline.knots_v)
            if (k > loops.domain.lo.y && k < loops.domain.hi.y)
                heights.push_back((k - loops.domain.lo.y) / height);
    std::sort(heights.begin(), heights.end());
    heights.erase(std::unique(heights.begin(), heights.end()), heights.end());

    const auto density = [&](double u, double v) {
        const SurfaceDerivatives s = evaluate(surface, loops.domain.lo.x + u * width, loops.domain.lo.y + v * height);
        return std::hypot(s.du.y * s.dv.z - s.du.z * s.dv.y, s.du.z * s.dv.x - s.du.x * s.dv.z,
                          s.du.x * s.dv.y - s.du.y * s.dv.x);
    };
    std::vector<double> knots;
    if (surface.kind == kKindBezier)
        for (const double k : surface.spline.knots_u)
            if (k > loops.domain.lo.x && k < loops.domain.hi.x)
                knots.push_back((k - loops.domain.lo.x) / width);
    knots.erase(std::unique(knots.begin(), knots.end()), knots.end());

    double area = 0;
    for (size_t h = 0; h + 1 < heights.size(); ++h)
        for (int i = 0; i < 4; ++i) {
            // a round loop's width grows as a square root from its ends: 3 s^2 - 2 s^3 takes the edge off
            const double s3 = kX[i] * kX[i] * (3 - 2 * kX[i]);
            const double v = heights[h] + s3 * (heights[h + 1] - heights[h]);
            const double dv = 6 * kX[i] * (1 - kX[i]) * (heights[h + 1] - heights[h]);
            std::vector<double> crossings;
            for (const MonotonePiece& p : pieces)
                if (p.v_lo() <= v && v < p.v_hi())
                    crossings.push_back(u_at_v(p, v));
            if (loops.natural_border)
                crossings = {0, 1};
            std::sort(crossings.begin(), crossings.end());
            double row = 0;
            for (size_t c = 0; c + 1 < crossings.size(); c += 2) {
                if (simple) { // does not depend on u
                    row += (crossings[c + 1] - crossings[c]) * density(crossings[c], v);
                    continue;
                }
                std::vector<double> stops{crossings[c], crossings[c + 1]};
                for (const double k : knots)
                    if (k > crossings[c] && k < crossings[c + 1])
                        stops.push_back(k);
                for (int s = 1; s < 4; ++s)
                    stops.push_back(crossings[c] + (crossings[c + 1] - crossings[c]) * s / 4);
                std::sort(stops.begin(), stops.end());
                for (size_t s = 0; s + 1 < stops.size(); ++s)
                    for (int j = 0; j < 4; ++j)
                        row += kW[j] * (stops[s + 1] - stops[s]) *
                               density(stops[s] + kX[j] * (stops[s + 1] - stops[s]), v);
            }
            area += kW[i] * dv * row;
        }
    return area * width * height;
}

} // namespace trimray
