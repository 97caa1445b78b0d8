// Pictures in and out: PNG by libpng (png_io.cpp), EXR through OpenImageIO in a module of its own (image_module.cpp),
// loaded when first used: neither this library nor a program's start pays for it.
#pragma once

#include "format/result.h"
#include "runtime/tracer.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace trimray {

/// An 8-bit picture as it goes to a screen: 4 bytes a pixel, sRGB, straight alpha, row 0 at the top.
struct Picture {
    uint32_t width = 0, height = 0;
    std::vector<uint8_t> rgba;
};

/// Writes a frame by the name's ending: .png (sRGB, 8 bits, alpha) or .exr (all AOVs, float channels as DESIGN says:
/// R G B A Z N.X N.Y N.Z U V face certified, and map where a map measures; ZIP). Written atomically; the same frame
/// gives the same bytes. Fails: ImageNotWritten, FileNotWritable, UnsupportedFormat.
Status write_image(const std::string& path, const Frame& frame);

/// Whether write_image knows the ending of `path`. Fails: UnsupportedFormat, naming those it knows.
Status check_image_name(const std::string& path);

/// The bytes of the PNG or EXR that write_image writes. Fails: ImageNotWritten.
enum class PngForm {
    Rgba,   // 8 bits a channel, what every program reads alike
    Fewest, // a colour map where 256 colours are enough: a third of the bytes
};
Result<std::vector<std::byte>> encode_png(const Picture& picture, PngForm form = PngForm::Rgba);
Result<std::vector<std::byte>> encode_exr(const Frame& frame);

/// Fails: UnsupportedFormat (not a PNG, or a damaged one).
Result<Picture> decode_png(std::span<const std::byte> bytes);

/// A picture all around: .hdr or .exr, equirectangular, linear light, at most 16,384 x 8,192.
/// Fails: FileNotFound, UnsupportedFormat (another ending), InvalidScene (no such picture, or colours that are negative
/// or not finite), ImageNotWritten (the module is missing).
Result<Environment> read_environment(const std::string& path);

/// The frame's colours for a screen: linear light -> sRGB (IEC 61966-2-1), [0, 1] -> 0..255, nearest.
Picture to_picture(const Frame& frame);

/// The picture at width x height, each pixel the mean of the area it covers, in linear light, weighted by alpha.
/// Domain: 1 <= width, height; enlarging repeats pixels.
Picture box_filter(const Picture& picture, uint32_t width, uint32_t height);

/// The colours of a frame traced at samples x samples the resolution, each pixel the mean of its samples, weighted by
/// alpha. The other AOVs have no mean: the result has colours only. Domain: samples divides width and height.
Frame average_samples(const Frame& frame, uint32_t samples);

/// The frame over an opaque background (linear light).
void composite_over(Frame& frame, const std::array<float, 3>& background_linear);

/// sRGB component in [0, 1] -> linear light.
float srgb_to_linear(float value);

} // namespace trimray
