// PNG in and out by libpng alone: a preview then costs milliseconds, not the loading of OpenImageIO.
#include "runtime/image_io.h"

#include <fmt/format.h>
#include <png.h>

#include <cassert>
#include <cstring>

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

} // namespace

Result<std::vector<std::byte>> encode_png(const Picture& picture)
{
    assert(picture.rgba.size() == size_t{4} * picture.width * picture.height);
    PngControl png;
    png.image.width = picture.width;
    png.image.height = picture.height;
    png.image.format = PNG_FORMAT_RGBA; // 8 bits are sRGB with straight alpha
    std::vector<std::byte> bytes(PNG_IMAGE_PNG_SIZE_MAX(png.image));
    png_alloc_size_t size = bytes.size();
    if (png_image_write_to_memory(&png.image, bytes.data(), &size, 0, picture.rgba.data(), 0, nullptr) == 0)
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
