// Preview pictures of a pack. The converter does not link the tracer: it hands the finished pack to `trimray preview`,
// the program beside it, and takes the pictures back, so a preview shows what `trimray render` shows.
#pragma once

#include "format/pack_image.h"
#include "format/result.h"

#include <string>

namespace trimray {

/// Fills image.preview_256_png and image.preview_512_png by running `trimray_program` on the image.
/// Fails: FileNotFound (no such program), FileNotWritable (temporary folder), Internal (it failed; detail has its
/// status).
Status add_previews(PackImage& image, const std::string& trimray_program);

/// The `trimray` that belongs to this program: beside it; empty when there is none.
std::string find_trimray_program();

} // namespace trimray
