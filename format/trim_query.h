// The trim query, one point at a time: is (u, v) of a face kept? The rule is pack_layout.h's at CellEntry; the tracers'
// wide versions follow this one.
#pragma once

#include "format/pack_image.h"

namespace trimray {

/// Returns whether (u, v) in uv_face lies inside the trims of image.faces[face]. Faces without cells (natural borders)
/// answer true. Domain: any finite u, v, clamped to [0, kUvBelowOne]. Exact but for points nearer than about 5e-7 to a
/// loop.
bool trim_inside(const PackImage& image, uint face, float u, float v);

} // namespace trimray
