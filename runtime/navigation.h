// How a hand moves a camera: functions from a camera and the way of a pointer, in pixels of the picture (x to the
// right, y down), to the camera afterwards. The target is the point that is turned about.
#pragma once

#include "runtime/camera.h"
#include "runtime/picture_size.h"

#include <array>
#include <cstdint>
#include <optional>

namespace trimray {

/// What turning keeps.
enum class Turning {
    Turntable, // the world's up stays up in the picture; it stops short of looking straight up or down
    Free,      // nothing: the camera turns about the picture's own axes
};

/// Turns about the target, half a turn for the picture's height; what is under the pointer moves with it.
/// `world_up`: for Turntable.
Camera orbit(const Camera& camera, double dx_px, double dy_px, PictureSize size, Turning turning,
             const std::array<double, 3>& world_up);

/// Moves camera and target so that what is as far away as the target moves with the pointer, exactly.
Camera pan(const Camera& camera, double dx_px, double dy_px, PictureSize size);

/// The point of the plane through the target, parallel to the picture, that is seen at pixel coordinates (x, y).
std::array<double, 3> point_at_target(const Camera& camera, double x_px, double y_px, PictureSize size);

/// The pixel coordinates that a point is seen at. Nothing: it is not in front of a pinhole's eye.
std::optional<std::array<double, 2>> seen_at(const Camera& camera, const std::array<double, 3>& point,
                                             PictureSize size);

/// Comes nearer to a point, which stays where it is in the picture: all distances to it become `scale` of what they
/// were, below 1 to come nearer. Domain: scale > 0.
Camera zoom_about(const Camera& camera, const std::array<double, 3>& point, double scale);

/// Turns about the middle of the picture, clockwise as the model is seen.
Camera roll(const Camera& camera, double degrees);

/// Parallel rays that show the target's surroundings as large as this camera does, and the other way: with `fov_deg` as
/// it is. A camera that is so already stays.
Camera with_parallel_rays(const Camera& camera);
Camera with_perspective(const Camera& camera);

/// The camera with its target, about which it turns, in the depth of the middle of what it shows.
Camera turning_about_middle(Camera camera, const Reach& reach);

} // namespace trimray
