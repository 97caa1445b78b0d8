// What the pixels of a picture show, all of them or a block's, and which surface ends before another there.
#pragma once

#include "runtime/camera.h"

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace trimray {

struct Vec {
    float x, y, z;
};
inline float dot(Vec a, Vec b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// A camera's rays through pixels' middles, and the size of its picture.
struct PictureRays {
    PictureRays(const Camera& camera, uint32_t width, uint32_t height)
        : width_px(static_cast<int>(width)), height_px(static_cast<int>(height))
    {
        const CameraRays rays = camera_rays(camera, width, height);
        const auto vec = [](auto of) {
            return Vec{static_cast<float>(of(0)), static_cast<float>(of(1)), static_cast<float>(of(2))};
        };
        corner = vec([&](size_t i) { return rays.corner[i] + 0.5 * (rays.step_x[i] + rays.step_y[i]); });
        step_x = vec([&](size_t i) { return rays.step_x[i]; });
        step_y = vec([&](size_t i) { return rays.step_y[i]; });
        const Vec middle = direction(width_px / 2, height_px / 2);
        pixel = std::sqrt(dot(step_x, step_x)) / std::sqrt(dot(middle, middle));
        if (camera.orthographic_mm > 0) {
            const ParallelRays side_by_side = parallel_rays(camera, width, height);
            parallel_px = static_cast<float>(camera.orthographic_mm / height);
            apart_x = vec([&](size_t i) { return side_by_side.step_x[i]; });
            apart_y = vec([&](size_t i) { return side_by_side.step_y[i]; });
        }
    }

    Vec direction(int x, int y) const
    {
        const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
        return {corner.x + fx * step_x.x + fy * step_y.x, corner.y + fx * step_x.y + fy * step_y.y,
                corner.z + fx * step_x.z + fy * step_y.z};
    }
    Vec unit_direction(int x, int y) const
    {
        const Vec d = direction(x, y);
        const float scale = 1 / std::sqrt(dot(d, d));
        return {d.x * scale, d.y * scale, d.z * scale};
    }
    bool on_picture(int x, int y) const { return x >= 0 && y >= 0 && x < width_px && y < height_px; }
    bool parallel() const { return parallel_px > 0; }
    /// A pixel's width at a depth, mm.
    float footprint(float depth) const { return parallel() ? parallel_px : pixel * depth; }
    /// A depth and so many footprints.
    float beyond(float depth, float pixels) const
    {
        return parallel() ? depth + pixels * parallel_px : depth * (1 + pixels * pixel);
    }

    int width_px, height_px;
    Vec corner{}, step_x{}, step_y{};
    float pixel = 0; // a pixel's width at distance 1
    // Of parallel rays: a pixel's width in mm, and how far apart neighbours' rays are; else 0
    float parallel_px = 0;
    Vec apart_x{}, apart_y{};
};

/// The pixels [x0, x1) x [y0, y1) of a picture, in arrays whose rows are `stride` pixels apart. Channels: Frame.
struct SeenPixels {
    const PictureRays& rays;
    int x0, y0, x1, y1;
    size_t stride;
    float* rgba;
    const float* depth_mm;
    const float* normals;
    const int32_t* face;
    const int32_t* instance;

    bool has(int x, int y) const { return x >= x0 && y >= y0 && x < x1 && y < y1; }
    size_t at(int x, int y) const { return static_cast<size_t>(y - y0) * stride + static_cast<size_t>(x - x0); }
    bool is_hit(size_t i) const { return face[i] >= 0; }
    bool same_face(size_t a, size_t b) const { return face[a] == face[b] && instance[a] == instance[b]; }
    Vec normal(size_t i) const { return {normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]}; }

    /// Whether the surface of (x, y), a hit, ends before that of (tx, ty), which lies farther back: neither tangent
    /// plane meets the other within half a pixel. Domain: has() both.
    bool hides(int x, int y, int tx, int ty) const
    {
        const size_t i = at(x, y), t = at(tx, ty);
        if (!is_hit(t))
            return true;
        constexpr float kGap = 0.5f; // pixels: nearer surfaces are told apart by their borders
        const float gap = kGap * rays.footprint(depth_mm[i]);
        if (rays.parallel())
            return depth_mm[t] > plane_depth(i, x, y, tx, ty) + gap && plane_depth(t, tx, ty, x, y) > depth_mm[i] + gap;
        const Vec to_i = rays.unit_direction(x, y), to_t = rays.unit_direction(tx, ty);
        return depth_mm[t] > plane_depth(i, to_i, to_t) + gap && plane_depth(t, to_t, to_i) > depth_mm[i] + gap;
    }

private:
    /// The depth at which the ray `there` would meet the tangent plane of what pixel i shows along `here`; pixel i's
    /// own depth where the plane is seen too flat to tell.
    float plane_depth(size_t i, Vec along_here, Vec along_there) const
    {
        const Vec n = normal(i);
        const float here = dot(n, along_here), there = dot(n, along_there);
        constexpr float kFlat = 0.2f; // of the other angle's sine: the plane passes the eye's rays at nothing like it
        return there * here > kFlat * here * here ? depth_mm[i] * here / there : depth_mm[i];
    }
    /// Likewise where rays are parallel: (x, y) shows pixel i, and the ray of (tx, ty) runs beside.
    float plane_depth(size_t i, int x, int y, int tx, int ty) const
    {
        // n . (o + s d - p) = 0 with p = o_i + depth d
        const Vec n = normal(i);
        const float along = dot(n, rays.unit_direction(x, y));
        const float across =
            static_cast<float>(tx - x) * dot(n, rays.apart_x) + static_cast<float>(ty - y) * dot(n, rays.apart_y);
        constexpr float kFlat = 1e-3f; // cosine: a plane seen so flat tells nothing of its depth a pixel beside
        return std::abs(along) > kFlat ? depth_mm[i] - across / along : depth_mm[i];
    }
};

} // namespace trimray
