// Hard case 20: sharp corners, which a distance texture rounds.
#include "tests/hard/trim_modes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace trimray::hard {
namespace {

double border_length_uv(const TrimmedPlane& plane)
{
    double length = 0;
    for (const MonotonePiece& piece : plane.pieces) // lines
        length += std::hypot(piece.u[3] - piece.u[0], piece.v[3] - piece.v[0]);
    return length;
}

TEST(case_20, a_star_and_a_gear_keep_their_corners_where_pieces_are_asked_and_err_by_little_elsewhere)
{
    const std::pair<const char*, shapes::Loop> kShapes[] = {{"star", shapes::star(0.51, 0.49, 0.47, 0.18, 9, 0.1)},
                                                            {"gear", shapes::gear(0.5, 0.5, 0.48, 0.38, 24)}};
    for (const auto& [name, loop] : kShapes) {
        const TrimmedPlane plane = trimmed_plane({loop});
        const double texel = plane.face().sdf_texel_mm / kPlaneSide_mm, length = border_length_uv(plane);
        const PlaneView view{0.5, 0.5, 1.1, 400};
        const int tested = in_every_trim_mode(plane, {view}, [&](const TrimWay& way, size_t, const TrimErrors& errors) {
            // wrong area over the border's length: the mean distance between the drawn border and the true one
            const double pixel = view.size / view.pixels;
            const double error_px = errors.wrong * pixel / length;
            std::cout << name << ", " << way.name << ": border off by " << error_px << " px, "
                      << error_px * pixel / texel << " texels in the mean\n";
            EXPECT_GT(errors.inside, 20000);
            if (way.exact()) {
                EXPECT_LE(errors.farthest_px, 0.01) << name << ", " << way.name;
            } else {
                EXPECT_LE(errors.farthest_texels, plane.face().sdf_band_texels) << name << ", " << way.name;
                EXPECT_LE(error_px * pixel, 0.05 * texel) << name << ", " << way.name;
            }
        });
        EXPECT_GE(tested, 3);
    }
}

} // namespace
} // namespace trimray::hard
