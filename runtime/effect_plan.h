// What a pack and a request call for, and why: the tracers are specialised to this plan, and what is not in it costs
// nothing. A pure function of its arguments; `trimray info` prints it.
#pragma once

#include "format/pack_image.h"
#include "runtime/tracer.h"

#include <array>
#include <string>
#include <vector>

namespace trimray {

/// One thing the tracer must be able to do for this scene.
struct EffectItem {
    std::string name; // stable, lower case with hyphens: scripts compare it
    std::string why;  // with the counts it follows from
};

/// Faces by the kind of their surface in the file, indexed by kKind….
std::array<uint32_t, kSurfaceKindCount> faces_by_kind(const PackImage& image);

/// The name of a surface kind: plane, cylinder, cone, sphere, torus, bezier.
const char* surface_kind_name(uint kind);

/// The plan, in a fixed order: kinds of patches, trims, placements, colours, search, maps, shading, what is drawn over
/// it.
std::vector<EffectItem> effect_plan(const PackImage& image, const RenderOptions& options);

} // namespace trimray
