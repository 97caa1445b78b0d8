#include "runtime/view/proxy_view.h"

#include "runtime/camera_frame.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trimray {
namespace {

/// View coordinates of a way in the world.
std::array<double, 3> in_view(const CameraAxes& axes, const std::array<double, 3>& way)
{
    using camera_math::dot;
    return {dot(axes.right, way), dot(axes.up, way), dot(axes.forward, way)};
}

} // namespace

ProxyProjection proxy_projection(const Camera& camera, const PlacementView& placed, PictureSize size)
{
    using namespace camera_math;
    const CameraAxes axes = camera_axes(camera);
    double nearest = std::numeric_limits<double>::infinity(), farthest = -nearest;
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 p;
        for (size_t i = 0; i < 3; ++i)
            p[i] = (corner >> i & 1) != 0 ? placed.bounds_hi_mm[i] : placed.bounds_lo_mm[i];
        const double depth = dot(p - camera.eye, axes.forward);
        nearest = std::min(nearest, depth);
        farthest = std::max(farthest, depth);
    }
    // the proxy's rounding and chords may leave the bounds
    const double room = 0.01 * (farthest - nearest) + 1e-6 * std::abs(farthest);
    nearest -= room;
    farthest += room;
    ProxyProjection out;
    out.parallel = camera.orthographic_mm > 0;
    const double half_y = out.parallel ? 0.5 * camera.orthographic_mm : half_height(camera.fov_deg);
    out.scale_y = 1 / half_y;
    out.scale_x = out.scale_y * size.height / size.width;
    if (out.parallel) {
        nearest = std::max(nearest, 0.0); // as CameraRays::plane_mm
        farthest = std::max(farthest, nearest + 1e-6);
        out.depth_scale = 2 / (farthest - nearest);
        out.depth_offset = -(farthest + nearest) / (farthest - nearest);
        return out;
    }
    constexpr double kNearest = 1.0 / 8192; // of the farthest: of 24 bits of depth enough are left
    farthest = std::max(farthest, 1e-6);
    nearest = std::clamp(nearest, kNearest * farthest, 0.5 * farthest);
    out.depth_scale = (farthest + nearest) / (farthest - nearest);
    out.depth_offset = -2 * farthest * nearest / (farthest - nearest);
    return out;
}

std::array<std::array<float, 4>, 3> proxy_placement(const Camera& camera, const PlacementView& placed,
                                                    uint32_t instance)
{
    using namespace camera_math;
    const double(&m)[12] = placed.instances[instance].transform;
    const PartRecord& part = placed.parts[placed.instances[instance].part];
    const CameraAxes axes = camera_axes(camera);
    std::array<std::array<float, 4>, 3> rows{};
    for (size_t c = 0; c < 4; ++c) {
        // p_world = M (origin + scale p) + m: a column of scale M, or what is left of it at p = 0
        Vec3 column{};
        for (size_t row = 0; row < 3; ++row) {
            const double* r = m + 4 * row;
            column[row] = c < 3 ? r[c] * part.scale_mm
                                : r[0] * part.origin_mm[0] + r[1] * part.origin_mm[1] + r[2] * part.origin_mm[2] +
                                      r[3] - camera.eye[row];
        }
        const Vec3 view = in_view(axes, column);
        for (size_t row = 0; row < 3; ++row)
            rows[row][c] = static_cast<float>(view[row]);
    }
    return rows;
}

std::vector<std::array<float, 4>> proxy_cuts(const Camera& camera, const SectionLook& section)
{
    using namespace camera_math;
    constexpr size_t kMost = 6; // as SectionLook says
    const CameraAxes axes = camera_axes(camera);
    std::vector<std::array<float, 4>> cuts;
    for (const SectionPlane& plane : section.planes) {
        if (cuts.size() == kMost)
            break;
        const Vec3 normal = normalised(plane.normal, {0, 0, 1});
        const Vec3 view = in_view(axes, normal);
        cuts.push_back(
            {float(view[0]), float(view[1]), float(view[2]), float(dot(normal, camera.eye - plane.point_mm))});
    }
    return cuts;
}

} // namespace trimray
