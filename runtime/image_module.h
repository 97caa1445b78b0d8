// What the image module offers to image_io.cpp: a table of functions behind one C symbol. The module knows pixels and
// formats, not scenes; both sides come from the same build, which `build` checks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace trimray {

/// Functions return "" or what went wrong.
struct ImageModule {
    const char* build; // TRIMRAY_VERSION of the module
    std::string (*encode_exr)(uint32_t width, uint32_t height, const std::vector<std::string>& channels,
                              const float* pixels, std::vector<std::byte>& bytes);
    // 3 floats a pixel, row 0 at the top; a picture of one channel is grey. Fails beyond `most_pixels`
    std::string (*read_rgb)(const std::string& path, uint64_t most_pixels, uint32_t& width, uint32_t& height,
                            std::vector<float>& rgb);
};

inline constexpr const char* kImageModuleSymbol = "trimray_image_module";

} // namespace trimray
