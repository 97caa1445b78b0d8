#include "runtime/measure/ssim.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <vector>

namespace trimray {
namespace {

constexpr int kReach = 5; // pixels to each side
constexpr double kSigma_px = 1.5;

std::array<double, 2 * kReach + 1> window()
{
    std::array<double, 2 * kReach + 1> weights;
    double sum = 0;
    for (int i = -kReach; i <= kReach; ++i)
        sum += weights[size_t(i + kReach)] = std::exp(-0.5 * i * i / (kSigma_px * kSigma_px));
    for (double& weight : weights)
        weight /= sum;
    return weights;
}

/// A value a pixel, row by row.
struct Plane {
    int width, height;
    std::vector<double> values;
    double at(int x, int y) const
    {
        return values[size_t(std::clamp(y, 0, height - 1)) * size_t(width) + size_t(std::clamp(x, 0, width - 1))];
    }
};

Plane luma(const Picture& picture)
{
    Plane plane{int(picture.width), int(picture.height), {}};
    for (size_t i = 0; i < picture.rgba.size(); i += 4)
        plane.values.push_back(0.2126 * picture.rgba[i] + 0.7152 * picture.rgba[i + 1] + 0.0722 * picture.rgba[i + 2]);
    return plane;
}

Plane product(const Plane& a, const Plane& b)
{
    Plane out = a;
    for (size_t i = 0; i < out.values.size(); ++i)
        out.values[i] *= b.values[i];
    return out;
}

Plane blurred(const Plane& plane)
{
    const auto weights = window();
    Plane across = plane, out = plane;
    for (const bool rows : {true, false}) {
        const Plane& from = rows ? plane : across;
        Plane& to = rows ? across : out;
        for (int y = 0; y < plane.height; ++y)
            for (int x = 0; x < plane.width; ++x) {
                double sum = 0;
                for (int i = -kReach; i <= kReach; ++i)
                    sum += weights[size_t(i + kReach)] * (rows ? from.at(x + i, y) : from.at(x, y + i));
                to.values[size_t(y) * size_t(plane.width) + size_t(x)] = sum;
            }
    }
    return out;
}

} // namespace

double ssim(const Picture& a, const Picture& b)
{
    assert(a.width == b.width && a.height == b.height && !a.rgba.empty());
    const Plane x = luma(a), y = luma(b);
    const Plane mean_x = blurred(x), mean_y = blurred(y);
    const Plane square_x = blurred(product(x, x)), square_y = blurred(product(y, y)), mixed = blurred(product(x, y));
    constexpr double kC1 = 0.01 * 255 * 0.01 * 255, kC2 = 0.03 * 255 * 0.03 * 255;
    double sum = 0;
    for (size_t i = 0; i < x.values.size(); ++i) {
        const double mx = mean_x.values[i], my = mean_y.values[i];
        const double variances = square_x.values[i] - mx * mx + square_y.values[i] - my * my;
        const double covariance = mixed.values[i] - mx * my;
        sum += (2 * mx * my + kC1) * (2 * covariance + kC2) / ((mx * mx + my * my + kC1) * (variances + kC2));
    }
    return sum / static_cast<double>(x.values.size());
}

} // namespace trimray
