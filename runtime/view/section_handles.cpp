#include "runtime/view/section_handles.h"

#include "runtime/camera_frame.h"
#include "runtime/navigation.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trimray {
namespace {

using namespace camera_math;

constexpr double kRoom = 0.04;         // of the box's size, that rims are outside of it
constexpr double kLeastSine = 0.2;     // of the angle between view and normal: below it moves are by pixels
constexpr double kSnapCosine = 0.9976; // 4 degrees: a normal so near to an axis is the axis

double length(const Vec3& v)
{
    return std::sqrt(dot(v, v));
}

struct Ray {
    Vec3 origin, along; // along: of length 1
};

Ray ray_through(const Camera& camera, PictureSize size, const std::array<double, 2>& pixel)
{
    const Vec3 forward = camera_axes(camera).forward;
    const Vec3 seen = point_at_target(camera, pixel[0], pixel[1], size);
    if (camera.orthographic_mm > 0)
        return {seen, forward};
    return {camera.eye, normalised(seen - camera.eye, forward)};
}

/// Millimetres a pixel, as far away as the point.
double pixel_mm_at(const Camera& camera, const Vec3& point, PictureSize size)
{
    const double height = camera.orthographic_mm > 0
                              ? camera.orthographic_mm
                              : 2 * half_height(camera.fov_deg) * dot(point - camera.eye, camera_axes(camera).forward);
    return height / size.height;
}

/// Where a plane leaves a box: corners in order about its normal. Fewer than 3: it does not meet it.
std::vector<Vec3> rim_of(const Vec3& normal, double offset, const Vec3& lo, const Vec3& hi)
{
    const auto corner = [&](unsigned which) {
        return Vec3{which & 1u ? hi[0] : lo[0], which & 2u ? hi[1] : lo[1], which & 4u ? hi[2] : lo[2]};
    };
    std::vector<Vec3> rim;
    for (unsigned from = 0; from < 8; ++from)
        for (unsigned axis = 1; axis < 8; axis <<= 1) {
            if ((from & axis) != 0)
                continue;
            const Vec3 a = corner(from), b = corner(from | axis);
            const double above_a = dot(normal, a) - offset, above_b = dot(normal, b) - offset;
            if ((above_a < 0) != (above_b < 0))
                rim.push_back(a + (b - a) * (above_a / (above_a - above_b)));
        }
    if (rim.size() < 3)
        return {};
    Vec3 middle{};
    for (const Vec3& p : rim)
        middle = middle + p * (1.0 / double(rim.size()));
    const Vec3 aside = cross(normal, std::abs(normal[2]) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0});
    const Vec3 x = normalised(aside, {1, 0, 0}), y = cross(normal, x);
    std::sort(rim.begin(), rim.end(), [&](const Vec3& a, const Vec3& b) {
        return std::atan2(dot(a - middle, y), dot(a - middle, x)) < std::atan2(dot(b - middle, y), dot(b - middle, x));
    });
    return rim;
}

/// The middle of a convex polygon's area.
Vec3 middle_of(const std::vector<Vec3>& rim)
{
    Vec3 sum{};
    double area = 0;
    for (size_t i = 1; i + 1 < rim.size(); ++i) {
        const double part = length(cross(rim[i] - rim[0], rim[i + 1] - rim[0]));
        sum = sum + (rim[0] + rim[i] + rim[i + 1]) * (part / 3);
        area += part;
    }
    return area > 0 ? sum * (1 / area) : rim.front();
}

/// Of a point to a line from a to b; `t`: where it is nearest, 0 at a, 1 at b.
double distance_px(const std::array<double, 2>& p, const std::array<double, 2>& a, const std::array<double, 2>& b,
                   double& t)
{
    const double dx = b[0] - a[0], dy = b[1] - a[1], square = dx * dx + dy * dy;
    t = square > 0 ? std::clamp(((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / square, 0.0, 1.0) : 0.0;
    return std::hypot(p[0] - a[0] - t * dx, p[1] - a[1] - t * dy);
}

/// How far along a unit normal, from a point, a ray comes nearest to it. Domain: they are not parallel.
double along_normal(const Vec3& from, const Vec3& normal, const Ray& ray)
{
    const Vec3 way = ray.origin - from;
    const double cosine = dot(ray.along, normal);
    return (dot(way, normal) - dot(way, ray.along) * cosine) / (1 - cosine * cosine);
}

double moved_by(const GrippedSection& gripped, const Camera& camera, PictureSize size,
                const std::array<double, 2>& from, const std::array<double, 2>& to)
{
    const Vec3& normal = gripped.handle.normal;
    const Ray before = ray_through(camera, size, from), after = ray_through(camera, size, to);
    const double along = dot(before.along, normal), cosine = dot(after.along, normal);
    if (1 - along * along < kLeastSine * kLeastSine || 1 - cosine * cosine < 0.25 * kLeastSine * kLeastSine)
        return -std::copysign(1.0, along) * (to[1] - from[1]) * pixel_mm_at(camera, gripped.handle.middle, size);
    return along_normal(gripped.at, normal, after) - along_normal(gripped.at, normal, before);
}

/// Where a ray meets the sphere that the ball goes round on, from its middle, of length 1: on the half that the ball
/// was on; a ray that passes by, where it comes nearest.
Vec3 turned_to(const SectionHandle& handle, const Ray& ray)
{
    const double radius = length(handle.tip - handle.middle);
    const Vec3 way = handle.middle - ray.origin;
    const double nearest = dot(way, ray.along);
    const Vec3 across = ray.along * nearest - way; // from the middle
    const double half_chord = std::sqrt(std::max(radius * radius - dot(across, across), 0.0));
    const double side = dot(handle.normal, ray.along) > 0 ? 1 : -1;
    return normalised(across + ray.along * (side * half_chord), handle.normal);
}

Vec3 snapped(const Vec3& normal)
{
    for (size_t axis = 0; axis < 3; ++axis)
        if (std::abs(normal[axis]) >= kSnapCosine) {
            Vec3 exact{};
            exact[axis] = std::copysign(1.0, normal[axis]);
            return exact;
        }
    return normal;
}

} // namespace

SectionPlane section_through_middle(const PlacementView& placed, size_t axis)
{
    SectionPlane plane;
    for (size_t i = 0; i < 3; ++i)
        plane.point_mm[i] = 0.5 * (placed.bounds_lo_mm[i] + placed.bounds_hi_mm[i]);
    plane.normal = {0, 0, 0};
    plane.normal[axis] = axis == 1 ? -1 : 1; // the front is towards -y
    return plane;
}

std::vector<SectionHandle> section_handles(const SectionLook& section, const PlacementView& placed,
                                           const Camera& camera, PictureSize size, double arrow_px)
{
    Vec3 lo, hi;
    for (size_t i = 0; i < 3; ++i) {
        lo[i] = placed.bounds_lo_mm[i];
        hi[i] = placed.bounds_hi_mm[i];
    }
    const Vec3 room = Vec3{1, 1, 1} * (kRoom * length(hi - lo));
    std::vector<SectionHandle> handles;
    for (size_t i = 0; i < std::min(section.planes.size(), kMostSectionPlanes); ++i) {
        SectionHandle handle;
        handle.plane = i;
        handle.normal = normalised(section.planes[i].normal, {0, 0, 1});
        const double offset = dot(handle.normal, section.planes[i].point_mm);
        handle.rim = rim_of(handle.normal, offset, lo - room, hi + room);
        if (handle.rim.empty())
            continue;
        handle.middle = middle_of(handle.rim);
        handle.offsets = {0, 0};
        for (size_t k = 0; k < 3; ++k) {
            handle.offsets[0] += std::min(handle.normal[k] * lo[k], handle.normal[k] * hi[k]);
            handle.offsets[1] += std::max(handle.normal[k] * lo[k], handle.normal[k] * hi[k]);
        }
        const std::optional<std::array<double, 2>> middle_px = seen_at(camera, handle.middle, size);
        if (!middle_px)
            continue;
        handle.middle_px = *middle_px;
        // short enough that a ball which points at the eye is in front of it
        const double arm = std::min(arrow_px * pixel_mm_at(camera, handle.middle, size),
                                    camera.orthographic_mm > 0 ? std::numeric_limits<double>::infinity()
                                                               : 0.5 * length(handle.middle - camera.eye));
        handle.tip = handle.middle + handle.normal * arm;
        handle.tip_px = seen_at(camera, handle.tip, size).value_or(handle.middle_px);
        for (const Vec3& corner : handle.rim)
            if (const auto seen = seen_at(camera, corner, size))
                handle.rim_px.push_back(*seen);
        if (handle.rim_px.size() != handle.rim.size())
            handle.rim_px.clear();
        handles.push_back(std::move(handle));
    }
    return handles;
}

std::optional<GrippedSection> grip_at(std::span<const SectionHandle> handles, double x, double y, double reach_px)
{
    const std::array<double, 2> pixel{x, y};
    std::optional<GrippedSection> gripped;
    double least = 1.5 * reach_px, t = 0;
    const auto nearer = [&](double distance, const SectionHandle& handle, SectionGrip grip, const Vec3& at) {
        if (distance <= least) {
            least = distance;
            gripped = {handle, grip, at};
        }
    };
    for (const SectionHandle& h : handles)
        nearer(std::hypot(x - h.tip_px[0], y - h.tip_px[1]), h, SectionGrip::Turn, h.tip);
    if (gripped)
        return gripped;
    least = reach_px;
    for (const SectionHandle& h : handles)
        nearer(distance_px(pixel, h.middle_px, h.tip_px, t), h, SectionGrip::Move, h.middle);
    if (gripped)
        return gripped;
    least = 0.6 * reach_px;
    for (const SectionHandle& h : handles)
        for (size_t i = 0; i < h.rim_px.size(); ++i) {
            const size_t next = (i + 1) % h.rim_px.size();
            const double distance = distance_px(pixel, h.rim_px[i], h.rim_px[next], t);
            nearer(distance, h, SectionGrip::Move, h.rim[i] + (h.rim[next] - h.rim[i]) * t);
        }
    return gripped;
}

SectionPlane dragged(const GrippedSection& gripped, const Camera& camera, PictureSize size,
                     const std::array<double, 2>& from, const std::array<double, 2>& to)
{
    const SectionHandle& handle = gripped.handle;
    if (gripped.grip == SectionGrip::Turn) {
        // the ball is not gripped in its very middle
        const std::array<double, 2> ball{to[0] - from[0] + handle.tip_px[0], to[1] - from[1] + handle.tip_px[1]};
        return {handle.middle, snapped(turned_to(handle, ray_through(camera, size, ball)))};
    }
    const double now = dot(handle.normal, handle.middle);
    const double moved = std::clamp(now + moved_by(gripped, camera, size, from, to), std::min(handle.offsets[0], now),
                                    std::max(handle.offsets[1], now));
    return {handle.middle + handle.normal * (moved - now), handle.normal};
}

} // namespace trimray
