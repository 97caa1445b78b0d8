#include "runtime/view/surface_facts.h"

#include "runtime/effect_plan.h"

#include <cmath>
#include <numbers>
#include <set>

namespace trimray {
namespace {

using reference::length;
using reference::Vec3;
using reference::operator*;

/// The number of a face in the file's part: dropped faces have numbers too.
uint number_in_file(const PackImage& image, uint face)
{
    const uint part = image.faces[face].part;
    std::set<uint> dropped;
    for (const DroppedFace& d : image.dropped)
        if (d.part == part)
            dropped.insert(d.face_in_part);
    uint number = face - image.parts[part].first_face;
    for (const uint before : dropped) // ascending
        number += before <= number;
    return number;
}

/// The facts that a native record tells in closed form.
void add_native_facts(const PlacedSurface& surface, SurfaceFacts& facts)
{
    const PatchRecord& patch = surface.patch_at(facts.uv_face);
    const uint kind = patch.shape & 0xffu;
    const std::optional<double> unit_mm = surface.patch_unit_mm(patch);
    if (!unit_mm || kind == kKindPlane || kind == kKindBezier)
        return;
    const double first = patch.param[0], second = patch.param[1];
    const double v = (facts.uv_face[1] - patch.uv_offset[1]) / patch.uv_scale[1];
    double radius = first, along = 0; // patch units
    if (kind == kKindCylinder)
        along = v;
    if (kind == kKindCone) { // rho = r + v sin a, z = v cos a
        const double cos_a = 1 / std::hypot(1, second);
        along = v * cos_a;
        radius = std::abs(first + along * second);
        facts.half_angle_deg = std::abs(std::atan(second)) * 180 / std::numbers::pi;
    }
    facts.radius_mm = radius * *unit_mm;
    if (kind == kKindTorus)
        facts.tube_radius_mm = second * *unit_mm;
    if (kind == kKindTorus || kind == kKindSphere)
        facts.centre_mm = surface.point_of_patch(patch, {});
    if (kind != kKindSphere) {
        const Vec3 direction = surface.direction_of_patch(patch, {0, 0, 1});
        facts.axis = AxisLine{surface.point_of_patch(patch, {0, 0, along}), direction * (1 / length(direction))};
    }
}

} // namespace

SurfaceFacts surface_facts(const PackImage& image, const PickedPlace& place)
{
    const PlacedSurface surface(image, place.instance, place.face);
    const FaceRecord& face = surface.face();
    SurfaceFacts facts;
    facts.face = place.face;
    facts.instance = place.instance;
    facts.part_name = image.strings.strings[image.parts[face.part].name];
    facts.placement_name = image.strings.strings[image.instances[place.instance].name];
    facts.face_name = image.strings.strings[face.name];
    facts.face_in_part = number_in_file(image, place.face);
    facts.kind = face.surface_kind;
    facts.kind_name = surface_kind_name(face.surface_kind);

    facts.uv_face = surface.uv_face(place.uv_file);
    if (place.ray) {
        const RayFoot foot = surface.meet(*place.ray, facts.uv_face);
        facts.uv_face = foot.uv_face;
        facts.off_ray_mm = foot.off_ray_mm;
    }
    facts.uv_file = surface.uv_file(facts.uv_face);
    facts.point_mm = surface.at(facts.uv_face).p;
    facts.normal = surface.outward(facts.uv_face);
    add_native_facts(surface, facts);
    if (face.surface_kind != kKindPlane)
        facts.curvatures = surface.curvatures(facts.uv_face);
    return facts;
}

} // namespace trimray
