// Hard case 19: loops and slivers smaller than a texel of the distance texture.
#include "tests/hard/trim_modes.h"

#include <gtest/gtest.h>

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
    const double texel = texel_uv(trimmed_plane({kRim, shapes::circle(0.503, 0.511, 0.01, 0.01)}));
    for (const double radius_texels : {4.0, 2.0, 1.0, 0.5, 0.25, 0.1, 0.03, 0.01}) {
        const double radius = radius_texels * texel;
        const TrimmedPlane plane = trimmed_plane({kRim, shapes::circle(0.503, 0.511, radius, radius)});
        ASSERT_NEAR(texel_uv(plane), texel, 0.2 * texel);
        const PlaneView view{0.503, 0.511, 3 * radius, 100};
        const double pixel_texels = view.size / view.pixels / texel_uv(plane);
        const double hole = std::numbers::pi / 9 * view.pixels * view.pixels; // pixels
        const int tested = in_every_trim_mode(plane, {view}, [&](const TrimWay& way, size_t, const TrimErrors& errors) {
            const double pixels = view.pixels * view.pixels;
            EXPECT_NEAR(errors.inside, pixels - hole, 0.03 * hole);
            if (way.exact()) {
                // missed area 0: a pixel's centre is wrong only where rounding puts it across the border
                EXPECT_LE(errors.farthest_px, 0.01 + kRounding_uv / view.size * view.pixels)
                    << way.name << ", radius " << radius_texels << " texels";
            } else {
                // what is lost lies within the band of the border
                EXPECT_LE(errors.farthest_texels, plane.face().sdf_band_texels + pixel_texels)
                    << way.name << ", radius " << radius_texels << " texels";
                if (radius_texels >= 2) {
                    EXPECT_LE(errors.wrong, (radius_texels >= 4 ? 0.02 : 0.08) * hole)
                        << way.name << ", radius " << radius_texels << " texels";
                }
            }
        });
        EXPECT_GE(tested, 3);
    }
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
