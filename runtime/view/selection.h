// What is selected, and which placements are to be seen, as sets of placements: what a click, a row of the tree or a
// key changes.
#pragma once

#include "runtime/scene_look.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace trimray {

/// What lies under a pixel, as the picture's arrays have it.
struct PickedPoint {
    int32_t face = -1, instance = -1; // face -1: a cap of a section
    std::array<double, 3> point_mm{};
    std::array<double, 2> uv{};
    std::array<double, 3> eye_mm{}, along{}; // whence and along what it is seen
};

struct Selection {
    std::vector<uint32_t> placements; // ascending; empty: nothing is selected
    std::optional<uint32_t> face;     // of the pack, where one face of the only placement is meant
    std::optional<PickedPoint> place; // where it was clicked in the picture

    bool has(uint32_t placement) const;
    bool empty() const { return placements.empty(); }
};

/// Those of `a` and `b` that are in one of them alone: what a click with Ctrl makes of a selection. All lists ascend.
std::vector<uint32_t> toggled(const std::vector<uint32_t>& a, std::span<const uint32_t> b);

/// Shows or hides placements: `arranged` shows afterwards what it showed before (`visible`, by placement; empty: all)
/// but for these, by numbers alone and as few as can be. What moves placements apart stays. `all`: how many there are.
void set_shown(Arrangement& arranged, std::span<const uint8_t> visible, size_t all,
               std::span<const uint32_t> placements, bool shown);

/// Shows these alone. Domain: not empty.
void show_alone(Arrangement& arranged, size_t all, std::span<const uint32_t> placements);

} // namespace trimray
