// Hard case 8: a part far from the origin, where numbers of single precision have no digits left for it.
#include "tests/occt_solids.h"
#include "tests/traced_file.h"

#include <array>

namespace trimray::hard {
namespace {

constexpr double kSize_mm = 100;

RenderOptions options_at(const std::array<double, 3>& shift_mm, bool vulkan)
{
    RenderOptions options;
    options.width = options.height = vulkan ? 48 : 96;
    options.camera = {{90, -140, 125}, {6, 2, 18}, {0, 0, 1}, 24};
    for (size_t i = 0; i < 3; ++i) {
        options.camera.eye[i] += shift_mm[i];
        options.camera.target[i] += shift_mm[i];
    }
    return options;
}

struct Place {
    const char* file; // its name's ending
    const char* unit; // of a STEP file
    double sizes;     // from the origin, in sizes of the part
    bool placed;      // by an instance's transform; else by its own coordinates
};
constexpr Place kPlaces[] = {{"brep", "MM", 1e3, false}, {"brep", "MM", 1e6, false}, {"brep", "MM", 1e8, false},
                             {"brep", "MM", 1e8, true},  {"step", "MM", 0, false},   {"step", "M", 0, false},
                             {"step", "INCH", 0, false}, {"step", "M", 1e6, true}};

class FarFromOrigin8 : public testing::TestWithParam<oracle::Solid> {};

TEST_P(FarFromOrigin8, ThePartLooksAsItDoesAtTheOriginInMillimetresMetresAndInches)
{
    const auto scene_at = [](const Place& place, oracle::Layout& layout) {
        layout.unit = place.unit;
        layout.placed = place.placed;
        const std::array<double, 3> along{0.64, -0.48, 0.6};
        for (size_t i = 0; i < 3; ++i)
            layout.shift_mm[i] = place.sizes * kSize_mm * along[i];
        const TemporaryFile file(std::string("far.") + place.file);
        EXPECT_TRUE(oracle::write_laid_out(GetParam(), layout, file.path));
        return scene_of_file(file.path);
    };
    oracle::Layout origin;
    const auto here = scene_at({"brep", "MM", 0, false}, origin);
    ASSERT_TRUE(here);
    std::array<Frame, 2> at_origin;
    for (const bool vulkan : {false, true})
        at_origin[vulkan] = right_picture(here, options_at(origin.shift_mm, vulkan), vulkan, "at the origin");
    for (const Place& place : kPlaces) {
        const std::string name = fmt::format("{} in {}, {:g} sizes away{}", place.file, place.unit, place.sizes,
                                             place.placed ? " by its placement" : "");
        oracle::Layout layout;
        const auto there = scene_at(place, layout);
        ASSERT_TRUE(there) << name;
        EXPECT_EQ(there->pack.image.provenance.source_unit, place.unit) << name;
        for (const bool vulkan : {false, true}) {
            const RenderOptions options = options_at(layout.shift_mm, vulkan);
            expect_same(at_origin[vulkan], right_picture(there, options, vulkan, name), options, name);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(case_08, FarFromOrigin8, testing::Values(oracle::Solid::DrilledCylinder, oracle::Solid::Loft),
                         [](const testing::TestParamInfo<oracle::Solid>& info) {
                             return std::string(info.param == oracle::Solid::Loft ? "splines" : "trimmed_cylinders");
                         });

} // namespace
} // namespace trimray::hard
