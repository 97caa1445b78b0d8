// Hard case 19: loops and slivers smaller than a texel of the distance texture.
#include "tests/hard/trim_modes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace trimray::hard {
namespace {

const shapes::Loop kRim = shapes::polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
// of uv_face, where a tracer's rays meet the plane: a few roundings of a number near 1/2
constexpr double kRounding_uv = 3e-7;

double texel_uv(const TrimmedPlane& plane)
{
    return plane.face().sdf_texel_mm / kPlaneSide_mm;
}

TEST(case_19, holes_from_4_texels_to_a_hundredth_are_whole_where_pieces_are_asked)
{
    constexpr std::array<double, 8> kRadii{4, 2, 1, 0.5, 0.25, 0.1, 0.03, 0.01}; // texels
    // all in one plane, so that each way to answer trims is made ready once; the texture's size does not depend on them
    const auto centre = [](size_t i) { return std::array{0.203 + 0.3 * double(i % 3), 0.211 + 0.3 * double(i / 3)}; };
    const double texel = texel_uv(trimmed_plane({kRim, shapes::circle(0.503, 0.511, 0.01, 0.01)}));
    std::vector<shapes::Loop> loops{kRim};
    std::vector<PlaneView> views;
    for (size_t i = 0; i < kRadii.size(); ++i) {
        const double radius = kRadii[i] * texel;
        const auto [u, v] = centre(i);
        loops.push_back(shapes::circle(u, v, radius, radius));
        views.push_back({u, v, 3 * radius, 100});
    }
    const TrimmedPlane plane = trimmed_plane(loops);
    ASSERT_NEAR(texel_uv(plane), texel, 0.2 * texel);
    const int tested = in_every_trim_mode(plane, views, [&](const TrimWay& way, size_t i, const TrimErrors& errors) {
        const PlaneView& view = views[i];
        const double pixels = view.pixels * view.pixels, hole = std::numbers::pi / 9 * pixels;
        const double pixel_texels = view.size / view.pixels / texel_uv(plane);
        EXPECT_NEAR(errors.inside, pixels - hole, 0.03 * hole);
        if (way.exact()) {
            // missed area 0: a pixel's centre is wrong only where rounding puts it across the border
            EXPECT_LE(errors.farthest_px, 0.01 + kRounding_uv / view.size * view.pixels)
                << way.name << ", radius " << kRadii[i] << " texels";
        } else {
            // what is lost lies within the band of the border
            EXPECT_LE(errors.farthest_texels, plane.face().sdf_band_texels + pixel_texels)
                << way.name << ", radius " << kRadii[i] << " texels";
            if (kRadii[i] >= 2) {
                EXPECT_LE(errors.wrong, (kRadii[i] >= 4 ? 0.02 : 0.08) * hole)
                    << way.name << ", radius " << kRadii[i] << " texels";
            }
        }
    });
    EXPECT_GE(tested, 3);
}

TEST(case_19, slivers_below_a_texel_are_whole_where_pieces_are_asked)
{
    const TrimmedPlane plane =
        trimmed_plane({kRim, shapes::polygon({{0.1f, 0.3f}, {0.9f, 0.31f}, {0.9f, 0.3101f}}),
                       shapes::polygon({{0.2f, 0.5f}, {0.8f, 0.5f}, {0.8f, 0.5005f}, {0.2f, 0.5005f}})});
    const std::vector<PlaneView> views{{}, {0.9, 0.31, 0.001, 100}, {0.2, 0.5, 0.002, 100}};
    const int tested = in_every_trim_mode(plane, views, [&](const TrimWay& way, size_t i, const TrimErrors& errors) {
        if (way.exact()) {
            EXPECT_LE(errors.farthest_px, 0.01 + kRounding_uv / views[i].size * views[i].pixels) << way.name;
        } else {
            EXPECT_LE(errors.farthest_texels, plane.face().sdf_band_texels) << way.name;
        }
    });
    EXPECT_GE(tested, 3);
}

} // namespace
} // namespace trimray::hard
