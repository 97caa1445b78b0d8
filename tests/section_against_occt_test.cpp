// Caps of solids from files against the CAD kernel: the area that a plane and the solid have in common.
#include "tests/closed_forms.h"
#include "tests/occt_oracle.h"
#include "tests/traced_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iostream>
#include <string>

namespace trimray {
namespace {

using reference::cross;
using reference::dot;
using reference::length;
using reference::operator+;
using reference::operator-;
using reference::operator*;

constexpr double kRequired = 1e-4; // of the area
constexpr double kCounted = 1.3e6; // pixels of the cap that bring the area to a quarter of that

/// The pixels of the only plane's caps, and the rectangle that holds them.
struct CapPixels {
    uint64_t count = 0, uncertain = 0;
    uint32_t x0 = ~0u, x1 = 0, y0 = ~0u, y1 = 0;
};
CapPixels cap_pixels(const Frame& frame)
{
    CapPixels caps;
    for (size_t i = 0; i < frame.face.size(); ++i) {
        caps.uncertain += frame.certified[i] != 1;
        if (frame.face[i] != -2)
            continue;
        const auto x = static_cast<uint32_t>(i % frame.width), y = static_cast<uint32_t>(i / frame.width);
        ++caps.count;
        caps.x0 = std::min(caps.x0, x), caps.x1 = std::max(caps.x1, x);
        caps.y0 = std::min(caps.y0, y), caps.y1 = std::max(caps.y1, y);
    }
    return caps;
}

/// By parallel rays at right angles to the plane, `seen_mm` of it around its point; turned so that few lines of a model
/// lie along the rows.
RenderOptions straight_at(const SectionPlane& plane, double away_mm, double seen_mm, uint32_t pixels)
{
    RenderOptions options;
    options.width = options.height = pixels;
    options.camera.eye = plane.point_mm + plane.normal * (away_mm / length(plane.normal));
    options.camera.target = plane.point_mm;
    options.camera.up = {0.31, 0.83, 0.46};
    options.camera.orthographic_mm = seen_mm;
    options.shade = false;
    options.look.section.planes = {plane};
    return options;
}

class SectionAgainstOcct : public testing::TestWithParam<const char*> {};

TEST_P(SectionAgainstOcct, CapsHaveTheKernelsArea)
{
    const std::string path = std::string(TRIMRAY_TESTS_DIR) + "/models/" + GetParam();
    const auto scene = scene_of_file(path);
    ASSERT_TRUE(scene);
    const PackImage& image = scene->pack.image;
    Vec3 lo{}, size{};
    for (size_t i = 0; i < 3; ++i) {
        lo[i] = image.bounds_lo_mm[i];
        size[i] = image.bounds_hi_mm[i] - lo[i];
    }
    SectionPlane plane{{lo[0] + 0.47 * size[0], lo[1] + 0.52 * size[1], lo[2] + 0.49 * size[2]}, {0.36, -0.48, 0.8}};
    const auto expected_mm2 = oracle::section_area_mm2(path, plane.point_mm, plane.normal);
    ASSERT_TRUE(expected_mm2) << "the kernel cannot cut it";
    const auto tracer = make_cpu_tracer(scene);
    ASSERT_TRUE(tracer.ok());

    // where the caps are, and then as many pixels there as the bound takes
    constexpr uint32_t kOverview = 512;
    const double diagonal = length(size);
    RenderOptions options = straight_at(plane, diagonal, diagonal, kOverview);
    const CapPixels overview = cap_pixels(picture(**tracer, options));
    ASSERT_GT(overview.count, 100u);
    const reference::Ray middle =
        PixelRays(options).through(0.5 * (overview.x0 + overview.x1 + 1), 0.5 * (overview.y0 + overview.y1 + 1));
    plane.point_mm = middle.at(dot(plane.point_mm - middle.origin, plane.normal) / dot(middle.direction, plane.normal));
    const uint32_t across = std::max(overview.x1 - overview.x0, overview.y1 - overview.y0) + 3;
    const auto side = static_cast<uint32_t>(across * std::sqrt(kCounted / double(overview.count)));
    ASSERT_LE(side, 4000u) << "the cap is a small part of its square";
    const double seen_mm = across * diagonal / kOverview;
    const CapPixels caps = cap_pixels(picture(**tracer, straight_at(plane, diagonal, seen_mm, side)));

    // a border of n pixels passes some 8 sqrt(n), each counted by chance: off by 0.29 of a pixel in the mean square
    const double pixels = double(caps.count), area_mm2 = pixels * std::pow(seen_mm / side, 2);
    const double chance = 0.29 * std::sqrt(8 * std::sqrt(pixels)) / pixels, off = area_mm2 / *expected_mm2 - 1;
    std::cout << fmt::format("{}: {:.8g} mm2 of {:.8g}, off by {:.2g}; counting {} pixels is good to {:.2g}; {} of all "
                             "uncertain\n",
                             GetParam(), area_mm2, *expected_mm2, off, caps.count, chance, caps.uncertain);
    EXPECT_LE(4 * chance, kRequired) << "too few pixels to tell";
    EXPECT_LE(std::abs(off), kRequired);
}

INSTANTIATE_TEST_SUITE_P(Models, SectionAgainstOcct,
                         testing::Values("nozzle.stp", "io1-cm-214.stp", "sg1-c5-214.stp", "unit_sphere.stp",
                                         "revolved_sphere.step", "M6-1x12-countersunk-screw.step"),
                         [](const testing::TestParamInfo<const char*>& info) {
                             std::string name = info.param;
                             for (char& c : name)
                                 c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
                             return name;
                         });

} // namespace
} // namespace trimray
