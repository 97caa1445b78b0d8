#include "runtime/frame_size.h"

#include <fmt/format.h>

namespace trimray {

Status check_size(const RenderOptions& options)
{
    constexpr uint32_t kLargestSide = 65536; // pixels; and a picture of 2^30 in all
    if (options.width == 0 || options.height == 0 || options.width > kLargestSide || options.height > kLargestSide ||
        uint64_t(options.width) * options.height > 1u << 30)
        return Error{ErrorCode::Usage, "size",
                     fmt::format("{}x{} is not between 1x1 and {}x{} with at most 2^30 pixels", options.width,
                                 options.height, kLargestSide, kLargestSide)};
    return Done{};
}

void resize(Frame& frame, uint32_t width, uint32_t height)
{
    const size_t pixels = size_t(width) * height;
    frame.width = width;
    frame.height = height;
    frame.rgba.resize(4 * pixels);
    frame.depth_mm.resize(pixels);
    frame.normal.resize(3 * pixels);
    frame.uv.resize(2 * pixels);
    frame.face.resize(pixels);
    frame.instance.resize(pixels);
    frame.certified.resize(pixels);
}

} // namespace trimray
