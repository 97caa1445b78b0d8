// Faces of one Bezier patch each, from control points in patch units.
#pragma once

#include "tests/traced_scenes.h"

#include <array>
#include <functional>

namespace trimray::hard {

/// A control point (x, y, z) and its weight. Domain: |(x, y, z)| <= 1, w > 0.
using NetPoint = std::array<double, 4>;

/// Adds an untrimmed face whose control point (i, j), 0 <= i <= degree_u, 0 <= j <= degree_v, is point(i, j). Its patch
/// unit is `scale` part units of 10 mm. Polynomial where `rational` is false: then weights are not asked for.
inline PatchRecord& add_net(TracedScene& scene, int degree_u, int degree_v, bool rational,
                            const std::function<NetPoint(int i, int j)>& point, double scale = 1,
                            std::array<double, 3> origin = {0, 0, 0})
{
    PatchRecord& patch = scene.add_bezier(degree_u, degree_v, rational, scale, origin);
    for (int i = 0; i <= degree_u; ++i)
        for (int j = 0; j <= degree_v; ++j) {
            const auto [x, y, z, w] = point(i, j);
            const double weight = rational ? w : 1;
            for (const double c : {x, y, z})
                scene.image.control_points.push_back(static_cast<float>(weight * c));
            if (rational)
                scene.image.control_points.push_back(static_cast<float>(weight));
        }
    return patch;
}

} // namespace trimray::hard
