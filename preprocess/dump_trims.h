// Pictures of what the trims of each face became, for eyes: loops, mask, distance field and cells side by side.
#pragma once

#include "format/pack_image.h"
#include "format/result.h"

#include <string>

namespace trimray {

/// Writes `directory`/face_NNNNNN.ppm for every trimmed face, and index.txt with a line of numbers for each face.
/// Panels from left to right, v upwards: the loops over the cells' classes (white in, grey out, tinted mixed, more
/// entries darker), the mask, the distance field (warm in, cold out, the band dimmed), each with the loops drawn in
/// the colours of edge classes: sharp black, smooth blue, seam orange, free purple. The folder is made if need be.
/// Fails: FileNotWritable.
Status dump_trims(const PackImage& image, const std::string& directory);

} // namespace trimray
