// What a hand moves a plane of a section by, in the picture: the plane's rim where it leaves the model's box, an arrow
// to the side that is cut away, and the arrow's ball, which turns the plane. Lengths in mm of the world, or in pixels
// of the picture where a name says so.
#pragma once

#include "runtime/camera.h"
#include "runtime/picture_size.h"
#include "runtime/placement_view.h"
#include "runtime/scene_look.h"

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace trimray {

constexpr size_t kMostSectionPlanes = 6; // as SectionLook says

/// What is nearer along an axis than the middle of what is placed is cut away, as seen from the front, the right,
/// above. Domain: axis < 3.
SectionPlane section_through_middle(const PlacementView& placed, size_t axis);

struct SectionHandle {
    size_t plane = 0;                                // of the section's
    std::array<double, 3> middle{}, normal{}, tip{}; // of the rim; of length 1; the arrow's end, where the ball is
    std::vector<std::array<double, 3>> rim;          // the corners of a convex polygon, one after another
    std::array<double, 2> offsets{};                 // normal . p of the planes between which it is moved
    std::array<double, 2> middle_px{}, tip_px{};
    std::vector<std::array<double, 2>> rim_px; // as rim; empty where a corner is not in front of the eye
};

/// The handles of the planes that meet the box of what is placed and whose middle is in front of the eye.
/// `arrow_px`: the arrow's length as it is seen from its side.
std::vector<SectionHandle> section_handles(const SectionLook& section, const PlacementView& placed,
                                           const Camera& camera, PictureSize size, double arrow_px);

enum class SectionGrip { Move, Turn };
struct GrippedSection {
    SectionHandle handle;
    SectionGrip grip = SectionGrip::Move;
    std::array<double, 3> at{}; // what is held: a point of the rim, the handle's middle, its ball
};

/// What of the handles is seen at pixel coordinates (x, y), or no more than `reach_px` from there: balls before arrows
/// before rims.
std::optional<GrippedSection> grip_at(std::span<const SectionHandle> handles, double x, double y, double reach_px);

/// The plane after the pointer has gone from one place of the picture to another, pixels. Moved, it stays with the
/// pointer along its normal, within what is placed; where one looks along the normal, it comes as the pointer goes
/// down. Turned about its handle's middle, its ball stays with the pointer; a normal that comes near an axis is that
/// axis.
SectionPlane dragged(const GrippedSection& gripped, const Camera& camera, PictureSize size,
                     const std::array<double, 2>& from, const std::array<double, 2>& to);

} // namespace trimray
