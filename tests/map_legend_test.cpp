// Legends of maps against the pixels of traced pictures, at values known in closed form, and against the colours'
// names.
#include "runtime/view/map_legend.h"

#include "runtime/image_io.h"
#include "runtime/surface_map.h"
#include "tests/closed_forms.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>

namespace trimray {
namespace {

using Srgb = std::array<uint8_t, 4>;

RenderOptions seen_from(const Vec3& eye, SurfaceMap map)
{
    RenderOptions options;
    options.width = 160;
    options.height = 100;
    options.camera = {eye, {0, 0, 0}, {0, 0, 1}, 35};
    options.error_px = 1e-4f;
    options.look.map.map = map;
    return options;
}

Srgb srgb_of(double r, double g, double b)
{
    Frame pixel;
    pixel.width = pixel.height = 1;
    pixel.rgba = {float(r), float(g), float(b), 1};
    const Picture picture = to_picture(pixel);
    return {picture.rgba[0], picture.rgba[1], picture.rgba[2], picture.rgba[3]};
}

int largest_difference(const Srgb& a, const Srgb& b)
{
    int largest = 0;
    for (size_t c = 0; c < 4; ++c)
        largest = std::max(largest, std::abs(int(a[c]) - int(b[c])));
    return largest;
}

/// The colour that the light at the eye made pixel i of: shading.h in double, solved for it.
Srgb unshaded(const Frame& frame, size_t i, const Vec3& along)
{
    Vec3 n;
    for (size_t c = 0; c < 3; ++c)
        n[c] = double(frame.normal[3 * i + c]);
    const double cosine = -reference::dot(n, along), facing = std::min(std::abs(cosine), 1.0);
    const double light = 0.14 + 0.10 * (0.5 + 0.5 * (cosine < 0 ? -n[2] : n[2])) + 0.72 * facing;
    const double highlight = 0.12 * std::pow(facing, 32);
    const auto channel = [&](size_t c) { return (double(frame.rgba[4 * i + c]) - highlight) / light; };
    return srgb_of(channel(0), channel(1), channel(2));
}

/// Every pixel of the map, unshaded, has the colour that the legend says its value has; `value` of the place.
void expect_colors(const std::shared_ptr<const Scene>& scene, const RenderOptions& options,
                   const std::function<double(const Vec3&)>& value)
{
    const Frame frame = draw(scene, options).frame;
    const PixelRays rays(options);
    const PackImage& image = scene->pack.image;
    int hits = 0, worst = 0;
    for (size_t i = 0; i < frame.face.size(); ++i) {
        if (frame.face[i] < 0)
            continue;
        ++hits;
        const Srgb of_value = map_color_srgb(image, options.look.map, value(rays.hit(frame, i)));
        worst = std::max(worst, largest_difference(unshaded(frame, i, rays.of_pixel(i).direction), of_value));
    }
    EXPECT_GT(hits, 500);
    EXPECT_LE(worst, 1) << surface_map_name(options.look.map.map); // a byte's rounding
}

std::shared_ptr<const Scene> ball_of_7()
{
    TracedScene scene;
    add_ball(scene, {0, 0, 0}, 7);
    return scene.finish();
}

TEST(map_legend, pixels_of_a_ball_have_the_color_of_its_curvature)
{
    const auto scene = ball_of_7();
    for (const SurfaceMap map :
         {SurfaceMap::CurvatureMean, SurfaceMap::CurvatureMax, SurfaceMap::CurvatureMin, SurfaceMap::CurvatureGaussian})
        for (const double end : {0.0, 0.5, 0.15}) { // the pack's, in the scale, near its end
            RenderOptions options = seen_from({20, -30, 15}, map);
            const bool gaussian = map == SurfaceMap::CurvatureGaussian;
            const double value = gaussian ? 1 / 49.0 : 1 / 7.0;
            if (end > 0)
                options.look.map.range = std::array<double, 2>{-0.1, gaussian ? end * end : end};
            expect_colors(scene, options, [&](const Vec3&) { return value; });
        }
}

TEST(map_legend, pixels_of_a_rod_and_a_ring_have_the_colors_of_their_curvatures)
{
    TracedScene rod;
    rod.add(kKindCylinder, 0.5, {0, 0, 0}, {kPi, 2});
    const auto rod_scene = rod.finish();
    expect_colors(rod_scene, seen_from({20, -30, 10}, SurfaceMap::CurvatureMax), [](const Vec3&) { return 0.2; });
    expect_colors(rod_scene, seen_from({20, -30, 10}, SurfaceMap::CurvatureMean), [](const Vec3&) { return 0.1; });
    TracedScene ring;
    add_ring(ring, {0, 0, 0}, 6, 2);
    const auto across = [](const Vec3& p) { // the curvature around the axis
        const double rho = std::hypot(p[0], p[1]);
        return (rho - 6) / 2 / rho;
    };
    const auto ring_scene = ring.finish();
    expect_colors(ring_scene, seen_from({20, -30, 40}, SurfaceMap::CurvatureMin), across);
    expect_colors(ring_scene, seen_from({20, -30, 40}, SurfaceMap::CurvatureGaussian),
                  [&](const Vec3& p) { return across(p) / 2; });
}

TEST(map_legend, pixels_of_drafts_have_their_stretchs_color)
{
    for (const double draft_deg : {-20.0, -1.0, 5.0}) { // cones that are wider or narrower towards +z
        TracedScene scene;
        PatchRecord& cone = scene.add(kKindCone, 0.5, {0, 0, 0}, {kPi, 1});
        cone.param[1] = float(-std::tan(draft_deg * kPi / 180));
        RenderOptions options = seen_from({20, -30, 10}, SurfaceMap::Draft);
        expect_colors(scene.finish(), options, [&](const Vec3&) { return draft_deg; });
    }
}

TEST(map_legend, bands_have_their_colors_where_they_are_seen_straight_on)
{
    for (const SurfaceMap map : {SurfaceMap::Zebra, SurfaceMap::Isophotes})
        for (const double tilt_deg : {0.0, 5.0, 11.0, 17.0}) { // of the axis to the line of sight
            RenderOptions options = seen_from({0, -30, 0}, map);
            options.width = options.height = 101;
            const double tilt = tilt_deg * kPi / 180;
            options.look.map.direction = {std::sin(tilt), -std::cos(tilt), 0};
            const auto scene = ball_of_7();
            const Frame frame = draw(scene, options).frame;
            const size_t middle = 50 * 101 + 50;
            const Srgb seen = srgb_of(double(frame.rgba[4 * middle]), double(frame.rgba[4 * middle + 1]),
                                      double(frame.rgba[4 * middle + 2]));
            const Srgb of_value = map_color_srgb(scene->pack.image, options.look.map, tilt_deg);
            EXPECT_LE(largest_difference(seen, of_value), 1) << surface_map_name(map) << ", " << tilt_deg;
        }
}

bool same(const Srgb& color, uint32_t rgb)
{
    return largest_difference(color, {uint8_t(rgb >> 16), uint8_t(rgb >> 8), uint8_t(rgb), 255}) <= 1;
}

const LegendStop& stop_at(const MapLegend& legend, double position)
{
    return *std::find_if(legend.stops.begin(), legend.stops.end(),
                         [&](const LegendStop& stop) { return std::abs(stop.position - position) < 1e-9; });
}

TEST(map_legend, curvatures_run_from_blue_over_white_to_red_over_their_range)
{
    const auto scene = ball_of_7();
    SurfaceMapLook look;
    look.map = SurfaceMap::CurvatureMean;
    const MapLegend of_size = map_legend(scene->pack.image, look);
    const PackImage& image = scene->pack.image;
    double square = 0; // of the bounds' diagonal
    for (size_t c = 0; c < 3; ++c)
        square += std::pow(image.bounds_hi_mm[c] - image.bounds_lo_mm[c], 2);
    const double end = kCurvatureRange / std::sqrt(square);
    const uint32_t colors[] = {0x0571b0, 0x92c5de, 0xf7f7f7, 0xf4a582, 0xca0020}; // ColorBrewer RdBu
    for (size_t i = 0; i < 5; ++i) {
        const LegendStop& stop = stop_at(of_size, 0.25 * double(i));
        EXPECT_NEAR(stop.value, end * (0.5 * double(i) - 1), 1e-12);
        EXPECT_TRUE(same(stop.srgb, colors[i])) << i;
    }
    EXPECT_EQ(of_size.unit, "1/mm");
    EXPECT_TRUE(of_size.lit);
    EXPECT_FALSE(of_size.note.empty());
    ASSERT_EQ(of_size.ticks.size(), 5u);
    EXPECT_EQ(of_size.ticks[2].text, "0");
    EXPECT_NEAR(std::stod(of_size.ticks[4].text), end, 1e-3 * end);

    look.map = SurfaceMap::CurvatureGaussian;
    look.range = std::array<double, 2>{-1, 3};
    const MapLegend asked = map_legend(scene->pack.image, look);
    EXPECT_EQ(asked.unit, "1/mm²");
    EXPECT_TRUE(asked.note.empty());
    EXPECT_EQ(asked.stops.front().value, -1);
    EXPECT_EQ(asked.stops.back().value, 3);
    EXPECT_TRUE(same(stop_at(asked, 0.5).srgb, 0xf7f7f7));
    EXPECT_EQ(asked.ticks[1].text, "0");
    EXPECT_EQ(asked.ticks[4].text, "3");
}

TEST(map_legend, stops_ascend_and_have_the_colors_of_their_values)
{
    const auto scene = ball_of_7();
    for (const SurfaceMap map : {SurfaceMap::Zebra, SurfaceMap::Isophotes, SurfaceMap::CurvatureGaussian,
                                 SurfaceMap::CurvatureMin, SurfaceMap::Draft}) {
        SurfaceMapLook look;
        look.map = map;
        look.stripes = 4; // a light band is from 337.5 to 22.5 degrees of 45
        const MapLegend legend = map_legend(scene->pack.image, look);
        ASSERT_GE(legend.stops.size(), 2u);
        EXPECT_EQ(legend.stops.front().position, 0);
        EXPECT_EQ(legend.stops.back().position, 1);
        EXPECT_FALSE(legend.title.empty());
        for (size_t i = 1; i < legend.stops.size(); ++i) {
            const LegendStop &a = legend.stops[i - 1], &b = legend.stops[i];
            EXPECT_LE(a.position, b.position);
            EXPECT_LE(a.value, b.value);
            if (b.position == a.position) // a jump
                continue;
            const double middle = 0.5 * (a.value + b.value);
            const Srgb of_value = map_color_srgb(scene->pack.image, look, middle);
            for (size_t c = 0; c < 4; ++c) // between its neighbours, however they are blended
                EXPECT_TRUE(of_value[c] + 1 >= std::min(a.srgb[c], b.srgb[c]) &&
                            of_value[c] <= std::max(a.srgb[c], b.srgb[c]) + 1)
                    << surface_map_name(map) << " at " << middle;
        }
    }
}

TEST(map_legend, drafts_are_green_yellow_and_vermilion)
{
    SurfaceMapLook look;
    look.map = SurfaceMap::Draft;
    const MapLegend legend = map_legend(ball_of_7()->pack.image, look);
    ASSERT_EQ(legend.stops.size(), 6u);
    EXPECT_TRUE(same(legend.stops[0].srgb, 0xd55e00));
    EXPECT_TRUE(same(legend.stops[2].srgb, 0xf0e442));
    EXPECT_TRUE(same(legend.stops[5].srgb, 0x009e73));
    EXPECT_EQ(legend.stops[2].value, -3);
    EXPECT_EQ(legend.stops[3].value, 3);
    ASSERT_EQ(legend.names.size(), 3u);
    EXPECT_EQ(legend.names[0].text, "undercut");
    look.draft_deg = 0;
    EXPECT_EQ(map_legend(ball_of_7()->pack.image, look).stops.size(), 4u);
}

} // namespace
} // namespace trimray
