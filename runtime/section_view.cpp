#include "runtime/section_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trimray {
namespace {

using Vec3 = std::array<double, 3>;

double dot(const Vec3& a, const Vec3& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Vec3 cross(const Vec3& a, const Vec3& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vec3 unit(const Vec3& v)
{
    const double largest = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
    const Vec3 w{v[0] / largest, v[1] / largest, v[2] / largest};
    const double length = std::sqrt(dot(w, w));
    return {w[0] / length, w[1] / length, w[2] / length};
}
void store(const Vec3& v, float (&out)[3])
{
    for (size_t i = 0; i < 3; ++i)
        out[i] = float(v[i]);
}

constexpr double kMoreCut = 5e-6; // the top tree's units; about 40 roundings of the scene's size in single precision

SectionPlaneView plane_view(const PlacementView& placed, const SectionPlane& plane, const ViewRays& rays)
{
    const Vec3 normal = unit(plane.normal);
    Vec3 from_point, from_origin;
    for (size_t i = 0; i < 3; ++i) {
        from_point[i] = rays.eye_mm[i] + rays.tau_ref * rays.w0[i] - plane.point_mm[i];
        from_origin[i] = plane.point_mm[i] - placed.world_origin_mm[i];
    }
    // a little more is cut away than was asked: faces that lie in the plane are gone, whatever rounding does
    const double more = kMoreCut * placed.world_scale_mm;
    SectionPlaneView view{};
    view.at = float(dot(normal, from_point) + more);
    view.at_x = float(rays.tau_ref * dot(normal, rays.step_x));
    view.at_y = float(rays.tau_ref * dot(normal, rays.step_y));
    view.rise = float(dot(normal, rays.w0));
    view.rise_x = float(dot(normal, rays.step_x));
    view.rise_y = float(dot(normal, rays.step_y));
    store(normal, view.normal);
    view.offset = float(dot(normal, from_origin) / placed.world_scale_mm - kMoreCut);
    // across: horizontal, where the plane is not
    const Vec3 up = std::abs(normal[2]) < 0.9 ? Vec3{0, 0, 1} : Vec3{0, 1, 0};
    const Vec3 across = unit(cross(up, normal));
    store(across, view.across);
    store(cross(normal, across), view.along);
    return view;
}

} // namespace

Status check_section(const SectionLook& look)
{
    if (look.planes.size() > kMostSectionPlanes)
        return Error{ErrorCode::Usage, "section",
                     fmt::format("{} planes; at most {}", look.planes.size(), kMostSectionPlanes)};
    for (const SectionPlane& plane : look.planes) {
        const Vec3& n = plane.normal;
        const bool finite =
            std::all_of(n.begin(), n.end(), [](double x) { return std::isfinite(x); }) &&
            std::all_of(plane.point_mm.begin(), plane.point_mm.end(), [](double x) { return std::isfinite(x); });
        if (!finite || (n[0] == 0 && n[1] == 0 && n[2] == 0))
            return Error{ErrorCode::Usage, "section",
                         "a plane needs a finite point and a finite normal that is not 0, 0, 0"};
    }
    return Done{};
}

bool has_caps(const SectionLook& look)
{
    return !look.planes.empty() && look.caps != CapStyle::None;
}

SectionView section_view(const PlacementView& placed, const SectionLook& look, const ViewRays& rays)
{
    SectionView view{};
    view.count = uint(look.planes.size());
    view.caps = look.caps == CapStyle::None ? kCapsNone : look.caps == CapStyle::Filled ? kCapsFilled : kCapsHatched;
    if (look.cap_color) {
        view.has_color = 1;
        std::copy(look.cap_color->begin(), look.cap_color->end(), view.color);
    }
    constexpr float kHatches = 60; // across the model
    view.hatch = 2 / kHatches;
    for (size_t i = 0; i < look.planes.size(); ++i)
        view.planes[i] = plane_view(placed, look.planes[i], rays);
    return view;
}

} // namespace trimray
