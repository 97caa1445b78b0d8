// What there is to say of a place that was picked in a picture: which face it is on, what surface that is, and the
// exact point, normal, radii and axis there. The pack's own accuracy remains: its numbers are the file's rounded to
// about 1e-7 of a face's size.
#pragma once

#include "format/pack_image.h"
#include "runtime/view/placed_surface.h"

#include <array>
#include <optional>
#include <string>

namespace trimray {

/// What a pixel of a traced frame says.
struct PickedPlace {
    uint face = 0, instance = 0;
    UvPoint uv_file{};
    std::optional<reference::Ray> ray; // of the pixel, world mm; with it the point is moved to where both meet
};

/// A line in the world; unit direction.
struct AxisLine {
    reference::Vec3 point{}, direction{};
};

struct SurfaceFacts {
    uint face = 0, instance = 0;
    std::string part_name, placement_name, face_name; // empty: unnamed in the file
    uint face_in_part = 0; // its number in the file's part, counted from 0 over converted and dropped faces
    uint kind = 0;         // kKind... of the file's surface
    const char* kind_name = "";
    UvPoint uv_file{}, uv_face{};
    reference::Vec3 point_mm{};
    double off_ray_mm = 0;    // of the point from the ray's line; 0 without a ray. Rounding, unless the ray grazes
    reference::Vec3 normal{}; // unit, outward; 0 where there is none

    // Told where the placement is a turn, a mirroring and one scale, and the pack holds the surface in its own form
    std::optional<double> radius_mm;      // cylinder, sphere; cone: at the point; torus: of its middle circle
    std::optional<double> tube_radius_mm; // torus
    std::optional<double> half_angle_deg; // cone: between axis and rulings
    std::optional<AxisLine> axis;         // cylinder, cone: its point beside the picked one; torus: through its centre
    std::optional<reference::Vec3> centre_mm; // sphere, torus

    std::optional<PrincipalCurvatures> curvatures; // of what is not a plane, in any placement
};

/// Domain: a validated image; a face of the instance's part.
SurfaceFacts surface_facts(const PackImage& image, const PickedPlace& place);

} // namespace trimray
