// What a picture's section planes come to for both tracers: shaders/section_layout.h, from the scene's look.
#pragma once

#include "runtime/light_view.h"
#include "runtime/placement_view.h"
#include "runtime/tracer.h"
#include "shaders/section_layout.h"

#include <cstdint>
#include <vector>

namespace trimray {

/// Fails: Usage (too many planes, numbers that mean nothing).
Status check_section(const SectionLook& look);

/// Domain: check_section is ok and there are planes.
SectionView section_view(const PlacementView& placed, const SectionLook& look, const ViewRays& rays);

/// Points that are inside of solids are covered by caps; a part whose faces do not close a solid has an inside only
/// where its faces happen to enclose something.
bool has_caps(const SectionLook& look);

} // namespace trimray
