// Which faces bound closed shells, on solids whole, open, and turned inside out, as they come out in a pack.
#include "preprocess/build_pack.h"
#include "preprocess/import/cad_import.h"
#include "tests/occt_solids.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <unistd.h>

namespace trimray {
namespace {

CadModel model_of(oracle::Solid solid)
{
    const auto path = std::filesystem::temp_directory_path() / fmt::format("trimray-shells-{}.brep", getpid());
    EXPECT_TRUE(oracle::write_closed_solid(solid, path.string()));
    ImportOptions options;
    options.proxy_deflection = 0;
    Result<CadModel> model = import_cad(path.string(), options, {});
    std::filesystem::remove(path);
    EXPECT_TRUE(model.ok());
    return model.ok() ? std::move(*model) : CadModel{};
}

size_t faces_with_rims(const CadModel& model, const BuildOptions& options = {})
{
    BuildReport report;
    const PackImage image = build_pack(model, options, report);
    return std::count_if(image.faces.begin(), image.faces.end(),
                         [](const FaceRecord& face) { return (face.flags & kFaceRims) != 0; });
}

class closed_shell : public testing::TestWithParam<oracle::Solid> {};

TEST_P(closed_shell, is_found_where_every_edge_is_walked_once_each_way_and_normals_are_outwards)
{
    const CadModel solid = model_of(GetParam());
    ASSERT_EQ(solid.parts.size(), 1u);
    const size_t count = solid.parts[0].faces.size();
    EXPECT_EQ(faces_with_rims(solid), count);

    BuildOptions not_grown;
    not_grown.trims.grow = false;
    EXPECT_EQ(faces_with_rims(solid, not_grown), 0u);

    CadModel open = solid;
    open.parts[0].faces.pop_back();
    EXPECT_EQ(faces_with_rims(open), 0u);

    CadModel inside_out = solid;
    for (CadFace& face : inside_out.parts[0].faces)
        face.reversed = !face.reversed;
    EXPECT_EQ(faces_with_rims(inside_out), 0u);

    if (count > 1) {
        CadModel one_turned = solid;
        one_turned.parts[0].faces[0].reversed = !one_turned.parts[0].faces[0].reversed;
        EXPECT_EQ(faces_with_rims(one_turned), 0u);
    }
}

INSTANTIATE_TEST_SUITE_P(solids, closed_shell, testing::ValuesIn(oracle::kSolids),
                         [](const testing::TestParamInfo<oracle::Solid>& info) {
                             std::string name = oracle::solid_name(info.param);
                             std::replace(name.begin(), name.end(), ' ', '_');
                             return name;
                         });

} // namespace
} // namespace trimray
