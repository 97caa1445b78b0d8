#include "runtime/image_io.h"

#include "format/pack_writer.h"
#include "runtime/image_module.h"

#include <fmt/format.h>

#include <dlfcn.h>

#include <algorithm>
#include <cassert>
#include <cctype>
#include <cmath>
#include <filesystem>

namespace trimray {
namespace {
namespace fs = std::filesystem;

constexpr const char* kModuleName = "libtrimray_image.so";

/// Where the module may lie: beside or under the library or program that holds this code, then beside the program.
std::vector<fs::path> module_candidates()
{
    std::vector<fs::path> folders;
    Dl_info self{};
    if (dladdr(reinterpret_cast<const void*>(&module_candidates), &self) != 0 && self.dli_fname != nullptr) {
        std::error_code failed;
        const fs::path own = fs::canonical(self.dli_fname, failed);
        if (!failed)
            folders.push_back(own.parent_path());
    }
    std::error_code failed;
    const fs::path program = fs::read_symlink("/proc/self/exe", failed);
    if (!failed)
        folders.push_back(program.parent_path());
    std::vector<fs::path> candidates;
    for (const fs::path& folder : folders)
        for (const char* below : {"trimray", ".", "../lib/trimray"})
            candidates.push_back((folder / below / kModuleName).lexically_normal());
    candidates.emplace_back(fs::path(TRIMRAY_MODULE_DIR) / kModuleName);
    return candidates;
}

Result<const ImageModule*> open_module()
{
    for (const fs::path& candidate : module_candidates()) {
        std::error_code failed;
        if (!fs::exists(candidate, failed))
            continue;
        // never closed: OpenImageIO keeps threads that outlive a call
        void* handle = dlopen(candidate.c_str(), RTLD_NOW | RTLD_LOCAL);
        if (handle == nullptr)
            return Error{ErrorCode::ImageNotWritten, candidate.string(),
                         fmt::format("cannot be loaded: {}", dlerror())};
        using Entry = const ImageModule* (*)();
        const auto entry = reinterpret_cast<Entry>(dlsym(handle, kImageModuleSymbol));
        if (entry == nullptr || std::string_view(entry()->build) != TRIMRAY_VERSION)
            return Error{ErrorCode::ImageNotWritten, candidate.string(),
                         "belongs to another version of trimray; reinstall it"};
        return entry();
    }
    return Error{ErrorCode::ImageNotWritten, kModuleName,
                 fmt::format("not found in {} nor beside the program; reinstall trimray", TRIMRAY_MODULE_DIR)};
}

const Result<const ImageModule*>& image_module()
{
    static const Result<const ImageModule*> module = open_module();
    return module;
}

float linear_to_srgb(float value)
{
    return value <= 0.0031308f ? 12.92f * value : 1.055f * std::pow(value, 1.0f / 2.4f) - 0.055f;
}

uint8_t to_byte(float value)
{
    // the screen's range; !(value > 0) is true for NaN as well
    return !(value > 0) ? 0 : value >= 1 ? 255 : static_cast<uint8_t>(std::lround(value * 255));
}

/// Sums linear colours weighted by alpha and by the area they cover.
struct Mean {
    double red = 0, green = 0, blue = 0, alpha = 0, area = 0;
    void add(const float* linear, double weight)
    {
        const double covered = weight * linear[3];
        red += covered * linear[0];
        green += covered * linear[1];
        blue += covered * linear[2];
        alpha += covered;
        area += weight;
    }
    void store(float* linear) const
    {
        const double inverse = alpha > 0 ? 1 / alpha : 0; // nothing there: black, transparent
        linear[0] = static_cast<float>(red * inverse);
        linear[1] = static_cast<float>(green * inverse);
        linear[2] = static_cast<float>(blue * inverse);
        linear[3] = static_cast<float>(alpha / area);
    }
};

std::string ending(const std::string& path)
{
    std::string extension = fs::path(path).extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension;
}

} // namespace

float srgb_to_linear(float value)
{
    return value <= 0.04045f ? value / 12.92f : std::pow((value + 0.055f) / 1.055f, 2.4f);
}

Status check_image_name(const std::string& path)
{
    const std::string extension = ending(path);
    if (extension == ".png" || extension == ".exr")
        return Done{};
    return Error{ErrorCode::UnsupportedFormat, path, "a picture's name must end in .png or .exr"};
}

Status write_image(const std::string& path, const Frame& frame)
{
    const Status known = check_image_name(path);
    if (!known.ok())
        return known;
    const Result<std::vector<std::byte>> bytes =
        ending(path) == ".png" ? encode_png(to_picture(frame)) : encode_exr(frame);
    if (!bytes.ok())
        return bytes.error();
    return write_file_atomically(path, *bytes);
}

Result<std::vector<std::byte>> encode_exr(const Frame& frame)
{
    const Result<const ImageModule*>& module = image_module();
    if (!module.ok())
        return module.error();
    std::vector<std::string> channels = {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "U", "V", "face", "certified"};
    const bool has_map = !frame.map_value.empty();
    if (has_map)
        channels.emplace_back("map");
    const size_t count = static_cast<size_t>(frame.width) * frame.height;
    assert(frame.rgba.size() == count * 4 && frame.depth_mm.size() == count && frame.normal.size() == count * 3 &&
           frame.uv.size() == count * 2 && frame.face.size() == count && frame.certified.size() == count &&
           (!has_map || frame.map_value.size() == count) && "an EXR holds every AOV");
    std::vector<float> pixels;
    pixels.reserve(count * channels.size());
    for (size_t i = 0; i < count; ++i) {
        pixels.insert(pixels.end(), &frame.rgba[i * 4], &frame.rgba[i * 4] + 4);
        pixels.push_back(frame.depth_mm[i]);
        pixels.insert(pixels.end(), &frame.normal[i * 3], &frame.normal[i * 3] + 3);
        pixels.insert(pixels.end(), &frame.uv[i * 2], &frame.uv[i * 2] + 2);
        pixels.push_back(static_cast<float>(frame.face[i]));
        pixels.push_back(static_cast<float>(frame.certified[i]));
        if (has_map)
            pixels.push_back(frame.map_value[i]);
    }
    std::vector<std::byte> bytes;
    const std::string failure = (*module)->encode_exr(frame.width, frame.height, channels, pixels.data(), bytes);
    if (!failure.empty())
        return Error{ErrorCode::ImageNotWritten, "EXR", failure};
    return bytes;
}

Result<Environment> read_environment(const std::string& path)
{
    constexpr uint64_t kMostPixels = uint64_t{1} << 27; // 1.5 GB
    const std::string extension = ending(path);
    if (extension != ".hdr" && extension != ".exr")
        return Error{ErrorCode::UnsupportedFormat, path, "the name of a picture all around must end in .hdr or .exr"};
    std::error_code failed;
    if (!fs::is_regular_file(path, failed))
        return Error{ErrorCode::FileNotFound, path, "no such file"};
    const Result<const ImageModule*>& module = image_module();
    if (!module.ok())
        return module.error();
    Environment environment;
    environment.name = path;
    const std::string failure =
        (*module)->read_rgb(path, kMostPixels, environment.width, environment.height, environment.rgb);
    if (!failure.empty())
        return Error{ErrorCode::InvalidScene, path, failure};
    for (size_t i = 0; i < environment.rgb.size(); ++i)
        if (!(environment.rgb[i] >= 0) || !std::isfinite(environment.rgb[i]))
            return Error{ErrorCode::InvalidScene, path,
                         fmt::format("pixel ({}, {}): expected a finite colour of at least 0, found {}",
                                     i / 3 % environment.width, i / 3 / environment.width, environment.rgb[i])};
    return environment;
}

Picture to_picture(const Frame& frame)
{
    Picture picture{frame.width, frame.height, std::vector<uint8_t>(frame.rgba.size())};
    for (size_t i = 0; i < frame.rgba.size(); ++i)
        picture.rgba[i] = to_byte(i % 4 == 3 ? frame.rgba[i] : linear_to_srgb(frame.rgba[i]));
    return picture;
}

Picture box_filter(const Picture& picture, uint32_t width, uint32_t height)
{
    assert(width > 0 && height > 0 && picture.rgba.size() == size_t{4} * picture.width * picture.height);
    Frame frame;
    frame.width = width;
    frame.height = height;
    frame.rgba.resize(size_t{4} * width * height);
    const double scale_x = static_cast<double>(picture.width) / width;
    const double scale_y = static_cast<double>(picture.height) / height;
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) {
            // the pixel covers [x, x + 1) * scale of the source; each source pixel counts with the area they share
            const double left = x * scale_x, right = (x + 1) * scale_x;
            const double top = y * scale_y, bottom = (y + 1) * scale_y;
            Mean mean;
            for (uint32_t sy = static_cast<uint32_t>(top); sy < picture.height && sy < bottom; ++sy)
                for (uint32_t sx = static_cast<uint32_t>(left); sx < picture.width && sx < right; ++sx) {
                    const double shared = (std::min(right, sx + 1.0) - std::max(left, static_cast<double>(sx))) *
                                          (std::min(bottom, sy + 1.0) - std::max(top, static_cast<double>(sy)));
                    const uint8_t* from = &picture.rgba[(size_t{sy} * picture.width + sx) * 4];
                    const float linear[4] = {srgb_to_linear(from[0] / 255.0f), srgb_to_linear(from[1] / 255.0f),
                                             srgb_to_linear(from[2] / 255.0f), from[3] / 255.0f};
                    mean.add(linear, std::max(shared, 0.0));
                }
            mean.store(&frame.rgba[(size_t{y} * width + x) * 4]);
        }
    return to_picture(frame);
}

Frame average_samples(const Frame& frame, uint32_t samples)
{
    assert(samples > 0 && frame.width % samples == 0 && frame.height % samples == 0);
    Frame out;
    out.width = frame.width / samples;
    out.height = frame.height / samples;
    out.rgba.resize(size_t{4} * out.width * out.height);
    for (uint32_t y = 0; y < out.height; ++y)
        for (uint32_t x = 0; x < out.width; ++x) {
            Mean mean;
            for (uint32_t sy = y * samples; sy < (y + 1) * samples; ++sy)
                for (uint32_t sx = x * samples; sx < (x + 1) * samples; ++sx)
                    mean.add(&frame.rgba[(size_t{sy} * frame.width + sx) * 4], 1);
            mean.store(&out.rgba[(size_t{y} * out.width + x) * 4]);
        }
    return out;
}

void composite_over(Frame& frame, const std::array<float, 3>& background_linear)
{
    for (size_t i = 0; i < frame.rgba.size(); i += 4) {
        const float alpha = frame.rgba[i + 3];
        for (size_t c = 0; c < 3; ++c)
            frame.rgba[i + c] = alpha * frame.rgba[i + c] + (1 - alpha) * background_linear[c];
        frame.rgba[i + 3] = 1;
    }
}

} // namespace trimray
