#include "runtime/color_text.h"

#include "runtime/image_io.h"

#include <charconv>

namespace trimray {

std::optional<uint32_t> srgb_of_text(std::string_view text)
{
    const std::string_view hex = text == "white" ? "#ffffff" : text == "black" ? "#000000" : text;
    if (hex.size() != 7 || hex[0] != '#')
        return std::nullopt;
    uint32_t rgb = 0;
    const auto parsed = std::from_chars(hex.data() + 1, hex.data() + hex.size(), rgb, 16);
    if (parsed.ec != std::errc() || parsed.ptr != hex.data() + hex.size())
        return std::nullopt;
    return rgb;
}

std::array<float, 3> linear_of_srgb_bytes(uint32_t rgb)
{
    const auto channel = [](uint32_t byte) { return srgb_to_linear(static_cast<float>(byte & 0xff) / 255.0f); };
    return {channel(rgb >> 16), channel(rgb >> 8), channel(rgb)};
}

} // namespace trimray
