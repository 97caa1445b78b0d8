// What is placed where in a picture: the pack's own placements, or what a scene makes of them (arrangement.h). Both
// tracers read placements, the tree over them and its units from here alone.
#pragma once

#include "format/pack_image.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace trimray {

/// A view: what it is of must outlive it. Placements keep their numbers in the pack, whatever is hidden.
struct PlacementView {
    std::span<const PartRecord> parts;
    std::span<const InstanceRecord> instances;
    std::span<const uint8_t> visible;   // by instance, 0: hidden; empty: all are visible
    std::span<const BvhNode> top_nodes; // over those that are visible
    std::optional<uint32_t> alone;      // the only instance that rays can meet: there is no need of the tree
    std::array<double, 3> bounds_lo_mm{}, bounds_hi_mm{}; // of what is visible
    std::array<double, 3> world_origin_mm{};              // of the top tree's unit space
    double world_scale_mm = 1;

    PlacementView() = default;
    /// The pack's own. Not explicit: a pack is itself what is placed, where a scene says nothing.
    PlacementView(const PackImage& image)
        : parts(image.parts), instances(image.instances), top_nodes(image.top_nodes),
          bounds_lo_mm(std::to_array(image.bounds_lo_mm)), bounds_hi_mm(std::to_array(image.bounds_hi_mm)),
          world_origin_mm(std::to_array(image.world_origin_mm)), world_scale_mm(image.world_scale_mm)
    {
        if (instances.size() == 1)
            alone = 0;
    }

    bool shows(size_t instance) const { return visible.empty() || visible[instance] != 0; }
    size_t visible_count() const
    {
        return instances.size() - size_t(std::count(visible.begin(), visible.end(), uint8_t{0}));
    }
};

} // namespace trimray
