// Edge classes on shapes whose edges one can count, as imported and as they come out in a pack.
#include "preprocess/build_pack.h"
#include "preprocess/import/cad_import.h"
#include "preprocess/trims/edge_class.h"
#include "tests/occt_models.h"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fmt/format.h>
#include <map>
#include <unistd.h>

namespace trimray {
namespace {

/// Edges of each class: sharp, smooth, seam, free. All uses of an edge must agree.
using Counts = std::array<int, kEdgeClassCount>;

Counts edges_by_class(const CadModel& model)
{
    Counts counts{};
    for (const CadPart& part : model.parts) {
        std::map<uint32_t, uint32_t> classes;
        for (const CadFace& face : part.faces)
            for (const CadLoop& loop : face.loops)
                for (const CadEdgeUse& use : loop)
                    EXPECT_EQ(classes.emplace(use.edge, use.edge_class).first->second, use.edge_class);
        for (const auto& [edge, edge_class] : classes)
            ++counts[edge_class];
    }
    return counts;
}

CadModel solid(const std::string& name, bool native = true, const char* extension = "brep")
{
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / fmt::format("trimray-edges-{}.{}", getpid(), extension);
    EXPECT_TRUE(oracle::write_solid(name, path)) << name;
    ImportOptions options;
    options.native_surfaces = native;
    Result<CadModel> model = import_cad(path, options, {});
    std::filesystem::remove(path);
    EXPECT_TRUE(model.ok()) << name;
    return model.ok() ? std::move(*model) : CadModel{};
}

TEST(edge_class, follows_the_angle_between_faces_and_their_number)
{
    const std::map<std::string, Counts> expected{
        // sharp, smooth, seam (with poles: of spheres at round corners, too), free
        {"box", {12, 0, 0, 0}},         {"rounded box", {0, 48, 8, 0}},
        {"cylinder", {2, 0, 1, 0}},     {"cone", {1, 0, 2, 0}},
        {"sphere", {0, 0, 3, 0}},       {"tube", {0, 0, 1, 2}},
        {"creased tube", {1, 0, 0, 2}}, {"half tubes", {0, 2, 0, 4}},
        {"three sheets", {1, 0, 0, 9}}, {"touching boxes", {24, 0, 0, 0}},
    };
    for (const bool native : {true, false})
        for (const auto& [name, counts] : expected)
            EXPECT_EQ(edges_by_class(solid(name, native)), counts) << name << (native ? "" : " as splines");
}

TEST(edge_class, edges_of_loose_faces_that_lie_on_one_another_count_as_one)
{
    // as the edges of a file whose faces share none: each twice, but for poles and what ends a face
    const std::map<std::string, Counts> expected{
        {"box", {24, 0, 0, 0}}, {"rounded box", {0, 96, 8, 0}}, {"cylinder", {4, 0, 2, 0}},
        {"tube", {0, 0, 2, 2}}, {"half tubes", {0, 4, 0, 4}},   {"three sheets", {3, 0, 0, 9}},
    };
    for (const auto& [name, counts] : expected)
        EXPECT_EQ(edges_by_class(solid(name, true, "igs")), counts) << name;
}

TEST(edge_class, a_crease_of_two_degrees_is_sharp_and_one_of_half_a_degree_smooth)
{
    for (const auto& [degrees, expected] : {std::pair(2.0, kEdgeSharp), std::pair(0.5, kEdgeSmooth)}) {
        // two squares at y = 0, the second tilted
        const double tilt = degrees * M_PI / 180;
        CadPart part;
        part.edges.resize(1);
        part.edges[0].smooth = expected == kEdgeSharp; // what a file says does not count where it can be measured
        for (const bool second : {false, true}) {
            CadFace face;
            face.surface.kind = kKindPlane;
            if (second) {
                face.surface.frame.y = {0, std::cos(tilt), std::sin(tilt)};
                face.surface.frame.z = {0, -std::sin(tilt), std::cos(tilt)};
            }
            CadEdgeUse use; // along x: the first face lies at y < 0, on the right of x
            use.pcurve = {1, false, {0, 0, 1, 1}, {{0, 0, 1}, {1, 0, 1}}};
            use.last = 1;
            use.reversed = !second;
            face.loops.push_back({use});
            part.faces.push_back(face);
        }
        classify_edges(part, 2);
        for (const CadFace& face : part.faces)
            EXPECT_EQ(face.loops[0][0].edge_class, expected) << degrees;
        // folded back onto each other: no less than 179 degrees
        part.faces[1].loops[0][0].reversed = true;
        classify_edges(part, 2);
        EXPECT_EQ(part.faces[0].loops[0][0].edge_class, kEdgeSharp) << degrees;
    }
}

/// Sides of natural borders and pieces of trimmed faces, by class.
void count_in_pack(const PackImage& image, Counts& sides, Counts& pieces)
{
    for (const FaceRecord& face : image.faces) {
        if ((face.flags & kFaceNaturalBorder) != 0)
            for (uint side = 0; side < 4; ++side)
                ++sides[face.border_classes >> 2 * side & 3];
        else
            EXPECT_EQ(face.border_classes, 0u);
    }
    for (const uint word : image.trim_pieces)
        ++pieces[word >> kPieceClassShift & (kEdgeClassCount - 1)];
}

TEST(edge_class, reaches_the_pieces_and_the_borders_of_a_pack)
{
    const auto counts = [](const std::string& name) {
        BuildReport report;
        std::pair<Counts, Counts> found{};
        count_in_pack(build_pack(solid(name), {}, report), found.first, found.second);
        return found;
    };
    // a cylinder: the side's seam at u = 0 and 1, its circles at v = 0 and 1; the discs' pieces are all sharp
    const auto [cylinder_sides, cylinder_pieces] = counts("cylinder");
    EXPECT_EQ(cylinder_sides, (Counts{2, 0, 2, 0}));
    EXPECT_GT(cylinder_pieces[kEdgeSharp], 8);
    EXPECT_EQ(cylinder_pieces[kEdgeSmooth] + cylinder_pieces[kEdgeSeam] + cylinder_pieces[kEdgeFree], 0);
    const auto [box_sides, box_pieces] = counts("box");
    EXPECT_EQ(box_sides, (Counts{24, 0, 0, 0}));
    // poles and seam
    EXPECT_EQ(counts("sphere").first, (Counts{0, 0, 4, 0}));
    EXPECT_EQ(counts("cone").first, (Counts{1, 0, 3, 0}));
}

} // namespace
} // namespace trimray
