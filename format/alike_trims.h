// Faces whose trims are the same numbers: a connector has its pin's faces a thousand times. What follows from trims
// alone is derived for the first of them and copied to the others.
#pragma once

#include "format/pack_image.h"

#include <vector>

namespace trimray {

/// For each face, the first face with the same points, pieces, flags, extent and texture size, bit for bit; itself if
/// it is the first or has no trims.
std::vector<uint> first_alike(const PackImage& image);

} // namespace trimray
