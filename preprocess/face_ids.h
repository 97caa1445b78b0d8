// Which number each face of a model has in its pack.
#pragma once

#include "format/pack_layout.h"

#include <vector>

namespace trimray {

/// A face that was not converted has no id in the pack.
inline constexpr uint kNotConverted = 0xffffffffu;

/// [part][face in CadPart::faces] is the face's id in the pack, or kNotConverted.
using FaceIds = std::vector<std::vector<uint>>;

} // namespace trimray
