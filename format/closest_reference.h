// The reference for closest hits: every ray against every surface that its boxes let through, in double, with trims by
// TrimReference. What the tracers are measured against; slow, and shares no code with them or with what they read
// beyond the surfaces, trims and placements themselves (no leaves, trees, cells or textures).
//
// What counts as a hit: a point of a face's surface at t > 0 whose uv_face lies in [-kDomainSlack, 1 + kDomainSlack]^2,
// as SPEC.md states, and inside the face's loops once it is moved to the nearest point of [0, kUvBelowOne]^2. A Bezier
// patch goes on as its polynomials do beyond each of its sides by kDomainSlack in uv_face (at most kMostPatchSlack of
// the patch), so that neighbouring patches, whose control points are rounded each in its own frame, leave no crack. The
// backs of rims are no surface for rays that begin outside of the part's closed shells (SPEC.md, Rims); on which side a
// ray begins is what most of seven rays from there say, a back met first meaning inside. Of two hits whose distances
// differ by at most 1e-12 of themselves, that of the lower instance and then of the lower face is the closest.
#pragma once

#include "format/bezier_reference.h"
#include "format/box_tree.h"
#include "format/pack_image.h"
#include "format/trim_reference.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace trimray {

struct ReferenceHit {
    bool hit = false;
    double distance_mm = std::numeric_limits<double>::infinity();
    uint face = 0, instance = 0, patch = 0, kind = 0; // kind: kKind... of the patch
    std::array<double, 2> uv_patch{}, uv_face{}, uv_file{};
    std::array<double, 3> normal{};  // unit, world, outward as the face's orientation says; 0 where there is none
    bool contact = false;            // the ray touches the surface there within rounding
    bool open = false;               // a search was given up: a nearer hit may exist
    uint64_t patches = 0, boxes = 0; // work: patches met by their boxes, parts of Bezier patches looked at
};

/// How an answer changes when its ray moves by a hair.
enum class Doubt {
    None,
    Face,    // another face or instance, at a depth that goes on
    Tangent, // a hit where there was none or none where there was one, or a jump in depth
};

/// What is around an answer.
struct Hair {
    Doubt doubt = Doubt::None;
    double depth_mm = 0, turn_deg = 0; // the most that distance and normal change; infinite where doubt is Tangent
};

class ClosestReference {
public:
    using Vec3 = reference::Vec3;

    /// Domain: a validated image, which must outlive it.
    explicit ClosestReference(const PackImage& image);

    /// Has parts placed by `instances` from now on, in place of the image's own, which they differ from in their
    /// transforms alone; where `visible` is 0 there is nothing. Shapes: as many as in the image; no `visible`: all are.
    void place(std::span<const InstanceRecord> instances, std::span<const uint8_t> visible = {});

    /// The closest hit of a ray in world mm. Domain: finite, direction not 0 (it need not be unit).
    ReferenceHit closest(const reference::Ray& ray) const;

    /// The closest hit of one placed face, as if there were no others: whether it lies where another face was hit.
    ReferenceHit closest_of(const reference::Ray& ray, uint instance, uint face) const;

    /// What a hair changes of `answer`, which is closest(ray)'s: the ray's direction is moved by `reach_px` in eight
    /// directions of the picture, given the changes of direction from pixel to pixel. A jump in depth is one of more
    /// than a pixel's size at that distance. Costs eight rays.
    Hair hair(const reference::Ray& ray, const ReferenceHit& answer, const Vec3& step_x, const Vec3& step_y,
              double reach_px = 1e-3) const;

private:
    struct Placement {
        std::array<long double, 9> to_part{};  // part units a mm
        std::array<long double, 3> moved_mm{}; // where part units' origin lies
        double normal[3][3];                   // M^-T, any scale
    };
    struct Walk;

    void intersect_instance(uint instance, Walk& walk) const;
    void intersect_patch(uint patch, Walk& walk) const;
    void accept(uint patch, const reference::Root& root, double t, Walk& walk) const;
    bool is_cut_rim(uint patch, const reference::Root& root, const std::array<double, 2>& uv, const Walk& walk) const;
    bool begins_outside(const Walk& walk) const;
    Vec3 outward_in_part(uint patch, const std::array<double, 2>& uv_patch) const;
    ReferenceHit end(Walk walk) const;
    void finish(ReferenceHit& hit) const;

    const PackImage& image_;
    TrimReference trims_;
    std::vector<std::optional<reference::BezierReference>> beziers_; // of each patch that is one
    std::vector<std::array<long double, 9>> to_patch_;               // of each patch: its axes, inverted
    std::vector<reference::BoxTree> parts_;                          // over each part's patches, part units
    std::vector<Placement> placements_;
    reference::BoxTree placed_; // instances, world mm
};

} // namespace trimray
