// Hard case 23: faces on surfaces without an end.
#include "tests/occt_models.h"
#include "tests/traced_file.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <vector>

namespace trimray::hard {
namespace {

Result<CadModel> import(const std::string& path, bool native)
{
    ImportOptions options;
    options.native_surfaces = native;
    options.proxy_deflection = 0;
    return import_cad(path, options, {});
}

/// Every number of the pack that could be infinite.
void expect_finite(const PackImage& image)
{
    std::vector<double> numbers(image.control_points.begin(), image.control_points.end());
    const auto add = [&numbers](const auto& some) { numbers.insert(numbers.end(), std::begin(some), std::end(some)); };
    add(image.trim_points);
    add(image.bounds_lo_mm);
    add(image.bounds_hi_mm);
    add(std::array{image.world_scale_mm});
    for (const PartRecord& part : image.parts)
        add(std::array{part.origin_mm[0], part.origin_mm[1], part.origin_mm[2], part.scale_mm});
    for (const FaceRecord& face : image.faces) {
        add(face.domain_lo);
        add(face.domain_hi);
        add(face.extent_mm);
        add(std::array{double(face.area_mm2)});
    }
    for (const PatchRecord& patch : image.patches) {
        add(patch.origin_hi);
        add(patch.origin_lo);
        add(patch.uv_offset);
        add(patch.uv_scale);
        add(patch.param);
        add(std::array{double(patch.scale)});
    }
    for (const double number : numbers)
        ASSERT_TRUE(std::isfinite(number));
}

TEST(case_23, pieces_of_endless_surfaces_are_clipped_to_their_loops)
{
    const TemporaryFile file("pieces.brep");
    ASSERT_TRUE(oracle::write_pieces_of_endless_surfaces(file.path));
    for (const bool native : {true, false}) {
        const std::string name = native ? "native" : "as splines";
        const Result<CadModel> model = import(file.path, native);
        ASSERT_TRUE(model.ok()) << model.error().detail;
        EXPECT_TRUE(model->dropped.empty()) << name;
        const auto scene = scene_of_model(*model);
        ASSERT_TRUE(scene) << name;
        const PackImage& image = scene->pack.image;
        ASSERT_EQ(image.faces.size(), 6u) << name;
        expect_finite(image);
        const double lo[] = {-15, -15, 0}, hi[] = {115, 15, 20};
        for (size_t i = 0; i < 3; ++i) {
            EXPECT_GT(image.bounds_lo_mm[i], lo[i] - 1) << name;
            EXPECT_LT(image.bounds_hi_mm[i], hi[i] + 1) << name;
        }
        RenderOptions options;
        options.camera = {{40, 130, 100}, {50, 0, 9}, {0, 0, 1}, 16};
        for (const bool vulkan : {false, true}) {
            options.width = vulkan ? 60 : 150;
            options.height = options.width / 3;
            right_picture(scene, options, vulkan, name);
        }
    }
}

TEST(case_23, faces_without_an_end_are_named)
{
    const TemporaryFile file("endless.brep");
    ASSERT_TRUE(oracle::write_endless_faces(file.path));
    for (const bool native : {true, false}) {
        const Result<CadModel> model = import(file.path, native);
        ASSERT_TRUE(model.ok()) << model.error().detail;
        BuildReport report;
        const PackImage image = build_pack(*model, {}, report);
        EXPECT_EQ(image.faces.size(), 1u);
        EXPECT_EQ(image.dropped.size(), 5u);
        for (const DroppedFace& face : image.dropped) {
            EXPECT_GT(face.face_in_part, 0u);
            EXPECT_THAT(image.strings.strings[face.reason],
                        testing::AnyOf(testing::HasSubstr("it is infinite"), testing::HasSubstr("is not finite")));
        }
        expect_finite(image);
        EXPECT_TRUE(decode_pack(encode_pack(image, {}), {}).ok());
    }
}

} // namespace
} // namespace trimray::hard
