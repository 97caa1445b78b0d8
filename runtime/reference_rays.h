// The rays of a picture in double, as the reference casts them: through any place of the picture, not pixels' middles
// alone.
#pragma once

#include "format/reference_math.h"
#include "runtime/camera.h"

#include <algorithm>
#include <cstdint>

namespace trimray {

class ReferenceRays {
public:
    ReferenceRays(const Camera& camera, uint32_t width, uint32_t height)
        : parallel_(camera.orthographic_mm > 0), from_eye_(camera_rays(camera, width, height)),
          side_by_side_(parallel_rays(camera, width, height))
    {
    }

    /// The ray through pixel coordinates (x, y); its direction is not unit.
    reference::Ray through(double x, double y) const
    {
        using reference::operator*;
        using reference::operator+;
        if (parallel_)
            return {side_by_side_.corner + side_by_side_.step_x * x + side_by_side_.step_y * y,
                    side_by_side_.direction};
        return {from_eye_.eye, from_eye_.corner + from_eye_.step_x * x + from_eye_.step_y * y};
    }

    /// A pixel's width, mm, at a distance along the ray through (x, y).
    double footprint_mm(double x, double y, double distance_mm) const
    {
        using reference::length;
        if (parallel_)
            return std::max(length(side_by_side_.step_x), length(side_by_side_.step_y));
        const double angle =
            std::max(length(from_eye_.step_x), length(from_eye_.step_y)) / length(through(x, y).direction);
        return distance_mm * angle;
    }

private:
    bool parallel_;
    CameraRays from_eye_;
    ParallelRays side_by_side_;
};

} // namespace trimray
