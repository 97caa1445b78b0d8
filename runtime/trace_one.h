// One ray through the lanes of the CPU tracer.
#pragma once

#include "runtime/cpu_view.h"

#include <array>
#include <cstdint>
#include <optional>

namespace trimray {

/// The nearest hit as trace_ray's; of one instance alone where it is given, as if there were no other.
RayHit trace_one(const CpuScene& scene, const PlacementView& placed, const std::array<double, 3>& origin_mm,
                 const std::array<double, 3>& direction, std::optional<uint32_t> instance = {});

} // namespace trimray
