#include "runtime/enlarge.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace trimray {
namespace {

/// Between which two traced pixels the middle of a large one lies, along one axis, and at which share.
struct Between {
    uint32_t first, second;
    float share; // from the first to the second
    uint32_t nearest() const { return share < 0.5f ? first : second; }
};

/// For each of `large` pixels; both pictures have one middle. Beyond the outermost traced pixels' middles: those.
std::vector<Between> places(uint32_t large, uint32_t traced, uint32_t shrink)
{
    std::vector<Between> all(large);
    for (uint32_t i = 0; i < large; ++i) {
        const double at = std::clamp((i + 0.5 - 0.5 * large) / shrink + 0.5 * traced - 0.5, 0.0, double(traced) - 1);
        const auto first = uint32_t(at);
        all[i] = {first, std::min(first + 1, traced - 1), float(at - first)};
    }
    return all;
}

/// A traced row's colours at each of `columns`, times their alpha.
std::vector<float> drawn_out(const Frame& frame, uint32_t y, const std::vector<Between>& columns)
{
    std::vector<float> row(4 * columns.size());
    for (size_t x = 0; x < columns.size(); ++x) {
        const float* const from = &frame.rgba[4 * (size_t{y} * frame.width + columns[x].first)];
        const float* const to = &frame.rgba[4 * (size_t{y} * frame.width + columns[x].second)];
        const float a = (1 - columns[x].share) * from[3], b = columns[x].share * to[3];
        for (size_t c = 0; c < 3; ++c)
            row[4 * x + c] = a * from[c] + b * to[c];
        row[4 * x + 3] = a + b;
    }
    return row;
}

} // namespace

RenderOptions shrunk(RenderOptions options, uint32_t shrink)
{
    if (shrink == 1)
        return options;
    const uint32_t height = (options.height + shrink - 1) / shrink;
    // The picture and what is traced have one middle. What is traced reaches beyond it where shrink does not divide it
    const double taller = double(height) * shrink / options.height;
    constexpr double kHalfDegree = std::numbers::pi / 360;
    options.camera.fov_deg = std::atan(taller * std::tan(options.camera.fov_deg * kHalfDegree)) / kHalfDegree;
    options.camera.orthographic_mm *= taller;
    options.width = (options.width + shrink - 1) / shrink;
    options.height = height;
    options.edge_width_px /= float(shrink);
    return options;
}

Frame enlarge(const Frame& frame, uint32_t width, uint32_t height, uint32_t shrink, uint32_t threads)
{
    const std::vector<Between> columns = places(width, frame.width, shrink),
                               rows = places(height, frame.height, shrink);
    Frame out;
    out.width = width;
    out.height = height;
    const size_t pixels = size_t{width} * height;
    const auto each_aov = [&frame, &out](const auto& body) { // those that are not there are empty
        body(frame.depth_mm, out.depth_mm, 1);
        body(frame.normal, out.normal, 3);
        body(frame.uv, out.uv, 2);
        body(frame.face, out.face, 1);
        body(frame.instance, out.instance, 1);
        body(frame.certified, out.certified, 1);
        body(frame.map_value, out.map_value, 1);
    };
    out.rgba.resize(4 * pixels);
    each_aov([&](const auto& from, auto& to, size_t channels) { to.resize(from.empty() ? 0 : channels * pixels); });
    const auto copy_nearest = [&](uint32_t y) {
        each_aov([&](const auto& from, auto& to, size_t channels) {
            if (!from.empty())
                for (uint32_t x = 0; x < width; ++x)
                    std::copy_n(&from[channels * (size_t{rows[y].nearest()} * frame.width + columns[x].nearest())],
                                channels, &to[channels * (size_t{y} * width + x)]);
        });
    };
    // all rows between two traced ones at once: these are drawn out to the width once
    const auto band = [&](uint32_t traced_y) {
        const auto begins_at = [&](uint32_t first) {
            return uint32_t(std::partition_point(rows.begin(), rows.end(),
                                                 [first](const Between& row) { return row.first < first; }) -
                            rows.begin());
        };
        const uint32_t begin = begins_at(traced_y), end = begins_at(traced_y + 1);
        if (begin == end)
            return;
        const std::vector<float> above = drawn_out(frame, rows[begin].first, columns);
        const std::vector<float> below = drawn_out(frame, rows[begin].second, columns);
        for (uint32_t y = begin; y < end; ++y) {
            const float share = rows[y].share;
            float* const colors = &out.rgba[4 * size_t{y} * width];
            for (size_t i = 0; i < size_t{4} * width; ++i)
                colors[i] = (1 - share) * above[i] + share * below[i];
            for (float* color = colors; color < colors + 4 * size_t{width}; color += 4)
                if (color[3] != 1) {
                    const float inverse = color[3] > 0 ? 1 / color[3] : 0; // nothing there: black, transparent
                    for (size_t c = 0; c < 3; ++c)
                        color[c] *= inverse;
                }
            copy_nearest(y);
        }
    };
    tbb::task_arena arena(threads > 0 ? int(std::min(threads, 1024u)) : tbb::info::default_concurrency());
    arena.execute([&] { tbb::parallel_for(0u, frame.height, band); });
    return out;
}

} // namespace trimray
