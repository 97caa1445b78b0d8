// Pictures traced smaller and enlarged: nothing moves, the background stays, and every AOV is one that was traced.
#include "runtime/enlarge.h"
#include "runtime/reference_rays.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace trimray {
namespace {

struct Size {
    uint32_t width, height;
};
constexpr Size kSizes[] = {{64, 48}, {67, 41}, {30, 95}};
constexpr uint32_t kShrinks[] = {1, 2, 3, 4, 6, 8};

/// Where the middle of a traced pixel lies in the picture. Both have one middle.
double place(uint32_t i, uint32_t traced, uint32_t large, uint32_t shrink)
{
    return (i + 0.5 - 0.5 * traced) * shrink + 0.5 * large;
}

TEST(enlarge, what_is_traced_sees_the_middles_of_the_pixels_that_it_stands_for)
{
    for (const double orthographic_mm : {0.0, 50.0})
        for (const Size& size : kSizes)
            for (const uint32_t shrink : kShrinks) {
                RenderOptions options;
                options.width = size.width;
                options.height = size.height;
                options.camera = {{100, -80, 60}, {1, 2, 3}, {0, 0, 1}, 50, orthographic_mm};
                const RenderOptions traced = shrunk(options, shrink);
                EXPECT_EQ(traced.width, (size.width + shrink - 1) / shrink);
                EXPECT_EQ(traced.height, (size.height + shrink - 1) / shrink);
                EXPECT_FLOAT_EQ(traced.edge_width_px * float(shrink), options.edge_width_px);
                const ReferenceRays large(options.camera, size.width, size.height);
                const ReferenceRays small(traced.camera, traced.width, traced.height);
                for (const uint32_t x : {0u, traced.width / 3, traced.width - 1})
                    for (const uint32_t y : {0u, traced.height / 3, traced.height - 1}) {
                        const reference::Ray a = small.through(x + 0.5, y + 0.5);
                        const reference::Ray b = large.through(place(x, traced.width, size.width, shrink),
                                                               place(y, traced.height, size.height, shrink));
                        EXPECT_LT(reference::angle_deg(a.direction, b.direction), 1e-10);
                        using reference::operator-;
                        EXPECT_LT(reference::length(a.origin - b.origin), 1e-10);
                    }
            }
}

Frame colored(uint32_t width, uint32_t height, const auto& color)
{
    Frame frame;
    frame.width = width;
    frame.height = height;
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x)
            for (const float channel : color(x, y))
                frame.rgba.push_back(channel);
    return frame;
}

TEST(enlarge, a_ramp_stays_where_it_is)
{
    for (const Size& size : kSizes)
        for (const uint32_t shrink : kShrinks) {
            const uint32_t width = (size.width + shrink - 1) / shrink, height = (size.height + shrink - 1) / shrink;
            const Frame traced = colored(width, height, [&](uint32_t x, uint32_t y) {
                return std::array{float(place(x, width, size.width, shrink)),
                                  float(place(y, height, size.height, shrink)), 0.5f, 1.0f};
            });
            const Frame large = enlarge(traced, size.width, size.height, shrink, 2);
            ASSERT_EQ(large.rgba.size(), size_t{4} * size.width * size.height);
            for (uint32_t y = 0; y < size.height; ++y)
                for (uint32_t x = 0; x < size.width; ++x) {
                    // beyond the middles of the outermost traced pixels nothing goes on
                    const double red = std::clamp(x + 0.5, place(0, width, size.width, shrink),
                                                  place(width - 1, width, size.width, shrink));
                    const double green = std::clamp(y + 0.5, place(0, height, size.height, shrink),
                                                    place(height - 1, height, size.height, shrink));
                    const float* const pixel = &large.rgba[4 * (size_t{y} * size.width + x)];
                    ASSERT_NEAR(pixel[0], red, 1e-4);
                    ASSERT_NEAR(pixel[1], green, 1e-4);
                    ASSERT_NEAR(pixel[2], 0.5, 1e-6);
                    ASSERT_NEAR(pixel[3], 1, 1e-6);
                }
        }
}

TEST(enlarge, colours_beside_nothing_fade_and_do_not_darken)
{
    const Frame traced = colored(4, 2, [](uint32_t x, uint32_t) {
        return x < 2 ? std::array{0.8f, 0.2f, 0.1f, 1.0f} : std::array{0.0f, 0.0f, 0.0f, 0.0f};
    });
    const Frame large = enlarge(traced, 16, 8, 4, 1);
    std::set<float> alphas;
    for (size_t i = 0; i < large.rgba.size(); i += 4) {
        alphas.insert(large.rgba[i + 3]);
        if (large.rgba[i + 3] > 0) {
            EXPECT_FLOAT_EQ(large.rgba[i], 0.8f);
            EXPECT_FLOAT_EQ(large.rgba[i + 1], 0.2f);
        }
    }
    EXPECT_EQ(alphas, (std::set<float>{0, 0.125f, 0.375f, 0.625f, 0.875f, 1}));
}

TEST(enlarge, every_other_aov_is_that_of_the_nearest_traced_pixel)
{
    Frame traced = colored(2, 2, [](uint32_t, uint32_t) { return std::array{1.0f, 1.0f, 1.0f, 1.0f}; });
    traced.face = {7, -1, 3, 4};
    traced.instance = {0, -1, 1, 1};
    traced.depth_mm = {10, std::numeric_limits<float>::infinity(), 30, 40};
    traced.uv = {0, 1, 0, 0, 2, 3, 4, 5};
    traced.normal = {0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0};
    traced.certified = {1, 1, 0, 1};
    const Frame large = enlarge(traced, 5, 6, 3, 1); // the third column of five is cut off right and left alike
    ASSERT_EQ(large.face.size(), 30u);
    ASSERT_EQ(large.normal.size(), 90u);
    EXPECT_TRUE(large.map_value.empty());
    for (uint32_t y = 0; y < 6; ++y)
        for (uint32_t x = 0; x < 5; ++x) {
            const size_t pixel = size_t{y} * 5 + x;
            const size_t from = (y < 3 ? 0 : 2) + (x < 2 ? 0 : 1);
            if (x == 2) // as near to both
                continue;
            EXPECT_EQ(large.face[pixel], traced.face[from]) << x << ", " << y;
            EXPECT_EQ(large.depth_mm[pixel], traced.depth_mm[from]);
            EXPECT_EQ(large.uv[2 * pixel + 1], traced.uv[2 * from + 1]);
            EXPECT_EQ(large.normal[3 * pixel + 2], traced.normal[3 * from + 2]);
            EXPECT_EQ(large.certified[pixel], traced.certified[from]);
        }
}

TEST(enlarge, any_number_of_threads_gives_the_same)
{
    const Frame traced = colored(13, 9, [](uint32_t x, uint32_t y) {
        return std::array{float(x * 7 % 5), float(y * 3 % 4), float(x * y % 3), float((x + y) % 2)};
    });
    EXPECT_EQ(enlarge(traced, 50, 35, 4, 1).rgba, enlarge(traced, 50, 35, 4, 0).rgba);
}

} // namespace
} // namespace trimray
