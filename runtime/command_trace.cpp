#include "runtime/command_trace.h"

#include "runtime/image_io.h"
#include "runtime/nearest_word.h"

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
    return Error{ErrorCode::Usage, choice.option,
                 fmt::format("expected one of {}, found '{}'{}", fmt::join(choice.known, ", "), value,
                             did_you_mean(value, choice.known))};
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

Reach model_reach(const PackImage& image, const PlacementView& placed)
{
    return [&image, placed](const std::array<double, 3>& direction) {
        double largest = -std::numeric_limits<double>::infinity();
        for (size_t i = 0; i < placed.instances.size(); ++i)
            if (placed.shows(i))
                largest = std::max(largest, largest_along(image, placed.instances[i], direction));
        return largest;
    };
}

Result<Camera> camera_of(const SceneCamera& asked, const PackImage& image, uint32_t width, uint32_t height)
{
    return camera_of(asked, image, model_reach(image, image), width, height);
}

Result<Camera> camera_of(const SceneCamera& asked, const PlacementView& placed, const Reach& framed, uint32_t width,
                         uint32_t height)
{
    Camera camera;
    camera.fov_deg = asked.fov_deg.value_or(camera.fov_deg);
    camera.orthographic_mm = asked.height_mm.value_or(0);
    if (!asked.eye) {
        const double aspect = static_cast<double>(width) / height;
        const bool parallel = asked.height_mm || asked.parallel.value_or(false);
        const bool known = parallel
                               ? standard_orthographic_view(asked.view, framed, aspect, camera.orthographic_mm, camera)
                               : standard_view(asked.view, framed, aspect, camera.fov_deg, camera);
        if (!known)
            return Error{
                ErrorCode::Usage, asked.where.empty() ? "--view" : asked.where,
                fmt::format("expected one of {}, found '{}'", fmt::join(standard_view_names(), ", "), asked.view)};
        return camera;
    }
    camera.eye = *asked.eye;
    for (size_t axis = 0; axis < 3; ++axis)
        camera.target[axis] =
            asked.target ? (*asked.target)[axis] : 0.5 * (placed.bounds_lo_mm[axis] + placed.bounds_hi_mm[axis]);
    camera.up = asked.up.value_or(std::array<double, 3>{0, 0, 1});
    if (camera.eye == camera.target)
        return Error{ErrorCode::Usage, asked.where,
                     "the eye is where the target is (without one, the model's middle): there is no direction to look "
                     "in"};
    return camera;
}

double diagonal_mm(const PackImage& image)
{
    double square = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
        const double side = image.bounds_hi_mm[axis] - image.bounds_lo_mm[axis];
        square += side * side;
    }
    return std::sqrt(square);
}

RenderOptions at_samples(RenderOptions options, uint32_t samples)
{
    options.width *= samples;
    options.height *= samples;
    options.edge_width_px *= static_cast<float>(samples);
    return options;
}

Result<Frame> trace_picture(Tracer& tracer, const RenderOptions& options, uint32_t samples, RenderStats& stats)
{
    Result<Frame> frame = tracer.render(at_samples(options, samples), stats);
    if (!frame.ok() || samples == 1)
        return frame;
    return average_samples(*frame, samples);
}

} // namespace trimray
