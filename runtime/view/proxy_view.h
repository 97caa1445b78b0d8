// A camera and placements as the first picture's shaders take them. View coordinates: mm from the eye, x to the
// picture's right, y to its top, z into it.
#pragma once

#include "runtime/camera.h"
#include "runtime/picture_size.h"
#include "runtime/placement_view.h"
#include "runtime/scene_look.h"

#include <array>
#include <vector>

namespace trimray {

/// Clip coordinates from view coordinates v: (v.x scale_x, v.y scale_y, depth_scale v.z + depth_offset, w), w = v.z of
/// a pinhole, 1 of parallel rays. What the tracers show is between the planes near and far.
struct ProxyProjection {
    bool parallel = false;
    double scale_x = 1, scale_y = 1, depth_scale = 1, depth_offset = 0;
    bool operator==(const ProxyProjection&) const = default;
};

/// Near and far hold what is placed, and a little more; near is in front of the eye.
ProxyProjection proxy_projection(const Camera& camera, const PlacementView& placed, PictureSize size);

/// A part's units to view coordinates: rows of a 3 x 4 matrix.
std::array<std::array<float, 4>, 3> proxy_placement(const Camera& camera, const PlacementView& placed,
                                                    uint32_t instance);

/// What is cut away of a section: points v with plane . (v, 1) > 0. Six at most.
std::vector<std::array<float, 4>> proxy_cuts(const Camera& camera, const SectionLook& section);

} // namespace trimray
