// PNG in and out by libpng alone: a preview then costs milliseconds, not the loading of OpenImageIO.
#include "runtime/image_io.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <cassert>
#include <cstring>
#include <set>

namespace trimray {
namespace {

constexpr uint32_t kMaxSide = 1u << 14; // of a picture read: what a damaged header may make us allocate

/// libpng's simplified interface, released however a function ends.
struct PngControl {
    png_image image;

    PngControl()
    {
        std::memset(&image, 0, sizeof image);
        image.version = PNG_IMAGE_VERSION;
    }
    ~PngControl() { png_image_free(&image); }
    PngControl(const PngControl&) = delete;
    PngControl& operator=(const PngControl&) = delete;
};

/// A picture as numbers of its colours, in ascending order; no pixels where there are more than 256.
struct ColourMap {
    std::vector<uint32_t> colours; // R in the low byte
    std::vector<uint8_t> pixels;
};

ColourMap map_colours(const Picture& picture)
{
    std::vector<uint32_t> words(picture.rgba.size() / 4);
    std::memcpy(words.data(), picture.rgba.data(), picture.rgba.size());
    std::set<uint32_t> distinct;
    for (const uint32_t word : words)
        if (distinct.insert(word).second && distinct.size() > 256)
            return {};
    ColourMap map{{distinct.begin(), distinct.end()}, {}};
    for (const uint32_t word : words)
        map.pixels.push_back(
            static_cast<uint8_t>(std::lower_bound(map.colours.begin(), map.colours.end(), word) - map.colours.begin()));
    return map;
}

} // namespace

Result<std::vector<std::byte>> encode_png(const Picture& picture, PngForm form)
{
    assert(picture.rgba.size() == size_t{4} * picture.width * picture.height);
    PngControl png;
    png.image.width = picture.width;
    png.image.height = picture.height;
    png.image.format = PNG_FORMAT_RGBA; // 8 bits are sRGB with straight alpha
    std::vector<std::byte> bytes(PNG_IMAGE_PNG_SIZE_MAX(png.image));
    png_alloc_size_t size = bytes.size();
    const void* pixels = picture.rgba.data();
    const ColourMap map = form == PngForm::Fewest ? map_colours(picture) : ColourMap{};
    if (!map.pixels.empty()) {
        png.image.format = PNG_FORMAT_RGBA_COLORMAP;
        png.image.colormap_entries = static_cast<png_uint_32>(map.colours.size());
        pixels = map.pixels.data();
    }
    if (png_image_write_to_memory(&png.image, bytes.data(), &size, 0, pixels, 0, map.colours.data()) == 0)
        return Error{ErrorCode::ImageNotWritten, "PNG", png.image.message};
    bytes.resize(size);
    return bytes;
}

Result<Picture> decode_png(std::span<const std::byte> bytes)
{
    PngControl png;
    if (png_image_begin_read_from_memory(&png.image, bytes.data(), bytes.size()) == 0)
        return Error{ErrorCode::UnsupportedFormat, "PNG", png.image.message};
    if (png.image.width > kMaxSide || png.image.height > kMaxSide)
        return Error{
            ErrorCode::UnsupportedFormat, "PNG",
            fmt::format("{} x {} pixels; the limit is {} a side", png.image.width, png.image.height, kMaxSide)};
    png.image.format = PNG_FORMAT_RGBA;
    Picture picture{png.image.width, png.image.height, {}};
    picture.rgba.resize(PNG_IMAGE_SIZE(png.image));
    if (png_image_finish_read(&png.image, nullptr, picture.rgba.data(), 0, nullptr) == 0)
        return Error{ErrorCode::UnsupportedFormat, "PNG", png.image.message};
    return picture;
}

} // namespace trimray
