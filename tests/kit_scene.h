// Two parts with names, placed some times each: for what is hidden or moved, and packs made without it to compare with.
#pragma once

#include "format/derive.h"
#include "format/leaf_geometry.h"
#include "runtime/tracer.h"
#include "tests/traced_scenes.h"

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

namespace trimray {

/// Trees made anew over what the image has.
inline std::shared_ptr<const Scene> kit_scene(PackImage image)
{
    derive_trees(image);
    auto scene = std::make_shared<Scene>();
    scene->pack.image = std::move(image);
    return scene;
}

/// Part #0 "plates" has four faces (trimmed ones among them), part #1 "rings" three. Placed: @0 plates "base", @1 rings
/// "left", mirrored, @2 plates "lid", turned and stretched, @3 rings "right".
inline PackImage kit_image()
{
    TracedScene built = all_kinds();
    PackImage& image = built.image;
    image.parts.push_back(image.parts[0]);
    constexpr uint kPlates = 4; // faces, and patches
    for (uint f = kPlates; f < image.faces.size(); ++f)
        image.faces[f].part = 1;
    image.parts[1].first_face = image.parts[1].first_patch = kPlates;
    image.parts[1].face_count = image.parts[1].patch_count = uint(image.faces.size()) - kPlates;
    image.parts[0].face_count = image.parts[0].patch_count = kPlates;
    image.parts[0].name = image.strings.add("plates");
    image.parts[1].name = image.strings.add("rings");
    built.place({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    built.place({-1, 0, 0, -14, 0, 1, 0, 5, 0, 0, 1, 10});
    built.place({0, -0.5, 0, 3, 0.5, 0, 0, 6, 0, 0, 0.75, 12});
    built.place({1, 0, 0, 15, 0, 1, 0, -3, 0, 0, 1, 4});
    const std::array<const char*, 4> names{"base", "left", "lid", "right"};
    for (size_t i = 0; i < names.size(); ++i) {
        image.instances[i].name = image.strings.add(names[i]);
        image.instances[i].part = uint(i % 2);
    }
    image.instances[3].color_rgba = 0xff2060e0u;
    derive_leaves(image, {});
    derive_cells(image);
    return image;
}

/// The pack of these placements alone.
inline std::shared_ptr<const Scene> kit_of(const std::vector<uint32_t>& placements)
{
    PackImage image = kit_image();
    std::vector<InstanceRecord> left;
    for (const uint32_t i : placements)
        left.push_back(image.instances[i]);
    image.instances = left;
    return kit_scene(std::move(image));
}

/// The middle of a placement's box along the world's axes, mm. Of one whose own axes lie along them it is the middle of
/// its part's box too.
inline Point3 middle_of(const PackImage& image, const InstanceRecord& instance)
{
    Point3 middle{};
    for (size_t c = 0; c < 3; ++c) {
        Point3 along{};
        along[c] = 1;
        const double hi = largest_along(image, instance, along);
        along[c] = -1;
        middle[c] = (hi - largest_along(image, instance, along)) / 2;
    }
    return middle;
}

/// The pack of these placements, each moved away from the middle of all four.
inline std::shared_ptr<const Scene> kit_apart(const std::vector<uint32_t>& placements, double by)
{
    const std::shared_ptr<const Scene> all = kit_of({0, 1, 2, 3});
    const PackImage& whole = all->pack.image;
    PackImage image = kit_image();
    std::vector<InstanceRecord> left;
    for (const uint32_t i : placements) {
        InstanceRecord moved = whole.instances[i];
        const Point3 middle = middle_of(whole, moved);
        for (size_t c = 0; c < 3; ++c)
            moved.transform[4 * c + 3] += by * (middle[c] - (whole.bounds_lo_mm[c] + whole.bounds_hi_mm[c]) / 2);
        left.push_back(moved);
    }
    image.instances = left;
    return kit_scene(std::move(image));
}

/// The kit seen from before and above, with `look`.
inline RenderOptions kit_picture(uint32_t width, uint32_t height)
{
    RenderOptions options;
    options.width = width;
    options.height = height;
    options.camera = {{24, -60, 44}, {1, 2, 6}, {0, 0, 1}, 40};
    return options;
}

/// Everything that casts rays from elsewhere than the eye: shadows, occlusion, mirrors, what is behind, sections.
inline void add_effects(RenderOptions& options)
{
    Light sun, lamp;
    sun.direction = {1, 2, -3};
    sun.shadows = true;
    lamp.kind = LightKind::Point;
    lamp.position_mm = {-20, -30, 40};
    lamp.shadows = true;
    lamp.radius_mm = 1;
    options.look.lights = {sun, lamp};
    options.look.light_samples = 2;
    options.look.occlusion.samples = 2;
    options.look.occlusion.reach_mm = 8;
    MaterialRule mirror, glass;
    mirror.part = "plates";
    mirror.material.mirror = 0.5f;
    glass.part = "right";
    glass.material.opacity = 0.5f;
    options.look.materials = {mirror, glass};
    options.look.section.planes = {{{0, 0, 14}, {0.1, 0, 1}}};
}

/// `frame` with the numbers of a pack of these placements alone turned into those of the kit's.
inline Frame renumbered(Frame frame, const std::vector<uint32_t>& placements)
{
    for (int32_t& instance : frame.instance)
        if (instance >= 0)
            instance = int32_t(placements[size_t(instance)]);
    return frame;
}

inline int count_hits(const Frame& frame)
{
    return int(frame.instance.size() - size_t(std::count(frame.instance.begin(), frame.instance.end(), -1)));
}

} // namespace trimray
