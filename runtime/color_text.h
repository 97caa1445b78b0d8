// Colours as people write them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace trimray {

/// "white", "black" or "#rrggbb" as 0xRRGGBB, sRGB; nothing where `text` is none of them.
std::optional<uint32_t> srgb_of_text(std::string_view text);

/// 0xRRGGBB, sRGB, as linear light.
std::array<float, 3> linear_of_srgb_bytes(uint32_t rgb);

} // namespace trimray
