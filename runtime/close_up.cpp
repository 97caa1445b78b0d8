#include "runtime/close_up.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <vector>

namespace trimray {
namespace {

bool is_border(const PackImage& image, const Frame& frame, uint32_t x, uint32_t y)
{
    const size_t here = size_t{y} * frame.width + x;
    if (frame.face[here] < 0 || (image.faces[static_cast<uint>(frame.face[here])].flags & kFaceNaturalBorder) != 0)
        return false;
    const auto ends_beside = [&](size_t there) {
        const bool same = frame.face[there] == frame.face[here] && frame.instance[there] == frame.instance[here];
        return !same && frame.depth_mm[there] >= frame.depth_mm[here]; // what lies in front only hides the face
    };
    return (x > 0 && ends_beside(here - 1)) || (x + 1 < frame.width && ends_beside(here + 1)) ||
           (y > 0 && ends_beside(here - frame.width)) || (y + 1 < frame.height && ends_beside(here + frame.width));
}

struct Window {
    uint32_t x, y, width, height;
};

/// Sums over the rectangle from the upper left corner: sums[(y) * (width + 1) + x] of the pixels above and left.
std::vector<uint32_t> summed(const std::vector<uint8_t>& border, uint32_t width, uint32_t height)
{
    std::vector<uint32_t> sums(size_t{width + 1} * (height + 1));
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) {
            const size_t at = size_t{y + 1} * (width + 1) + x + 1;
            sums[at] = border[size_t{y} * width + x] + sums[at - 1] + sums[at - width - 1] - sums[at - width - 2];
        }
    return sums;
}

Window richest_window(const std::vector<uint8_t>& border, uint32_t width, uint32_t height, double magnification)
{
    const auto part = [magnification](uint32_t side) {
        return std::clamp(static_cast<uint32_t>(std::lround(side / magnification)), 1u, side);
    };
    Window best{0, 0, part(width), part(height)};
    const std::vector<uint32_t> sums = summed(border, width, height);
    const auto sum = [&](uint32_t x, uint32_t y) { return sums[size_t{y} * (width + 1) + x]; };
    uint32_t most = 0;
    for (uint32_t y = 0; y + best.height <= height; ++y)
        for (uint32_t x = 0; x + best.width <= width; ++x) {
            const uint32_t count =
                sum(x + best.width, y + best.height) - sum(x, y + best.height) - sum(x + best.width, y) + sum(x, y);
            if (count > most) {
                most = count;
                best.x = x;
                best.y = y;
            }
        }
    return best;
}

} // namespace

Result<Camera> close_up(Tracer& tracer, const PackImage& image, const RenderOptions& whole, double magnification)
{
    assert(magnification > 1);
    RenderStats stats;
    const Result<Frame> traced = tracer.render(whole, stats);
    if (!traced.ok())
        return traced.error();
    const Frame& frame = *traced;
    std::vector<uint8_t> border(frame.face.size());
    for (uint32_t y = 0; y < frame.height; ++y)
        for (uint32_t x = 0; x < frame.width; ++x)
            border[size_t{y} * frame.width + x] = is_border(image, frame, x, y);
    const Window window = richest_window(border, frame.width, frame.height, magnification);

    uint32_t target_x = frame.width / 2, target_y = frame.height / 2;
    double least = 1e300;
    for (uint32_t y = window.y; y < window.y + window.height; ++y)
        for (uint32_t x = window.x; x < window.x + window.width; ++x) {
            const double away =
                std::hypot(x + 0.5 - window.x - 0.5 * window.width, y + 0.5 - window.y - 0.5 * window.height);
            if (border[size_t{y} * frame.width + x] == 0 || away >= least)
                continue;
            least = away;
            target_x = x;
            target_y = y;
        }
    Camera camera = whole.camera;
    const size_t target = size_t{target_y} * frame.width + target_x;
    if (frame.face[target] < 0)
        return camera; // nothing is seen
    const CameraRays rays = camera_rays(whole.camera, frame.width, frame.height);
    std::array<double, 3> along;
    double length2 = 0;
    for (size_t i = 0; i < 3; ++i) {
        along[i] = rays.corner[i] + (target_x + 0.5) * rays.step_x[i] + (target_y + 0.5) * rays.step_y[i];
        length2 += along[i] * along[i];
    }
    for (size_t i = 0; i < 3; ++i) {
        const double to_hit = along[i] / std::sqrt(length2) * frame.depth_mm[target];
        camera.target[i] = camera.eye[i] + to_hit;
        camera.eye[i] = camera.target[i] - to_hit / magnification;
    }
    return camera;
}

} // namespace trimray
