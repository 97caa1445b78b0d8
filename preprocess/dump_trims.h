// Pictures of the trims, to see what can go wrong: a face's loops drawn over its distance texture.
#pragma once

#include "format/pack_image.h"
#include "format/result.h"

#include <string>

namespace trimray {

/// Writes `face_<id>.ppm` into `folder` (made if missing) for every face with loops: inside blue, outside grey, darker
/// with the stored distance; the loops' pieces in red. Fails: FileNotWritable.
Status dump_trims(const PackImage& image, const std::string& folder);

} // namespace trimray
