#include "runtime/trim_errors.h"

#include "format/record_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trimray {
namespace {

using Vec3 = std::array<double, 3>;

Vec3 cross(const Vec3& a, const Vec3& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot(const Vec3& a, const Vec3& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// The patch of a face that (u, v) lies in: the one whose rectangle of uv_face is nearest.
const PatchRecord& patch_at(const PackImage& image, const FaceRecord& face, double u, double v)
{
    if (face.surface_kind != kKindBezier || face.patch_count == 1)
        return image.patches[face.first_patch];
    uint best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (uint i = 0; i < face.patch_count; ++i) {
        const PatchRecord& patch = image.patches[face.first_patch + i];
        const double away_u = std::abs((u - patch.uv_offset[0]) / patch.uv_scale[0] - 0.5);
        const double away_v = std::abs((v - patch.uv_offset[1]) / patch.uv_scale[1] - 0.5);
        const double away = std::max(away_u, away_v);
        if (away < least) {
            least = away;
            best = i;
        }
    }
    return image.patches[face.first_patch + best];
}

Vec3 world_point(const PackImage& image, uint instance_id, const PatchRecord& patch, double u, double v)
{
    const InstanceRecord& instance = image.instances[instance_id];
    const PartRecord& part = image.parts[instance.part];
    const Vec3 q = point_of(patch, image.control_points.data(), (u - patch.uv_offset[0]) / patch.uv_scale[0],
                            (v - patch.uv_offset[1]) / patch.uv_scale[1]);
    Vec3 p, world;
    for (size_t c = 0; c < 3; ++c) {
        const double along = patch.axis_x[c] * q[0] + patch.axis_y[c] * q[1] + patch.axis_z[c] * q[2];
        const double in_part = double(patch.origin_hi[c]) + double(patch.origin_lo[c]) + patch.scale * along;
        p[c] = part.origin_mm[c] + part.scale_mm * in_part;
    }
    for (size_t row = 0; row < 3; ++row) {
        const double* m = instance.transform + 4 * row;
        world[row] = m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3];
    }
    return world;
}

/// p - eye = t (corner + x step_x + y step_y), solved for x and y.
std::array<double, 2> pixel_of(const CameraRays& rays, const Vec3& p)
{
    const Vec3 d{p[0] - rays.eye[0], p[1] - rays.eye[1], p[2] - rays.eye[2]};
    const double t = dot(d, cross(rays.step_x, rays.step_y)); // all three times one determinant
    const double x = dot(d, cross(rays.step_y, rays.corner)), y = dot(d, cross(rays.corner, rays.step_x));
    return {x / t, y / t};
}

/// The distance in pixels from the hit at pixel i of `frame` to the border of its face; 0 for a miss.
double border_distance_px(const PackImage& image, const TrimReference& reference, const CameraRays& rays,
                          const Frame& frame, size_t i)
{
    if (frame.face[i] < 0)
        return 0;
    const uint face_id = static_cast<uint>(frame.face[i]);
    const FaceRecord& face = image.faces[face_id];
    double uv[2];
    for (size_t c = 0; c < 2; ++c)
        uv[c] = (frame.uv[2 * i + c] - face.domain_lo[c]) / (face.domain_hi[c] - face.domain_lo[c]);
    const UvMap change = pixel_of_face(image, rays, static_cast<uint>(frame.instance[i]), face_id, uv[0], uv[1]).change;
    const double distance = reference.distance(face_id, uv[0], uv[1], change);
    return std::isfinite(distance) ? distance : 0; // a face without a border was not decided wrongly
}

} // namespace

PixelOfFace pixel_of_face(const PackImage& image, const CameraRays& rays, uint instance, uint face, double u, double v)
{
    constexpr double kStep = 1e-6; // of the domain: rounding of a double and the surface's bend both stay below 1e-5
    const PatchRecord& patch = patch_at(image, image.faces[face], u, v);
    const auto at = [&](double du, double dv) {
        return pixel_of(rays, world_point(image, instance, patch, u + du, v + dv));
    };
    PixelOfFace out;
    out.at = at(0, 0);
    const auto [left, right, down, up] = std::array{at(-kStep, 0), at(kStep, 0), at(0, -kStep), at(0, kStep)};
    out.change.uu = (right[0] - left[0]) / (2 * kStep);
    out.change.vu = (right[1] - left[1]) / (2 * kStep);
    out.change.uv = (up[0] - down[0]) / (2 * kStep);
    out.change.vv = (up[1] - down[1]) / (2 * kStep);
    return out;
}

TrimErrors trim_errors(const PackImage& image, const TrimReference& reference, const CameraRays& rays,
                       const Frame& frame, const Frame& reference_frame)
{
    TrimErrors out;
    out.rays = frame.face.size();
    for (size_t i = 0; i < frame.face.size(); ++i) {
        // rays are traced alike in all modes, so equal hits are equal bit for bit
        if (frame.face[i] == reference_frame.face[i] && frame.instance[i] == reference_frame.instance[i] &&
            frame.depth_mm[i] == reference_frame.depth_mm[i])
            continue;
        ++out.wrong_rays;
        // a hit before the reference's was kept and should not have been; else the reference's was lost
        const bool kept = frame.depth_mm[i] < reference_frame.depth_mm[i];
        const double error = border_distance_px(image, reference, rays, kept ? frame : reference_frame, i);
        out.largest_border_error_px = std::max(out.largest_border_error_px, error);
    }
    out.psnr_db = psnr_db(over_white(frame), over_white(reference_frame));
    return out;
}

} // namespace trimray
