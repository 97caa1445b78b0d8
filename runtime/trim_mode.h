// The trim modes by name, and whether a pack holds what a mode reads: both tracers ask here before they trace.
#pragma once

#include "format/pack_image.h"
#include "format/result.h"
#include "runtime/tracer.h"

namespace trimray {

const char* trim_name(TrimMode mode);

/// The mode that traces: `wanted`, or for auto exact, of the right modes the one that needs no texture.
/// Fails: UnsupportedPackFeature, if a trimmed face has no cells (exact, hybrid) or no texture (sdf, hybrid) to ask.
Result<TrimMode> choose_trim(const PackImage& image, TrimMode wanted);

} // namespace trimray
