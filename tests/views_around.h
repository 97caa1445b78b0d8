// Cameras around and inside of a model, for tools that cast many rays at it: seeded, so the same every time.
#pragma once

#include "format/pack_image.h"
#include "format/reference_math.h"
#include "runtime/tracer.h"

#include <cmath>
#include <optional>
#include <random>

namespace trimray {

class ViewsAround {
public:
    explicit ViewsAround(const PackImage& image)
    {
        reference::Vec3 half{};
        for (size_t i = 0; i < 3; ++i) {
            middle_[i] = 0.5 * (image.bounds_lo_mm[i] + image.bounds_hi_mm[i]);
            half[i] = 0.5 * (image.bounds_hi_mm[i] - image.bounds_lo_mm[i]);
        }
        radius_ = std::max(reference::length(half), 1e-9);
    }

    /// The whole model, from anywhere.
    Camera whole()
    {
        using reference::operator+;
        using reference::operator*;
        constexpr double kDegree = 3.14159265358979323846 / 180;
        Camera camera;
        camera.fov_deg = 35;
        camera.target = middle_;
        camera.eye = middle_ + direction() * (radius_ / std::sin(0.5 * camera.fov_deg * kDegree));
        camera.up = direction();
        return camera;
    }

    /// What a pixel of a picture shows, through a lens 2 to 1000 times as long. Nothing where it shows no face.
    std::optional<Camera> close_up(const Frame& frame, const Camera& of)
    {
        const auto at = seen(frame, of);
        if (!at)
            return {};
        Camera camera = of;
        camera.target = *at;
        camera.fov_deg = of.fov_deg / std::pow(10, uniform(0.3, 3));
        return camera;
    }

    /// From beside a surface that a picture shows, 1e-3 to 0.3 of the model's size from it, to anywhere.
    std::optional<Camera> within(const Frame& frame, const Camera& of)
    {
        using reference::operator+;
        using reference::operator*;
        const auto at = seen(frame, of);
        if (!at)
            return {};
        Camera camera;
        camera.fov_deg = 80;
        camera.eye = *at + direction() * (radius_ * std::pow(10, uniform(-3, -0.5)));
        camera.target = camera.eye + direction();
        return camera;
    }

private:
    double uniform(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random_); }

    reference::Vec3 direction()
    {
        using reference::operator*;
        while (true) {
            const reference::Vec3 d{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
            const double size = reference::length(d);
            if (size > 0.1 && size < 1)
                return d * (1 / size);
        }
    }

    /// The point on a face in the middle of a pixel drawn at random, if one of some pixels shows any.
    std::optional<reference::Vec3> seen(const Frame& frame, const Camera& of)
    {
        using reference::operator+;
        using reference::operator*;
        const CameraRays rays = camera_rays(of, frame.width, frame.height);
        for (int attempt = 0; attempt < 200; ++attempt) {
            const size_t i = random_() % frame.face.size();
            if (frame.face[i] < 0)
                continue;
            const double x = double(i % frame.width) + 0.5, y = double(i / frame.width) + 0.5;
            const reference::Vec3 along = rays.corner + rays.step_x * x + rays.step_y * y;
            return rays.eye + along * (double(frame.depth_mm[i]) / reference::length(along));
        }
        return {};
    }

    reference::Vec3 middle_{}; // of the model's box
    double radius_ = 1;        // mm, of the box's sphere
    std::mt19937 random_{1};
};

} // namespace trimray
