// Solids of closed form for the tests of light and of sections, pictures of them by either tracer, and where in the
// world their pixels' hits are.
#pragma once

#include "format/reference_math.h"
#include "runtime/reference_rays.h"
#include "tests/keep_vulkan_loaded.h"
#include "tests/traced_scenes.h"

#include <functional>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

namespace trimray {

using reference::Vec3;

inline constexpr double kPi = std::numbers::pi;

/// A whole ball; mm, as all that follows.
inline void add_ball(TracedScene& scene, const Vec3& middle, double radius)
{
    using reference::operator*;
    scene.add(kKindSphere, radius / 10, middle * 0.1, {kPi, kPi / 2});
}

/// A whole torus around z.
inline void add_ring(TracedScene& scene, const Vec3& middle, double radius, double tube)
{
    using reference::operator*;
    scene.add(kKindTorus, radius / 10, middle * 0.1, {kPi, kPi}).param[1] = static_cast<float>(tube / radius);
}

/// A rectangle around `middle`, half as long as given along two axes; its outside is where axis 3 - i - j points.
struct HalfSide {
    int axis; // 0 x, 1 y, 2 z
    double sign, length;
};
inline void add_rectangle(TracedScene& scene, const Vec3& middle, const HalfSide& i, const HalfSide& j)
{
    using reference::operator*;
    const double scale = std::max(i.length, j.length);
    PatchRecord& patch = scene.add(kKindPlane, scale / 10, middle * 0.1, {i.length / scale, j.length / scale});
    Vec3 x{}, y{};
    x[static_cast<size_t>(i.axis)] = i.sign;
    y[static_cast<size_t>(j.axis)] = j.sign;
    const Vec3 z = reference::cross(x, y);
    for (size_t k = 0; k < 3; ++k) {
        patch.axis_x[k] = static_cast<float>(x[k]);
        patch.axis_y[k] = static_cast<float>(y[k]);
        patch.axis_z[k] = static_cast<float>(z[k]);
    }
}

/// A closed box of six faces, outside out.
inline void add_box(TracedScene& scene, const Vec3& middle, const Vec3& half)
{
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {1.0, -1.0}) {
            const int i = (axis + 1) % 3, j = (axis + 2) % 3;
            Vec3 at = middle;
            at[static_cast<size_t>(axis)] += side * half[static_cast<size_t>(axis)];
            add_rectangle(scene, at, {i, side, half[static_cast<size_t>(i)]}, {j, 1, half[static_cast<size_t>(j)]});
        }
}

/// A picture by one tracer; nothing where this machine has no Vulkan driver, which it prints.
inline std::optional<Drawn> drawn_by(bool vulkan, const std::shared_ptr<const Scene>& scene,
                                     const RenderOptions& options)
{
    if (!vulkan)
        return draw(scene, options);
    keep_vulkan_loaded();
    const auto tracer = make_vulkan_tracer(scene, true, false);
    if (!tracer.ok()) {
        if (tracer.error().code == ErrorCode::NoDevice)
            std::cout << "skipped vulkan: " << tracer.error().detail << "\n";
        else
            ADD_FAILURE() << tracer.error().where << ": " << tracer.error().detail;
        return {};
    }
    Drawn drawn;
    Result<Frame> frame = (*tracer)->render(options, drawn.stats);
    if (!frame.ok()) {
        ADD_FAILURE() << frame.error().where << ": " << frame.error().detail;
        return {};
    }
    drawn.frame = std::move(*frame);
    return drawn;
}

/// The ray through pixel coordinates (x, y), pixel i's middle at (i % width + 0.5, i / width + 0.5); unit direction,
/// so that a hit lies at its depth.
class PixelRays {
public:
    explicit PixelRays(const RenderOptions& options)
        : width_(options.width), rays_(options.camera, options.width, options.height)
    {
    }

    reference::Ray through(double x, double y) const
    {
        using reference::operator*;
        const reference::Ray ray = rays_.through(x, y);
        return {ray.origin, ray.direction * (1 / reference::length(ray.direction))};
    }
    reference::Ray of_pixel(size_t i) const { return through(double(i % width_) + 0.5, double(i / width_) + 0.5); }
    Vec3 hit(const Frame& frame, size_t i) const { return of_pixel(i).at(double(frame.depth_mm[i])); }

private:
    uint32_t width_;
    ReferenceRays rays_;
};

/// For suites of both tracers; the parameter says whether it is Vulkan's.
inline std::string tracer_name(const testing::TestParamInfo<bool>& info)
{
    return info.param ? "vulkan" : "cpu";
}

} // namespace trimray
