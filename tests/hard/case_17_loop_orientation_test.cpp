// Hard case 17: loops whose orientation is wrong or mixed, and nested loops. The fill rule is even-odd, which knows no
// orientation.
#include "tests/hard/trim_modes.h"

#include <gtest/gtest.h>

#include <vector>

namespace trimray::hard {
namespace {

constexpr double kRounding_px = 0.01; // a pixel centre this near to a piece is on either side by rounding

std::vector<shapes::Loop> nested_loops()
{
    return {shapes::polygon({{0.02f, 0.03f}, {0.97f, 0.02f}, {0.98f, 0.96f}, {0.03f, 0.98f}}),
            shapes::star(0.48, 0.52, 0.4, 0.3, 5, 0.3), shapes::circle(0.5, 0.5, 0.2, 0.22)};
}

TEST(case_17, all_orientations_of_nested_loops_give_one_picture_in_every_mode)
{
    // k nested loops, 2^k orientations; the first pictures and the first texture are those of the loops as they are
    std::vector<std::vector<uint8_t>> first;
    std::vector<uint> cells, texture;
    for (unsigned turned = 0; turned < 8; ++turned) {
        std::vector<shapes::Loop> loops = nested_loops();
        for (size_t i = 0; i < loops.size(); ++i)
            if ((turned >> i & 1) != 0)
                loops[i] = shapes::reversed(loops[i]);
        const TrimmedPlane plane = trimmed_plane(loops);
        std::vector<uint> classes = plane.scene->pack.image.cells;
        for (uint& word : classes)
            word &= 3u;
        if (turned == 0) {
            cells = classes;
            texture = plane.scene->pack.image.sdf_words;
        }
        EXPECT_EQ(classes, cells) << "orientations " << turned;
        EXPECT_EQ(plane.scene->pack.image.sdf_words, texture) << "orientations " << turned;
        std::vector<std::vector<uint8_t>> pictures;
        const int tested = in_every_trim_mode(plane, {{}}, [&](const TrimWay& way, size_t, const TrimErrors& errors) {
            EXPECT_GT(errors.inside, 5000);
            if (way.exact()) {
                EXPECT_LE(errors.farthest_px, kRounding_px) << way.name << ", orientations " << turned;
            }
            pictures.push_back(errors.picture);
        });
        EXPECT_GE(tested, 4); // the CPU tracer has every way
        if (turned == 0)
            first = pictures;
        EXPECT_EQ(pictures, first) << "orientations " << turned;
    }
}

} // namespace
} // namespace trimray::hard
