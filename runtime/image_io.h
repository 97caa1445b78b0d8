// Pictures in and out, through OpenImageIO in a module of its own (trimray_image), loaded when first used.
#pragma once

#include "format/result.h"
#include "runtime/tracer.h"

#include <cstddef>
#include <string>
#include <vector>

namespace trimray {

/// Writes a frame by the name's ending: .png (sRGB, 8 bits, alpha) or .exr (all AOVs, float channels as DESIGN says:
/// R G B A Z N.X N.Y N.Z U V face certified). Written atomically. Fails: ImageNotWritten, UnsupportedFormat.
Status write_image(const std::string& path, const Frame& frame);

} // namespace trimray
