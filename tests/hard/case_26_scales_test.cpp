// Hard case 26: parts from 1e-6 to 1e9 mm in size.
#include "tests/occt_solids.h"
#include "tests/traced_file.h"

#include <array>

namespace trimray::hard {
namespace {

constexpr double kPlainSize_mm = 100; // of a solid at scale 1

struct Size {
    double mm;
    const char* unit; // of a STEP file; null: the kernel's reader takes points 1e-7 mm apart for one
    bool with_vulkan = false;
};
constexpr Size kSizes[] = {
    {1e-6, nullptr, true}, {1e-4, "UM"},     {1e-2, "MM"}, {1, "INCH"}, {1e2, "M"}, {1e4, "M"}, {1e6, "M"},
    {1e8, "KM"},           {1e9, "KM", true}};

RenderOptions options_at(double scale, bool vulkan)
{
    RenderOptions options;
    options.width = options.height = vulkan ? 32 : 64;
    options.camera = {{90, -140, 125}, {6, 2, 18}, {0, 0, 1}, 24};
    for (size_t i = 0; i < 3; ++i) {
        options.camera.eye[i] *= scale;
        options.camera.target[i] *= scale;
    }
    return options;
}

class Scales26 : public testing::TestWithParam<oracle::Solid> {};

TEST_P(Scales26, APartLooksTheSameInEverySize)
{
    std::array<Frame, 2> plain; // of the first size
    const auto see = [&plain](const Size& size, bool step) {
        const std::string name =
            fmt::format("{:g} mm, {}", size.mm, step ? std::string("STEP in ") + size.unit : "BREP");
        oracle::Layout layout;
        layout.scale = size.mm / kPlainSize_mm;
        layout.unit = step ? size.unit : layout.unit;
        const TemporaryFile file(step ? "scale.step" : "scale.brep");
        EXPECT_TRUE(oracle::write_laid_out(GetParam(), layout, file.path)) << name;
        const auto scene = scene_of_file(file.path);
        ASSERT_TRUE(scene) << name;
        EXPECT_EQ(scene->pack.image.provenance.source_unit, layout.unit) << name;
        for (size_t vulkan = 0; vulkan <= size_t(size.with_vulkan && !step); ++vulkan) {
            Frame frame = right_picture(scene, options_at(layout.scale, vulkan), vulkan, name);
            for (float& depth : frame.depth_mm)
                depth = float(double(depth) / layout.scale);
            if (plain[vulkan].face.empty())
                plain[vulkan] = frame;
            expect_same(plain[vulkan], frame, options_at(1, vulkan), name);
        }
    };
    see({kPlainSize_mm, nullptr, true}, false);
    for (const Size& size : kSizes) {
        see(size, false);
        if (size.unit)
            see(size, true);
    }
}

TEST_P(Scales26, StepFacesBelowTheKernelsResolutionAreConvertedOrNamed)
{
    oracle::Layout layout;
    layout.scale = 1e-6 / kPlainSize_mm;
    const TemporaryFile whole("whole.brep"), file("tiny.step");
    ASSERT_TRUE(oracle::write_laid_out(GetParam(), layout, whole.path));
    ASSERT_TRUE(oracle::write_laid_out(GetParam(), layout, file.path));
    const Result<CadModel> all = import_cad(whole.path, {}, {}), model = import_cad(file.path, {}, {});
    ASSERT_TRUE(all.ok() && model.ok());
    BuildReport report;
    const PackImage image = build_pack(*model, {}, report);
    EXPECT_EQ(report.faces, all->parts[0].faces.size());
    EXPECT_EQ(image.faces.size() + image.dropped.size(), report.faces);
    for (const DroppedFace& face : image.dropped)
        EXPECT_FALSE(image.strings.strings[face.reason].empty());
    std::cout << fmt::format("{} of {} faces converted\n", image.faces.size(), report.faces);
}

INSTANTIATE_TEST_SUITE_P(case_26, Scales26, testing::Values(oracle::Solid::DrilledCylinder, oracle::Solid::Loft),
                         [](const testing::TestParamInfo<oracle::Solid>& info) {
                             return std::string(info.param == oracle::Solid::Loft ? "splines" : "trimmed_cylinders");
                         });

} // namespace
} // namespace trimray::hard
