// The image module, the only file that sees OpenImageIO.
#include "runtime/image_module.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <memory>
#include <utility>

namespace trimray {
namespace {

std::string encode(const char* format, const OIIO::ImageSpec& spec, OIIO::TypeDesc type, const void* pixels,
                   std::vector<std::byte>& bytes)
{
    // OpenImageIO takes the format from the name; the bytes go to memory
    const std::string name = std::string("memory.") + format;
    const std::unique_ptr<OIIO::ImageOutput> out = OIIO::ImageOutput::create(name);
    if (!out)
        return std::string("OpenImageIO cannot write ") + format + ": " + OIIO::geterror();
    std::vector<unsigned char> buffer;
    OIIO::Filesystem::IOVecOutput memory(buffer);
    if (!out->supports("ioproxy") || !out->set_ioproxy(&memory))
        return std::string("this OpenImageIO cannot write ") + format + " to memory";
    if (!out->open(name, spec) || !out->write_image(type, pixels) || !out->close())
        return out->geterror();
    bytes.resize(buffer.size());
    std::memcpy(bytes.data(), buffer.data(), buffer.size());
    return "";
}

constexpr int kMostChannels = 64; // of a picture that is read

OIIO::ImageSpec spec_of(uint32_t width, uint32_t height, int channels, OIIO::TypeDesc type)
{
    return {static_cast<int>(width), static_cast<int>(height), channels, type};
}

std::string encode_exr(uint32_t width, uint32_t height, const std::vector<std::string>& channels, const float* pixels,
                       std::vector<std::byte>& bytes)
{
    OIIO::ImageSpec spec = spec_of(width, height, static_cast<int>(channels.size()), OIIO::TypeDesc::FLOAT);
    spec.channelnames = channels;
    spec.alpha_channel = spec.channelindex("A");
    spec.z_channel = spec.channelindex("Z");
    spec.attribute("compression", "zip");
    spec.attribute("oiio:ColorSpace", "Linear");
    spec.attribute("DateTime", ""); // without one OpenImageIO writes the time: the same frame gives the same bytes
    return encode("exr", spec, OIIO::TypeDesc::FLOAT, pixels, bytes);
}

std::string read_rgb(const std::string& path, uint64_t most_pixels, uint32_t& width, uint32_t& height,
                     std::vector<float>& rgb)
{
    const std::unique_ptr<OIIO::ImageInput> in = OIIO::ImageInput::open(path);
    if (!in)
        return OIIO::geterror();
    const OIIO::ImageSpec& spec = in->spec();
    if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.deep || spec.nchannels < 1 ||
        uint64_t(spec.width) * uint64_t(spec.height) > most_pixels || spec.nchannels > kMostChannels)
        return "is no flat picture of at most " + std::to_string(most_pixels) + " pixels";
    width = uint32_t(spec.width);
    height = uint32_t(spec.height);
    const size_t pixels = size_t(width) * height, channels = size_t(spec.nchannels);
    const size_t used = channels < 3 ? 1 : 3;
    const int red = std::max(used == 3 ? spec.channelindex("R") : 0, 0);
    if (size_t(red) + used > channels)
        return "has no channels R, G and B in this order";
    std::vector<float> read(pixels * used);
    if (!in->read_image(0, 0, red, red + int(used), OIIO::TypeDesc::FLOAT, read.data()))
        return in->geterror();
    if (used == 3) {
        rgb = std::move(read);
        return "";
    }
    rgb.resize(3 * pixels);
    for (size_t i = 0; i < rgb.size(); ++i)
        rgb[i] = read[i / 3];
    return "";
}

// Nothing thrown leaves the module.
template <auto function>
struct Guarded;
template <class... Arguments, std::string (*function)(Arguments...)>
struct Guarded<function> {
    static std::string call(Arguments... arguments)
    {
        try {
            return function(static_cast<Arguments&&>(arguments)...);
        } catch (const std::exception& error) {
            return error.what();
        }
    }
};

} // namespace

extern "C" __attribute__((visibility("default"))) const ImageModule* trimray_image_module()
{
    static const ImageModule module = {TRIMRAY_VERSION, Guarded<encode_exr>::call, Guarded<read_rgb>::call};
    return &module;
}

} // namespace trimray
