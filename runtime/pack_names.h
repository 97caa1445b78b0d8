// Names of a pack's parts, placements and faces.
#pragma once

#include "format/pack_image.h"

#include <string>

namespace trimray {

/// The text at `index` of the pack's strings; empty where there is none.
inline const std::string& string_at(const PackImage& image, uint index)
{
    static const std::string none;
    return index < image.strings.strings.size() ? image.strings.strings[index] : none;
}

} // namespace trimray
