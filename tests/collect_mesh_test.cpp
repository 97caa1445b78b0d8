// Meshes of CAD files: on the surfaces and with their normals, and with the faces, placements and colours of the pack.
#include "preprocess/build_pack.h"
#include "preprocess/collect_mesh.h"
#include "preprocess/import/cad_import.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>

namespace trimray {
namespace {

struct Meshed {
    TriangleMesh mesh;
    PackImage pack;
    CadSurface surface; // of the first face
};

Meshed meshed(const std::string& model_name, double deflection)
{
    ImportOptions options;
    options.mesh_deflection = deflection;
    const Result<CadModel> model = import_cad(TRIMRAY_TESTS_DIR "/models/" + model_name, options, {});
    if (!model.ok()) {
        ADD_FAILURE() << model.error().detail;
        return {};
    }
    BuildReport report;
    Result<TriangleMesh> mesh = collect_mesh(*model, convert_faces(*model, {}, report));
    if (!mesh.ok()) {
        ADD_FAILURE() << mesh.error().detail;
        return {};
    }
    EXPECT_TRUE(decode_mesh(encode_mesh(*mesh)).ok());
    return {std::move(*mesh), build_pack(*model, {}, report), model->parts.at(0).faces.at(0).surface};
}

using Point = std::array<double, 3>;

Point vertex(const TriangleMesh& mesh, uint32_t part, size_t v)
{
    Point p;
    for (size_t c = 0; c < 3; ++c)
        p[c] = mesh.parts[part].origin_mm[c] + double(mesh.positions[3 * v + c]);
    return p;
}

TEST(collect_mesh, vertices_lie_on_the_sphere_with_its_normals)
{
    for (const double deflection : {1e-2, 1e-3, 1e-4}) {
        const Meshed m = meshed("unit_sphere.stp", deflection);
        ASSERT_EQ(m.mesh.parts.size(), 1u);
        ASSERT_EQ(m.mesh.faces.size(), 8u);
        EXPECT_TRUE(faces_without_triangles(m.mesh).empty());
        const Point middle{m.surface.frame.origin.x, m.surface.frame.origin.y, m.surface.frame.origin.z};
        const double radius = m.surface.radius;
        double off_surface = 0, off_normal = 0, off_chord = 0;
        for (size_t v = 0; v < m.mesh.positions.size() / 3; ++v) {
            const Point p = vertex(m.mesh, 0, v);
            off_surface = std::max(off_surface,
                                   std::abs(std::hypot(p[0] - middle[0], p[1] - middle[1], p[2] - middle[2]) - radius));
            for (size_t c = 0; c < 3; ++c)
                off_normal =
                    std::max(off_normal, std::abs(double(m.mesh.normals[3 * v + c]) - (p[c] - middle[c]) / radius));
        }
        for (size_t t = 0; t < m.mesh.triangle_face.size(); ++t) {
            Point centre{};
            for (size_t k = 0; k < 3; ++k)
                for (size_t c = 0; c < 3; ++c)
                    centre[c] += vertex(m.mesh, 0, m.mesh.triangles[3 * t + k])[c] / 3;
            off_chord = std::max(
                off_chord, radius - std::hypot(centre[0] - middle[0], centre[1] - middle[1], centre[2] - middle[2]));
        }
        EXPECT_LE(off_surface, 1e-6 * radius); // single precision, and the file's own tolerance
        EXPECT_LE(off_normal, 2e-6);
        EXPECT_LE(off_chord, 1.5 * m.mesh.deflection_mm) << deflection;
        EXPECT_GT(off_chord, 0);
    }
}

TEST(collect_mesh, has_the_packs_placements_and_colours)
{
    for (const char* model : {"red_cube_blue_cylinder.step", "io1-cm-214.stp"}) {
        const Meshed m = meshed(model, 1e-2);
        ASSERT_EQ(m.mesh.instances.size(), m.pack.instances.size());
        for (size_t i = 0; i < m.mesh.instances.size(); ++i) {
            EXPECT_TRUE(std::ranges::equal(m.mesh.instances[i].transform, m.pack.instances[i].transform));
            EXPECT_EQ(m.mesh.instances[i].part, m.pack.instances[i].part);
            EXPECT_EQ(m.mesh.instances[i].color_rgba, m.pack.instances[i].color_rgba);
        }
        ASSERT_EQ(m.mesh.faces.size(), m.pack.faces.size());
        for (size_t f = 0; f < m.mesh.faces.size(); ++f) {
            EXPECT_EQ(m.mesh.faces[f].has_color != 0, (m.pack.faces[f].flags & kFaceHasColor) != 0);
            EXPECT_EQ(m.mesh.faces[f].color_rgba, m.pack.faces[f].color_rgba);
        }
        ASSERT_EQ(m.mesh.parts.size(), m.pack.parts.size());
        for (size_t p = 0; p < m.mesh.parts.size(); ++p) {
            const MeshPart& part = m.mesh.parts[p];
            const PartRecord& record = m.pack.parts[p];
            std::set<uint32_t> faces(m.mesh.triangle_face.begin() + part.first_triangle,
                                     m.mesh.triangle_face.begin() + part.first_triangle + part.triangle_count);
            ASSERT_EQ(faces.size(), record.face_count);
            EXPECT_EQ(*faces.begin(), record.first_face);
            EXPECT_EQ(*faces.rbegin(), record.first_face + record.face_count - 1);
        }
    }
}

TEST(collect_mesh, numbers_faces_past_those_that_were_dropped)
{
    CadModel model;
    model.parts.resize(1);
    model.parts[0].faces.resize(3);
    model.parts[0].mesh.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    model.parts[0].mesh.normals = {0, 0, 1, 0, 0, 1, 0, 0, 1};
    model.parts[0].mesh.triangles = {0, 1, 2, 0, 2, 1, 1, 2, 0};
    model.parts[0].mesh.triangle_face = {0, 1, 2};
    ConvertedFaces converted;
    converted.face_ids = {{0, kNotConverted, 1}};
    converted.image.faces.resize(3);
    const Result<TriangleMesh> mesh = collect_mesh(model, converted);
    ASSERT_TRUE(mesh.ok());
    EXPECT_EQ(mesh->triangle_face, (std::vector<uint32_t>{0, 1}));
    EXPECT_EQ(mesh->triangles, (std::vector<uint32_t>{0, 1, 2, 1, 2, 0}));
    EXPECT_EQ(faces_without_triangles(*mesh), std::vector<uint>{2});
}

} // namespace
} // namespace trimray
