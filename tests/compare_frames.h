// Two tracers' frames of one view, pixel by pixel.
#pragma once

#include "runtime/tracer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

namespace trimray {

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b)
{
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

// Two tracers agree where rays meet the same surface; at a border either side is right.
struct Disagreement {
    int borders = 0;   // pixels with another face or none, beside a pixel of the CPU's frame with the same answer
    int strangers = 0; // ... where no neighbour has it
    int hits = 0;      // pixels with the same answer
    double depth = 0;  // largest relative difference, times the cosine of the angle between ray and normal
    double normal = 0; // largest distance of the unit normals
    double rgba = 0;
    int certified = 0; // same answer, but only one is certain
};

inline Disagreement compare(const Frame& cpu, const Frame& gpu, const RenderOptions& options)
{
    const CameraRays rays = camera_rays(options.camera, options.width, options.height);
    const auto same_id = [](const Frame& a, size_t i, const Frame& b, size_t j) {
        return a.face[i] == b.face[j] && a.instance[i] == b.instance[j];
    };
    Disagreement d;
    for (int y = 0; y < int(cpu.height); ++y) {
        for (int x = 0; x < int(cpu.width); ++x) {
            const size_t i = size_t(y) * cpu.width + size_t(x);
            if (!same_id(cpu, i, gpu, i)) {
                bool beside = false;
                for (int ny = std::max(y - 1, 0); ny <= std::min(y + 1, int(cpu.height) - 1); ++ny)
                    for (int nx = std::max(x - 1, 0); nx <= std::min(x + 1, int(cpu.width) - 1); ++nx)
                        beside |= same_id(cpu, size_t(ny) * cpu.width + size_t(nx), gpu, i);
                ++(beside ? d.borders : d.strangers);
                continue;
            }
            d.certified += cpu.certified[i] != gpu.certified[i];
            if (cpu.face[i] < 0)
                continue;
            ++d.hits;
            double along[3], length = 0, facing = 0, normal = 0;
            for (size_t c = 0; c < 3; ++c) {
                along[c] = rays.corner[c] + (x + 0.5) * rays.step_x[c] + (y + 0.5) * rays.step_y[c];
                length += along[c] * along[c];
                facing += along[c] * double(cpu.normal[3 * i + c]);
                normal += std::pow(double(cpu.normal[3 * i + c]) - double(gpu.normal[3 * i + c]), 2);
            }
            facing = std::abs(facing) / std::sqrt(length);
            d.depth = std::max(d.depth, facing * std::abs(double(gpu.depth_mm[i]) / double(cpu.depth_mm[i]) - 1));
            d.normal = std::max(d.normal, facing * std::sqrt(normal));
            for (size_t c = 0; c < 4; ++c)
                d.rgba = std::max(d.rgba, std::abs(double(cpu.rgba[4 * i + c]) - double(gpu.rgba[4 * i + c])));
        }
    }
    return d;
}

/// The bounds of "equal": the same ids except at borders, depth within 1e-6 of itself, and what follows from both.
inline void expect_small(const Disagreement& d, int pixels)
{
    EXPECT_EQ(d.strangers, 0);
    EXPECT_LE(d.borders, pixels / 1000);
    EXPECT_LE(d.depth, 1e-6);
    EXPECT_LE(d.normal, 1e-4);
    EXPECT_LE(d.rgba, 1e-3);
    // iterates without a root to go to wander; whether they end stuck or in doubt hangs on rounding
    EXPECT_LE(d.certified, pixels / 1000);
}

} // namespace trimray
