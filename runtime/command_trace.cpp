#include "runtime/command_trace.h"

#include "runtime/command_report.h"
#include "runtime/image_io.h"

#include "format/leaf_geometry.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cmath>
#include <limits>

namespace trimray {
namespace {

// A frame of AOVs takes 53 bytes a pixel: the largest picture takes 14 GB.
constexpr uint64_t kMaxPixels = uint64_t{1} << 28;

Result<std::array<double, 3>> parse_vector(const std::string& option, const std::string& text)
{
    const Result<std::vector<double>> numbers = parse_numbers(option, text, 3);
    if (!numbers.ok())
        return numbers.error();
    return std::array<double, 3>{(*numbers)[0], (*numbers)[1], (*numbers)[2]};
}

} // namespace

const Choice& trim_choice()
{
    static const Choice choice{
        "--trim", {"auto", "exact", "hybrid", "sdf", "kd"}, {"auto", "exact", "hybrid", "sdf", "kd"}};
    return choice;
}

const Choice& closest_choice()
{
    static const Choice choice{"--closest", {"certified", "stochastic"}, {"certified", "stochastic"}};
    return choice;
}

const Choice& device_choice()
{
    static const Choice choice{
        "--device", {"auto", "cpu", "vulkan", "reference"}, {"auto", "cpu", "vulkan", "reference"}};
    return choice;
}

Status check_choice(const Choice& choice, const std::string& value)
{
    const auto in = [&value](const std::vector<std::string>& names) {
        return std::find(names.begin(), names.end(), value) != names.end();
    };
    if (in(choice.available))
        return Done{};
    if (in(choice.known))
        return Error{ErrorCode::UnsupportedFormat, choice.option,
                     fmt::format("'{}' is not in this version; there {} {}", value,
                                 choice.available.size() == 1 ? "is" : "are", fmt::join(choice.available, ", "))};
    const std::string near = nearest_word(value, choice.known);
    return Error{ErrorCode::Usage, choice.option,
                 fmt::format("expected one of {}, found '{}'{}", fmt::join(choice.known, ", "), value,
                             near.empty() ? "" : fmt::format("; did you mean '{}'?", near))};
}

ClosestPolicy closest_policy(const std::string& name)
{
    return name == "stochastic" ? ClosestPolicy::Stochastic : ClosestPolicy::Certified;
}

const char* closest_name(ClosestPolicy policy)
{
    return policy == ClosestPolicy::Stochastic ? "stochastic" : "certified";
}

TrimMode trim_mode(const std::string& name)
{
    if (name == "exact")
        return TrimMode::Exact;
    if (name == "sdf")
        return TrimMode::Sdf;
    if (name == "hybrid")
        return TrimMode::Hybrid;
    if (name == "kd")
        return TrimMode::Kd;
    assert(name == "auto" && "checked against trim_choice()");
    return TrimMode::Auto;
}

Result<std::unique_ptr<Tracer>> make_tracer(const std::shared_ptr<const Scene>& scene, const std::string& device,
                                            std::string& note)
{
    if (device == "vulkan")
        return make_vulkan_tracer(scene, true, false);
    if (device == "cpu")
        return make_cpu_tracer(scene);
    if (device == "reference")
        return make_reference_tracer(scene);
    Result<std::unique_ptr<Tracer>> gpu = make_vulkan_tracer(scene, false, false);
    if (gpu.ok()) {
        note = fmt::format("tracing on {}, a hardware GPU", (*gpu)->device_name());
        return gpu;
    }
    Result<std::unique_ptr<Tracer>> cpu = make_cpu_tracer(scene);
    if (cpu.ok())
        note = fmt::format("tracing on the CPU ({}): no hardware GPU: {}", (*cpu)->device_name(), gpu.error().detail);
    return cpu;
}

Result<PictureSize> parse_size(const std::string& text, uint32_t samples)
{
    PictureSize size;
    const char* const end = text.data() + text.size();
    const auto width = std::from_chars(text.data(), end, size.width);
    const bool has_x = width.ec == std::errc() && width.ptr != end && *width.ptr == 'x';
    const auto height = has_x ? std::from_chars(width.ptr + 1, end, size.height) : width;
    if (!has_x || height.ec != std::errc() || height.ptr != end || size.width == 0 || size.height == 0)
        return Error{ErrorCode::Usage, "--size", fmt::format("expected WIDTHxHEIGHT in pixels, found '{}'", text)};
    constexpr uint32_t kMaxSide = 65535; // samples times this stays below 2^32
    if (size.width > kMaxSide || size.height > kMaxSide ||
        uint64_t{size.width} * size.height * samples * samples > kMaxPixels)
        return Error{ErrorCode::Usage, "--size",
                     fmt::format("{} at {} samples is more than {} pixels, or wider than {}", text, samples * samples,
                                 kMaxPixels, kMaxSide)};
    return size;
}

Result<Camera> camera_of(const ViewArguments& arguments, const PackImage& image, uint32_t width, uint32_t height)
{
    if (!(arguments.fov_deg > 0 && arguments.fov_deg < 180))
        return Error{ErrorCode::Usage, "--fov",
                     fmt::format("expected an angle between 0 and 180 degrees, found {}", arguments.fov_deg)};
    const std::array<double, 3> lo{image.bounds_lo_mm[0], image.bounds_lo_mm[1], image.bounds_lo_mm[2]};
    const std::array<double, 3> hi{image.bounds_hi_mm[0], image.bounds_hi_mm[1], image.bounds_hi_mm[2]};
    Camera camera;
    if (arguments.eye.empty()) {
        if (!arguments.target.empty() || !arguments.up.empty())
            return Error{ErrorCode::Usage, arguments.target.empty() ? "--up" : "--target",
                         "needs --eye x,y,z; without it the model is framed whole from --view"};
        const double aspect = static_cast<double>(width) / height;
        const Reach reach = [&image](const std::array<double, 3>& direction) {
            double largest = -std::numeric_limits<double>::infinity();
            for (const InstanceRecord& instance : image.instances)
                largest = std::max(largest, largest_along(image, instance, direction));
            return largest;
        };
        if (!standard_view(arguments.view, reach, aspect, arguments.fov_deg, camera))
            return Error{
                ErrorCode::Usage, "--view",
                fmt::format("expected one of iso, front, back, left, right, top, bottom, found '{}'", arguments.view)};
        return camera;
    }
    camera.fov_deg = arguments.fov_deg;
    for (size_t axis = 0; axis < 3; ++axis)
        camera.target[axis] = 0.5 * (lo[axis] + hi[axis]);
    camera.up = {0, 0, 1};
    for (const auto& [option, text, field] :
         {std::tuple{"--eye", &arguments.eye, &camera.eye}, std::tuple{"--target", &arguments.target, &camera.target},
          std::tuple{"--up", &arguments.up, &camera.up}}) {
        if (text->empty())
            continue;
        const Result<std::array<double, 3>> vector = parse_vector(option, *text);
        if (!vector.ok())
            return vector.error();
        *field = *vector;
    }
    if (camera.eye == camera.target)
        return Error{ErrorCode::Usage, "--eye", "is where --target is: there is no direction to look in"};
    if (camera.up == std::array<double, 3>{0, 0, 0})
        return Error{ErrorCode::Usage, "--up", "has no length"};
    return camera;
}

Result<Frame> trace_picture(Tracer& tracer, RenderOptions options, uint32_t samples, RenderStats& stats)
{
    options.width *= samples;
    options.height *= samples;
    options.edge_width_px *= static_cast<float>(samples);
    Result<Frame> frame = tracer.render(options, stats);
    if (!frame.ok() || samples == 1)
        return frame;
    return average_samples(*frame, samples);
}

} // namespace trimray
