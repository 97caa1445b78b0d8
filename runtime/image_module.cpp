// The image module, the only file that sees OpenImageIO.
#include "runtime/image_module.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstring>
#include <exception>
#include <memory>

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
    static const ImageModule module = {TRIMRAY_VERSION, Guarded<encode_exr>::call};
    return &module;
}

} // namespace trimray
