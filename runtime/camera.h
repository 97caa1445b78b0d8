// Pinhole or orthographic camera. Pixel centres at +0.5, row 0 at the top, vertical field of view, millimetres,
// right-handed, z up by default.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace trimray {

struct Camera {
    std::array<double, 3> eye{0, 0, 0}, target{0, 0, -1}, up{0, 0, 1};
    double fov_deg = 35;        // vertical
    double orthographic_mm = 0; // height of what is seen, rays all parallel to target - eye; 0: perspective
};

/// The camera's ray through pixel coordinates (x, y) is eye + t * normalize(corner + x * step_x + y * step_y), t in mm.
/// An orthographic camera is a pinhole so far back that its rays are parallel to 1.7e-8 of the picture's height: what
/// lies nearer than `plane_mm` is behind the camera's own place and not seen, and depth counts from there.
struct CameraRays {
    std::array<double, 3> eye, corner, step_x, step_y;
    double plane_mm = 0; // along the middle of the view; 0: perspective
};

/// Fails never: eye = target or up along the view are mended as documented in camera.cpp.
CameraRays camera_rays(const Camera& camera, uint32_t width, uint32_t height);

/// The rays of an orthographic camera as they are: through pixel coordinates (x, y) from corner + x * step_x + y *
/// step_y, all along `direction`, unit. Domain: camera.orthographic_mm > 0.
struct ParallelRays {
    std::array<double, 3> corner, step_x, step_y, direction;
};
ParallelRays parallel_rays(const Camera& camera, uint32_t width, uint32_t height);

/// Largest of p . direction over the points p of what is framed, world mm.
using Reach = std::function<double(const std::array<double, 3>& direction)>;

/// The names of views, iso first.
const std::vector<std::string>& standard_view_names();

/// Frames something whole from a named view: iso, front, back, left, right, top, bottom. Empty name: iso. False: no
/// such view. front looks along +y, right along -x, top along -z (z is up); iso from (1, -1, 1).
bool standard_view(const std::string& name, const Reach& reach, double aspect, double fov_deg, Camera& camera);

/// Likewise by parallel rays, from before what is framed. height_mm: of what is seen, around its middle; 0: so much
/// that it is seen whole.
bool standard_orthographic_view(const std::string& name, const Reach& reach, double aspect, double height_mm,
                                Camera& camera);

} // namespace trimray
