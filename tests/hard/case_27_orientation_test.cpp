// Hard case 27: faces and solids that are oriented the wrong way round.
#include "tests/occt_solids.h"
#include "tests/traced_file.h"

#include <gmock/gmock.h>

#include <array>
#include <tuple>

namespace trimray::hard {
namespace {

using oracle::Flip;

CadModel model_of(oracle::Solid solid, Flip flip)
{
    const TemporaryFile file("flipped.brep");
    EXPECT_TRUE(oracle::write_flipped(solid, flip, file.path));
    ImportOptions options;
    options.proxy_deflection = 0;
    Result<CadModel> model = import_cad(file.path, options, {});
    EXPECT_TRUE(model.ok());
    return model.ok() ? std::move(*model) : CadModel{};
}

/// The frame with the normals of faces turned that are not oriented as in `other`.
Frame oriented_as(Frame frame, const PackImage& image, const PackImage& other)
{
    for (size_t i = 0; i < frame.face.size(); ++i) {
        if (frame.face[i] < 0)
            continue;
        const auto face = size_t(frame.face[i]);
        if (((image.faces[face].flags ^ other.faces[face].flags) & kFaceReversed) != 0)
            for (size_t c = 0; c < 3; ++c)
                frame.normal[3 * i + c] = -frame.normal[3 * i + c];
    }
    return frame;
}

class Orientation27 : public testing::TestWithParam<oracle::Solid> {};

TEST_P(Orientation27, AFlippedSolidLooksTheSame)
{
    const auto plain = scene_of_model(model_of(GetParam(), Flip::None));
    ASSERT_TRUE(plain);
    const PackImage& image = plain->pack.image;
    RenderOptions options;
    options.camera = {{90, -140, 125}, {6, 2, 18}, {0, 0, 1}, 24};
    std::array<Frame, 2> frames;
    for (const auto& [flip, name, turned] : {std::tuple(Flip::None, "as it is", size_t(0)),
                                             {Flip::OneFace, "one face", size_t(1)},
                                             {Flip::Faces, "all faces", image.faces.size()},
                                             {Flip::Solid, "the solid", image.faces.size()}}) {
        const auto scene = scene_of_model(model_of(GetParam(), flip));
        ASSERT_TRUE(scene) << name;
        const PackImage& flipped = scene->pack.image;
        ASSERT_EQ(flipped.faces.size(), image.faces.size()) << name;
        size_t reversed = 0;
        for (size_t f = 0; f < image.faces.size(); ++f)
            reversed += ((image.faces[f].flags ^ flipped.faces[f].flags) & kFaceReversed) != 0;
        EXPECT_EQ(reversed, turned) << name;
        for (const bool vulkan : {false, true}) {
            options.width = options.height = vulkan ? 64 : 128;
            const Frame frame =
                oriented_as(right_picture(scene, options, vulkan, std::string("flipped: ") + name), flipped, image);
            if (flip == Flip::None)
                frames[vulkan] = frame;
            expect_same(frames[vulkan], frame, options, name);
        }
    }
}

TEST_P(Orientation27, WhatIsTurnedRoundIsReported)
{
    const auto warnings = [](Flip flip) {
        BuildReport report;
        build_pack(model_of(GetParam(), flip), {}, report);
        return report.warnings;
    };
    using testing::ElementsAre, testing::HasSubstr;
    EXPECT_THAT(warnings(Flip::None), testing::IsEmpty());
    EXPECT_THAT(warnings(Flip::OneFace), ElementsAre(HasSubstr("one face points inwards and its neighbour outwards")));
    EXPECT_THAT(warnings(Flip::Faces), ElementsAre(HasSubstr("is inside out")));
    EXPECT_THAT(warnings(Flip::Solid), ElementsAre(HasSubstr("is inside out")));
}

INSTANTIATE_TEST_SUITE_P(case_27, Orientation27, testing::Values(oracle::Solid::Box, oracle::Solid::DrilledCylinder),
                         [](const testing::TestParamInfo<oracle::Solid>& info) {
                             return std::string(info.param == oracle::Solid::Box ? "cube" : "trimmed_cylinders");
                         });

} // namespace
} // namespace trimray::hard
