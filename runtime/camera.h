// Pinhole or orthographic camera. Pixel centres at +0.5, row 0 at the top, vertical field of view, millimetres,
// right-handed, z up by default.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>

namespace trimray {

struct Camera {
    std::array<double, 3> eye{0, 0, 0}, target{0, 0, -1}, up{0, 0, 1};
    double fov_deg = 35;        // vertical
    double orthographic_mm = 0; // height of what is seen, rays all parallel to target - eye; 0: perspective
};

/// The camera's ray through pixel coordinates (x, y) is eye + t * normalize(corner + x * step_x + y * step_y), t in mm.
struct CameraRays {
    std::array<double, 3> eye, corner, step_x, step_y;
};

/// Fails never: eye = target or up along the view are mended as documented in camera.cpp.
CameraRays camera_rays(const Camera& camera, uint32_t width, uint32_t height);

/// Largest of p . direction over the points p of what is framed, world mm.
using Reach = std::function<double(const std::array<double, 3>& direction)>;

/// Frames something whole from a named view: iso, front, back, left, right, top, bottom. Empty name: iso. False: no
/// such view. front looks along +y, right along -x, top along -z (z is up); iso from (1, -1, 1).
bool standard_view(const std::string& name, const Reach& reach, double aspect, double fov_deg, Camera& camera);

} // namespace trimray
