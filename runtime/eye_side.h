// On which side of closed shells the eye is: from outside, rims show no backs (shaders/shared/rim.h).
#pragma once

#include "runtime/cpu_view.h"

#include <array>
#include <cstdint>
#include <vector>

namespace trimray {

/// By instance: 1 where the eye is outside of the part's closed shells and the part has rims, else 0; 0 where it is
/// hidden. Outside of the
/// box around the part it is; in it most of a few rays decide: the first hit of one from within a shell is a back.
std::vector<uint8_t> seen_from_outside(const CpuScene& scene, const PlacementView& placed,
                                       const std::array<double, 3>& eye_mm);

} // namespace trimray
