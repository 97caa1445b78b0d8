// A trimmed plane traced in every trim mode of both tracers, each pixel compared with the even-odd crossing count in
// double over the pieces as they are stored.
#pragma once

#include "tests/keep_vulkan_loaded.h"
#include "tests/traced_scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iostream>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace trimray::hard {

/// One way to answer trims.
struct TrimWay {
    const char* name; // "cpu exact", as a test prints it
    bool vulkan;
    TrimMode mode;

    /// Whether only rounding keeps it from the reference; the distance texture alone is an approximation.
    bool exact() const { return mode != TrimMode::Sdf; }
};
inline constexpr std::array<TrimWay, 8> kTrimWays{{{"cpu exact", false, TrimMode::Exact},
                                                   {"cpu hybrid", false, TrimMode::Hybrid},
                                                   {"cpu sdf", false, TrimMode::Sdf},
                                                   {"cpu kd", false, TrimMode::Kd},
                                                   {"vulkan exact", true, TrimMode::Exact},
                                                   {"vulkan hybrid", true, TrimMode::Hybrid},
                                                   {"vulkan sdf", true, TrimMode::Sdf},
                                                   {"vulkan kd", true, TrimMode::Kd}}};

/// A square plane, 20 mm a side in z = 0, uv_face (0,0) at (-10, -10), trimmed; or untrimmed where the loops are the
/// domain's rectangle.
struct TrimmedPlane {
    std::shared_ptr<const Scene> scene;
    std::vector<MonotonePiece> pieces;
    std::function<bool(double u, double v)> truth; // what is inside, where that is not what the pieces say

    const FaceRecord& face() const { return scene->pack.image.faces[0]; }
    bool inside(double u, double v) const
    {
        if (u < 0 || u > 1 || v < 0 || v > 1)
            return false;
        if (truth)
            return truth(u, v);
        return (face().flags & kFaceNaturalBorder) != 0 || shapes::exact_inside(pieces, u, v);
    }
};

inline constexpr double kPlaneSide_mm = 20;

inline TrimmedPlane trimmed_plane(const std::vector<shapes::Loop>& loops)
{
    TracedScene builder;
    builder.add(kKindPlane, 1, {0, 0, 0}, {1, 1});
    if (!loops.empty())
        builder.trim(0, loops);
    TrimmedPlane plane;
    plane.scene = builder.finish();
    plane.pieces = shapes::pieces_of(plane.scene->pack.image, 0);
    return plane;
}

/// The same of loops as the converter gives them: points (u, v) and piece words. No pieces: a natural border.
inline TrimmedPlane trimmed_plane(const std::vector<float>& points, const std::vector<uint32_t>& pieces,
                                  uint32_t loop_count)
{
    TracedScene builder;
    builder.add(kKindPlane, 1, {0, 0, 0}, {1, 1});
    if (!pieces.empty()) {
        FaceRecord& face = builder.image.faces[0];
        face.flags &= ~kFaceNaturalBorder;
        face.point_count = static_cast<uint>(points.size() / 2);
        face.piece_count = static_cast<uint>(pieces.size());
        face.loop_count = loop_count;
        builder.image.trim_points = points;
        builder.image.trim_pieces = pieces;
    }
    TrimmedPlane plane;
    plane.scene = builder.finish();
    plane.pieces = shapes::pieces_of(plane.scene->pack.image, 0);
    return plane;
}

/// A square picture, seen from above: `size` is the length in uv_face that it shows.
struct PlaneView {
    double u = 0.5, v = 0.5, size = 1.1;
    uint32_t pixels = 160;
};

struct TrimErrors {
    int inside = 0;               // pixels inside by the reference
    int wrong = 0;                // pixels that the tracer has on the other side
    double farthest_px = 0;       // of a wrong pixel from the nearest piece
    double farthest_texels = 0;   // the same, in texels of the distance texture; 0 where there is none
    std::vector<uint8_t> picture; // 1 where the tracer has a hit, row 0 at the top
};

namespace detail {

constexpr double kEyeHeight_mm = 50;

inline RenderOptions options_of(const PlaneView& view, TrimMode mode)
{
    const double x = (view.u - 0.5) * kPlaneSide_mm, y = (view.v - 0.5) * kPlaneSide_mm;
    RenderOptions options;
    options.width = options.height = view.pixels;
    options.camera.eye = {x, y, kEyeHeight_mm};
    options.camera.target = {x, y, 0};
    options.camera.up = {0, 1, 0};
    options.camera.fov_deg = 360 / std::numbers::pi * std::atan(0.5 * view.size * kPlaneSide_mm / kEyeHeight_mm);
    options.trim = mode;
    options.shade = false;
    return options;
}

inline TrimErrors errors_of(const TrimmedPlane& plane, const RenderOptions& options, const Frame& frame,
                            const PlaneView& view)
{
    const CameraRays rays = camera_rays(options.camera, options.width, options.height);
    const double texels = plane.face().sdf_size != 0 ? kPlaneSide_mm / plane.face().sdf_texel_mm : 0;
    TrimErrors errors;
    for (uint32_t y = 0; y < options.height; ++y)
        for (uint32_t x = 0; x < options.width; ++x) {
            double along[3];
            for (size_t i = 0; i < 3; ++i)
                along[i] = rays.corner[i] + (x + 0.5) * rays.step_x[i] + (y + 0.5) * rays.step_y[i];
            const double t = -rays.eye[2] / along[2]; // the plane is z = 0
            const double u = 0.5 + (rays.eye[0] + t * along[0]) / kPlaneSide_mm;
            const double v = 0.5 + (rays.eye[1] + t * along[1]) / kPlaneSide_mm;
            const bool expected = plane.inside(u, v);
            const bool hit = frame.face[size_t(y) * options.width + x] >= 0;
            errors.inside += expected;
            errors.picture.push_back(hit);
            if (hit == expected)
                continue;
            ++errors.wrong;
            const double rim = std::max({-u, u - 1, -v, v - 1, std::min({u, 1 - u, v, 1 - v})});
            const double off = std::min(shapes::exact_distance(plane.pieces, u, v), std::abs(rim));
            errors.farthest_px = std::max(errors.farthest_px, off / view.size * view.pixels);
            errors.farthest_texels = std::max(errors.farthest_texels, off * texels);
        }
    return errors;
}

} // namespace detail

/// Traces each view of the plane in every way there is and hands over what it finds; prints the figures. Ways that a
/// tracer refuses as not in this version, and Vulkan without a driver, are named as skipped.
/// Returns how many ways were tested.
inline int in_every_trim_mode(const TrimmedPlane& plane, const std::vector<PlaneView>& views,
                              const std::function<void(const TrimWay&, size_t view, const TrimErrors&)>& check)
{
    keep_vulkan_loaded();
    std::array<std::unique_ptr<Tracer>, 2> tracers;
    std::array<std::string, 2> absent;
    for (const bool vulkan : {false, true}) {
        auto made = vulkan ? make_vulkan_tracer(plane.scene, true, false) : make_cpu_tracer(plane.scene);
        if (made.ok())
            tracers[vulkan] = std::move(*made);
        else if (vulkan && made.error().code == ErrorCode::NoDevice)
            absent[vulkan] = made.error().detail;
        else
            ADD_FAILURE() << made.error().where << ": " << made.error().detail;
    }
    int tested = 0;
    for (const TrimWay& way : kTrimWays) {
        if (!tracers[way.vulkan]) {
            std::cout << "skipped " << way.name << ": " << absent[way.vulkan] << "\n";
            continue;
        }
        bool refused = false;
        for (size_t i = 0; i < views.size() && !refused; ++i) {
            const RenderOptions options = detail::options_of(views[i], way.mode);
            RenderStats stats;
            const Result<Frame> frame = tracers[way.vulkan]->render(options, stats);
            if (!frame.ok() && frame.error().code == ErrorCode::UnsupportedPackFeature) {
                std::cout << "skipped " << way.name << ": " << frame.error().detail << "\n";
                refused = true;
                continue;
            }
            if (!frame.ok()) {
                ADD_FAILURE() << way.name << ": " << frame.error().where << ": " << frame.error().detail;
                continue;
            }
            EXPECT_EQ(stats.trim, way.mode) << way.name;
            const TrimErrors errors = detail::errors_of(plane, options, *frame, views[i]);
            std::cout << way.name << ", view " << i << ": " << errors.wrong << " of " << errors.inside
                      << " pixels wrong, at most " << errors.farthest_px << " px, " << errors.farthest_texels
                      << " texels from the border\n";
            check(way, i, errors);
        }
        tested += !refused;
    }
    return tested;
}

} // namespace trimray::hard
