// A face's surface where it is placed, in double, from the numbers that the pack holds: points, derivatives, normals,
// and where a ray meets it. What measuring asks for; the tracers' own formulas in single precision are not used.
#pragma once

#include "format/bezier_net.h"
#include "format/pack_image.h"
#include "format/reference_math.h"

#include <array>
#include <optional>
#include <span>
#include <vector>

namespace trimray {

using UvPoint = std::array<double, 2>;

/// A point and its derivatives to the second order, world mm.
struct SurfaceJet {
    reference::Vec3 p{}, du{}, dv{}, duu{}, duv{}, dvv{};
};

/// The extremes of normal curvature, 1/mm, by the outward normal: positive where the surface is convex seen from
/// outside. larger >= smaller.
struct PrincipalCurvatures {
    double larger = 0, smaller = 0;
};

/// Where Newton came to from a picked place.
struct RayFoot {
    UvPoint uv_face{};
    double off_ray_mm = 0; // of the surface's point there from the ray's line
};

/// One thread at a time: it remembers what it was asked last.
class PlacedSurface {
public:
    /// Domain: a validated image, which must outlive it; the instance is of the face's part.
    PlacedSurface(const PackImage& image, uint instance, uint face);

    /// By uv_face. Beyond the domain the border's patches go on.
    SurfaceJet at(const UvPoint& uv_face) const;

    /// Unit, world; at poles and along sides without length its limit from the inside; 0 where there is none.
    reference::Vec3 outward(const UvPoint& uv_face) const;

    /// Nothing where the derivatives have no plane, as at a pole.
    std::optional<PrincipalCurvatures> curvatures(const UvPoint& uv_face) const;

    /// The place near `start` where the surface meets the ray's line, by Newton's method, or the nearest to it that was
    /// found where the ray only grazes.
    RayFoot meet(const reference::Ray& ray, const UvPoint& start) const;

    UvPoint uv_file(const UvPoint& uv_face) const;
    UvPoint uv_face(const UvPoint& uv_file) const;

    /// The patch over a place; of several, or none, the nearest.
    const PatchRecord& patch_at(const UvPoint& uv_face) const { return patches_[patch_index(uv_face)]; }
    std::span<const PatchRecord> patches() const { return patches_; }
    const FaceRecord& face() const { return face_; }

    /// A point and a direction of a patch's own axes in the world, mm. The direction is as long as patch units are.
    reference::Vec3 point_of_patch(const PatchRecord& patch, const reference::Vec3& p) const;
    reference::Vec3 direction_of_patch(const PatchRecord& patch, const reference::Vec3& d) const;

    /// mm of a patch unit, where the placement is a turn, a mirroring and one scale.
    std::optional<double> patch_unit_mm(const PatchRecord& patch) const;

    /// mm of a part's mm at most: the longest column of the placement.
    double stretch() const;

private:
    size_t patch_index(const UvPoint& uv_face) const;
    const Net& net(size_t patch) const;
    reference::Vec3 turned(const reference::Vec3& in_part) const; // a direction, part mm to world mm

    const PackImage& image_;
    const InstanceRecord& instance_;
    const FaceRecord& face_;
    const PartRecord& part_;
    std::span<const PatchRecord> patches_;
    mutable size_t last_patch_ = 0;                // where the last place was: the next is likely there too
    mutable std::vector<std::optional<Net>> nets_; // loaded when first asked for
};

} // namespace trimray
