// A scene with other leaves, to measure what they are worth.
#pragma once

#include "runtime/tracer.h"

#include <memory>

namespace trimray {

/// A copy of the scene whose Bezier patches have at most `most_leaves` leaves each; 1 is the paper's setting.
/// Domain: 1 to kMaxLeavesPerPatch.
std::shared_ptr<const Scene> with_leaf_budget(const Scene& scene, uint32_t most_leaves);

} // namespace trimray
