#include "preprocess/bezier_patch.h"
#include "preprocess/import/cad_import.h"
#include "preprocess/trims/trim_curve.h"
#include "preprocess/vec3d.h"
#include "tests/occt_models.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <iterator>
#include <map>
#include <set>
#include <unistd.h>

namespace {
using namespace trimray;
using testing::HasSubstr;

std::string model_path(const std::string& name)
{
    return std::string(TRIMRAY_TESTS_DIR) + "/models/" + name;
}

/// A folder of this test process that goes away with it.
std::string scratch(const std::string& name)
{
    struct Folder {
        std::filesystem::path path =
            std::filesystem::temp_directory_path() / fmt::format("trimray-import-test-{}", getpid());
        Folder() { std::filesystem::create_directories(path); }
        ~Folder() { std::filesystem::remove_all(path); }
    };
    static const Folder folder;
    return (folder.path / name).string();
}

Result<CadModel> import(const std::string& path, bool native = true)
{
    ImportOptions options;
    options.native_surfaces = native;
    return import_cad(path, options, {});
}

CadModel model_of(const std::string& path, bool native = true)
{
    Result<CadModel> model = import(path, native);
    if (!model) {
        ADD_FAILURE() << path << ": " << model.error().detail;
        return {};
    }
    return std::move(model).value();
}

std::string write(const std::string& name, const std::string& text)
{
    const std::string path = scratch(name);
    std::ofstream(path, std::ios::binary) << text;
    return path;
}

std::string read(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// A STEP file with one square face of the given side, in the given unit.
std::string square_step(const std::string& product, const std::string& unit, double side)
{
    const std::string s = fmt::format("{:.9f}", side);
    return "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
           "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));\nENDSEC;\nDATA;\n"
           "#1=APPLICATION_CONTEXT('');\n#2=PRODUCT_CONTEXT('',#1,'mechanical');\n#3=PRODUCT('" +
           product + "','" + product +
           "','',(#2));\n"
           "#4=PRODUCT_DEFINITION_FORMATION('','',#3);\n#5=PRODUCT_DEFINITION_CONTEXT('part definition',#1,'design');\n"
           "#6=PRODUCT_DEFINITION('design','',#4,#5);\n#7=PRODUCT_DEFINITION_SHAPE('','',#6);\n"
           "#8=SHAPE_DEFINITION_REPRESENTATION(#7,#9);\n#9=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#20,#10),#11);\n"
           "#10=AXIS2_PLACEMENT_3D('',#30,#31,#32);\n"
           "#11=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#15))"
           "GLOBAL_UNIT_ASSIGNED_CONTEXT((#12,#13,#14))REPRESENTATION_CONTEXT('',''));\n" +
           unit +
           "#13=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\n"
           "#14=(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT());\n"
           "#15=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-07),#12,'','');\n"
           "#20=SHELL_BASED_SURFACE_MODEL('',(#21));\n#21=OPEN_SHELL('',(#22));\n"
           "#22=ADVANCED_FACE('',(#23),#24,.T.);\n#23=FACE_BOUND('',#25,.T.);\n#24=PLANE('',#10);\n"
           "#25=EDGE_LOOP('',(#61,#62,#63,#64));\n#30=CARTESIAN_POINT('',(0.,0.,0.));\n#31=DIRECTION('',(0.,0.,1.));\n"
           "#32=DIRECTION('',(1.,0.,0.));\n#33=DIRECTION('',(0.,1.,0.));\n#34=DIRECTION('',(-1.,0.,0.));\n"
           "#35=DIRECTION('',(0.,-1.,0.));\n#41=CARTESIAN_POINT('',(" +
           s + ",0.,0.));\n#42=CARTESIAN_POINT('',(" + s + "," + s + ",0.));\n#43=CARTESIAN_POINT('',(0.," + s +
           ",0.));\n#50=VERTEX_POINT('',#30);\n#51=VERTEX_POINT('',#41);\n#52=VERTEX_POINT('',#42);\n"
           "#53=VERTEX_POINT('',#43);\n#54=VECTOR('',#32,1.);\n#55=VECTOR('',#33,1.);\n#56=VECTOR('',#34,1.);\n"
           "#57=VECTOR('',#35,1.);\n#71=LINE('',#30,#54);\n#72=LINE('',#41,#55);\n#73=LINE('',#42,#56);\n"
           "#74=LINE('',#43,#57);\n#81=EDGE_CURVE('',#50,#51,#71,.T.);\n#82=EDGE_CURVE('',#51,#52,#72,.T.);\n"
           "#83=EDGE_CURVE('',#52,#53,#73,.T.);\n#84=EDGE_CURVE('',#53,#50,#74,.T.);\n"
           "#61=ORIENTED_EDGE('',*,*,#81,.T.);\n#62=ORIENTED_EDGE('',*,*,#82,.T.);\n"
           "#63=ORIENTED_EDGE('',*,*,#83,.T.);\n#64=ORIENTED_EDGE('',*,*,#84,.T.);\nENDSEC;\nEND-ISO-10303-21;\n";
}

const std::string kMillimetre = "#12=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n";
const std::string kMetre = "#12=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.));\n";
const std::string kInch = "#12=(CONVERSION_BASED_UNIT('INCH',#16)LENGTH_UNIT()NAMED_UNIT(#18));\n"
                          "#16=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#17);\n"
                          "#17=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n"
                          "#18=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);\n";

size_t face_count(const CadModel& model)
{
    size_t count = 0;
    for (const CadPart& part : model.parts)
        count += part.faces.size();
    return count;
}

std::map<std::string, int> kinds(const CadModel& model)
{
    std::map<std::string, int> count;
    for (const CadPart& part : model.parts)
        for (const CadFace& face : part.faces)
            ++count[face.surface.source_kind];
    return count;
}

/// Points of an edge use in space, from the edge's first end to its last: the use's direction is undone.
Vec3d point_on(const CadFace& face, const CadEdgeUse& use, double share)
{
    const Vec2d uv = curve_point(use.pcurve, std::lerp(use.first, use.last, share));
    return evaluate(face.surface, uv.x, uv.y).p;
}

struct Agreement {
    size_t shared_edges = 0, joints = 0;
    double worst_ends = 0, worst_between = 0, worst_joint = 0; // mm
};

/// How well faces that share an edge agree where it is, and the uses of a loop where they join. This holds only if
/// surfaces, pcurves, their orientation and the loops' order are all right.
Agreement agreement(const CadPart& part)
{
    Agreement result;
    std::map<uint32_t, std::vector<std::pair<const CadFace*, const CadEdgeUse*>>> uses;
    for (const CadFace& face : part.faces)
        for (const CadLoop& loop : face.loops)
            for (size_t i = 0; i < loop.size(); ++i) {
                uses[loop[i].edge].emplace_back(&face, &loop[i]);
                const CadEdgeUse& next = loop[(i + 1) % loop.size()];
                const Vec3d end = point_on(face, loop[i], loop[i].reversed ? 0 : 1);
                const Vec3d start = point_on(face, next, next.reversed ? 1 : 0);
                result.worst_joint = std::max(result.worst_joint, norm(end - start));
                ++result.joints;
            }
    for (const auto& [edge, of_edge] : uses)
        for (size_t k = 1; k < of_edge.size(); ++k) {
            const auto& [face_a, a] = of_edge[0];
            const auto& [face_b, b] = of_edge[k];
            ++result.shared_edges;
            for (const double end : {0.0, 1.0})
                result.worst_ends =
                    std::max(result.worst_ends, norm(point_on(*face_a, *a, end) - point_on(*face_b, *b, end)));
            for (const double share : {0.31, 0.5, 0.83}) { // parameters differ between the two: nearest point
                const Vec3d p = point_on(*face_a, *a, share);
                double lo = 0, hi = 1, best = 1e300, at = 0;
                constexpr int kSteps = 200;
                for (int step = 0; step <= kSteps; ++step)
                    if (const double d = norm(point_on(*face_b, *b, step / double(kSteps)) - p); d < best)
                        best = d, at = step / double(kSteps);
                lo = std::max(0.0, at - 1.0 / kSteps);
                hi = std::min(1.0, at + 1.0 / kSteps);
                for (int i = 0; i < 50; ++i) {
                    const double s = std::lerp(lo, hi, 0.382), t = std::lerp(lo, hi, 0.618);
                    (norm(point_on(*face_b, *b, s) - p) < norm(point_on(*face_b, *b, t) - p) ? hi : lo) =
                        norm(point_on(*face_b, *b, s) - p) < norm(point_on(*face_b, *b, t) - p) ? t : s;
                }
                result.worst_between = std::max(result.worst_between, norm(point_on(*face_b, *b, lo) - p));
            }
        }
    return result;
}

double determinant(const CadInstance& instance)
{
    const auto& m = instance.transform;
    return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
           m[2] * (m[4] * m[9] - m[5] * m[8]);
}

void expect_error(const std::string& path, ErrorCode code, const std::string& in_detail)
{
    const Result<CadModel> model = import(path);
    ASSERT_FALSE(model.ok()) << path;
    EXPECT_EQ(model.error().code, code) << model.error().detail;
    EXPECT_EQ(model.error().where, path);
    EXPECT_THAT(model.error().detail, HasSubstr(in_detail));
}

struct Expected {
    const char* file;
    const char* format;
    const char* unit;
    size_t faces, parts, instances;
    double slack_mm; // of edges between faces: what the file itself leaves open
};

const Expected kModels[] = {
    {"nozzle.stp", "STEP AP203", "MM", 14, 1, 1, 1e-2},
    {"nozzle.igs", "IGES 5.3", "M", 14, 1, 1, 1e-2},
    {"unit_sphere.stp", "STEP AP214", "M", 8, 1, 1, 1e-4},
    {"revolved_sphere.step", "STEP AP214", "MM", 1, 1, 1, 1e-9},
    {"io1-cm-214.stp", "STEP AP214", "MM", 29, 1, 1, 1e-3},
    {"sg1-c5-214.stp", "STEP AP214", "MM", 16, 1, 1, 1e-3},
    {"red_cube_blue_cylinder.step", "STEP AP214", "M", 9, 2, 2, 1e-4},
    {"mayo_332_file.stp", "STEP AP214", "MM", 7, 3, 3, 1e-4},
    {"NIST_MBE_PMI_11.stp", "STEP AP203", "MM", 10, 1, 1, 1e-2},
    {"abc_00000050.step", "STEP AP214", "M", 43, 3, 3, 1e-3},
    {"D150WithGuides_wing.igs", "IGES 5.3", "MM", 8, 1, 1, 1.0},
};

TEST(cad_import, every_face_of_the_test_models_is_converted)
{
    for (const Expected& expected : kModels) {
        SCOPED_TRACE(expected.file);
        const CadModel model = model_of(model_path(expected.file));
        EXPECT_EQ(model.source_format, expected.format);
        EXPECT_EQ(model.source_unit, expected.unit);
        EXPECT_EQ(face_count(model), expected.faces);
        EXPECT_EQ(model.dropped.size(), 0u);
        EXPECT_EQ(model.parts.size(), expected.parts);
        EXPECT_EQ(model.instances.size(), expected.instances);
        for (const CadPart& part : model.parts)
            EXPECT_FALSE(part.mesh.triangles.empty());
    }
}

TEST(cad_import, faces_agree_in_space_where_their_shared_edges_are)
{
    for (const Expected& expected : kModels) {
        SCOPED_TRACE(expected.file);
        for (const CadPart& part : model_of(model_path(expected.file)).parts) {
            const Agreement found = agreement(part);
            EXPECT_GT(found.joints, 0u);
            EXPECT_GT(found.shared_edges, 0u);
            EXPECT_LE(found.worst_joint, expected.slack_mm);
            EXPECT_LE(found.worst_ends, expected.slack_mm);
            EXPECT_LE(found.worst_between, expected.slack_mm);
        }
    }
}

// HARD_CASES 22
TEST(cad_import, native_surfaces_as_splines_keep_their_edges_in_space)
{
    for (const char* file : {"nozzle.stp", "unit_sphere.stp", "revolved_sphere.step", "io1-cm-214.stp",
                             "sg1-c5-214.stp", "mayo_332_file.stp"}) {
        SCOPED_TRACE(file);
        const CadModel native = model_of(model_path(file)), splined = model_of(model_path(file), false);
        ASSERT_EQ(splined.parts.size(), native.parts.size());
        ASSERT_EQ(face_count(splined), face_count(native));
        for (size_t p = 0; p < splined.parts.size(); ++p) {
            for (size_t f = 0; f < splined.parts[p].faces.size(); ++f) {
                const CadFace& a = native.parts[p].faces[f];
                const CadFace& b = splined.parts[p].faces[f];
                EXPECT_EQ(b.surface.kind, kKindBezier);
                ASSERT_EQ(a.loops.size(), b.loops.size());
                for (size_t l = 0; l < a.loops.size(); ++l)
                    for (size_t u = 0; u < a.loops[l].size(); ++u)
                        for (const double end : {0.0, 1.0})
                            EXPECT_LT(norm(point_on(a, a.loops[l][u], end) - point_on(b, b.loops[l][u], end)), 1e-5);
            }
            const Agreement before = agreement(native.parts[p]), after = agreement(splined.parts[p]);
            EXPECT_LE(after.worst_between, before.worst_between + 1e-4);
        }
    }
}

TEST(cad_import, a_square_has_the_same_size_in_millimetres_metres_and_inches)
{
    for (const auto& [unit, name, side] :
         {std::tuple{kMillimetre, "MM", 50.8}, {kMetre, "M", 0.0508}, {kInch, "INCH", 2.0}}) {
        SCOPED_TRACE(name);
        const CadModel model = model_of(write("square.step", square_step("square", unit, side)));
        EXPECT_EQ(model.source_unit, name);
        ASSERT_EQ(face_count(model), 1u);
        const CadFace& face = model.parts[0].faces[0];
        EXPECT_EQ(face.surface.kind, kKindPlane);
        ASSERT_EQ(face.loops.size(), 1u);
        ASSERT_EQ(face.loops[0].size(), 4u);
        double longest = 0;
        for (const CadEdgeUse& use : face.loops[0]) {
            const double length = norm(point_on(face, use, 0) - point_on(face, use, 1));
            EXPECT_NEAR(length, 50.8, 1e-9);
            longest = std::max(longest, length);
        }
    }
}

TEST(cad_import, names_in_any_script_survive_as_utf8)
{
    const CadModel escaped =
        model_of(write("escaped.step", square_step("\\X2\\042804350441044204350440043D044F\\X0\\ \\X2\\6B6F8ECA\\X0\\",
                                                   kMillimetre, 1)));
    EXPECT_EQ(escaped.parts.at(0).name, "Шестерня 歯車");
    const CadModel direct =
        model_of(write("direct.step", square_step("Zahnrad \xc3\xa4\xc3\xb6\xc3\xbc", kMillimetre, 1)));
    EXPECT_EQ(direct.parts.at(0).name, "Zahnrad äöü");
}

TEST(cad_import, colours_of_the_bodies_reach_their_faces_as_srgb_bytes)
{
    const CadModel model = model_of(model_path("red_cube_blue_cylinder.step"));
    std::map<std::string, std::set<uint32_t>> colors;
    for (const CadPart& part : model.parts)
        for (const CadFace& face : part.faces)
            colors[part.name].insert(face.color_rgba.value_or(0));
    const auto rgba = [](uint32_t r, uint32_t g, uint32_t b) { return r | g << 8 | b << 16 | 255u << 24; };
    EXPECT_THAT(colors["red_cube"], testing::ElementsAre(rgba(221, 82, 40)));
    EXPECT_THAT(colors["blue_cylinder"], testing::ElementsAre(rgba(59, 97, 180)));
}

TEST(cad_import, the_tree_lists_parents_first_and_holds_every_instance)
{
    for (const Expected& expected : kModels) {
        SCOPED_TRACE(expected.file);
        const CadModel model = model_of(model_path(expected.file));
        ASSERT_FALSE(model.tree.empty());
        EXPECT_EQ(model.tree[0].parent, 0u);
        for (size_t node = 1; node < model.tree.size(); ++node)
            EXPECT_LT(model.tree[node].parent, node);
        for (const CadInstance& instance : model.instances) {
            EXPECT_LT(instance.tree_node, model.tree.size());
            EXPECT_LT(instance.part, model.parts.size());
        }
    }
}

TEST(cad_import, a_shape_placed_three_times_is_one_part_with_a_mirrored_instance)
{
    const std::string path = scratch("copies.brep");
    ASSERT_TRUE(oracle::write_placed_copies(model_path("nozzle.stp"), path));
    const CadModel model = model_of(path);
    EXPECT_EQ(model.source_format, "BREP");
    ASSERT_EQ(model.parts.size(), 1u);
    EXPECT_EQ(model.parts[0].faces.size(), 14u);
    ASSERT_EQ(model.instances.size(), 3u);
    EXPECT_NEAR(determinant(model.instances[0]), 1, 1e-12);
    EXPECT_NEAR(determinant(model.instances[1]), 1, 1e-12);
    EXPECT_NEAR(determinant(model.instances[2]), -1, 1e-12);
}

TEST(cad_import, left_handed_axis_systems_keep_their_y_axis)
{
    const std::string path = scratch("mirror.brep");
    ASSERT_TRUE(oracle::write_left_handed_copy(model_path("nozzle.stp"), path));
    const CadModel model = model_of(path);
    ASSERT_EQ(face_count(model), 14u);
    int left_handed = 0;
    for (const CadFace& face : model.parts[0].faces)
        left_handed += face.surface.kind != kKindBezier &&
                       dot(cross(face.surface.frame.x, face.surface.frame.y), face.surface.frame.z) < 0;
    EXPECT_GT(left_handed, 0);
    const Agreement found = agreement(model.parts[0]);
    EXPECT_LE(found.worst_ends, 1e-2);
    EXPECT_LE(found.worst_between, 1e-2);
}

TEST(cad_import, scaled_placements_inside_a_part_scale_its_surfaces)
{
    const std::string path = scratch("scaled.brep");
    ASSERT_TRUE(oracle::write_scaled_neighbour(model_path("sg1-c5-214.stp"), model_path("nozzle.stp"), 2.5, path));
    const CadModel scaled = model_of(path), plain = model_of(model_path("sg1-c5-214.stp"));
    ASSERT_EQ(face_count(scaled), 30u);
    ASSERT_EQ(scaled.parts.size(), 1u);
    for (size_t f = 0; f < 16; ++f) {
        const CadFace& large = scaled.parts[0].faces[f];
        const CadFace& small = plain.parts[0].faces[f];
        ASSERT_EQ(large.surface.kind, small.surface.kind);
        EXPECT_NEAR(large.surface.radius, 2.5 * small.surface.radius, 1e-9);
        for (size_t l = 0; l < large.loops.size(); ++l)
            for (size_t u = 0; u < large.loops[l].size(); ++u)
                EXPECT_LT(norm(point_on(large, large.loops[l][u], 0.3) - 2.5 * point_on(small, small.loops[l][u], 0.3)),
                          1e-6);
    }
}

// HARD_CASES 24
TEST(cad_import, sweeps_and_offsets_are_converted_with_their_deviation)
{
    const std::string path = scratch("swept.brep");
    ASSERT_TRUE(oracle::write_swept_model(path));
    const CadModel model = model_of(path);
    EXPECT_EQ(model.dropped.size(), 0u);
    EXPECT_THAT(kinds(model),
                testing::UnorderedElementsAre(testing::Pair("extrusion", 1), testing::Pair("revolution", 1),
                                              testing::Pair("offset", 1), testing::Pair("bspline", 1)));
    for (const CadPart& part : model.parts) {
        for (const CadFace& face : part.faces) {
            EXPECT_EQ(face.surface.kind, kKindBezier);
            const bool exact = face.surface.source_kind == "bspline" || face.surface.source_kind == "extrusion";
            EXPECT_EQ(face.surface.deviation_mm == 0, exact) << face.surface.source_kind;
            EXPECT_LT(face.surface.deviation_mm, 1e-3);
            EXPECT_GE(face.loops.size(), 1u);
        }
        const Agreement found = agreement(part);
        EXPECT_LE(found.worst_joint, 1e-3);
        EXPECT_LE(found.worst_between, 1e-3);
    }
}

TEST(cad_import, poles_are_degenerate_uses_and_seams_are_marked)
{
    const CadModel model = model_of(model_path("revolved_sphere.step"));
    ASSERT_EQ(face_count(model), 1u);
    int degenerate = 0, seam = 0;
    for (const CadLoop& loop : model.parts[0].faces[0].loops)
        for (const CadEdgeUse& use : loop) {
            degenerate += use.degenerate;
            seam += use.seam;
        }
    EXPECT_EQ(degenerate, 2);
    EXPECT_EQ(seam, 2);
}

TEST(cad_import, proxy_triangles_name_faces_and_stay_on_the_model)
{
    const CadModel model = model_of(model_path("unit_sphere.stp"));
    const CadMesh& mesh = model.parts.at(0).mesh;
    ASSERT_FALSE(mesh.triangles.empty());
    EXPECT_EQ(mesh.triangle_face.size() * 3, mesh.triangles.size());
    std::set<uint32_t> seen(mesh.triangle_face.begin(), mesh.triangle_face.end());
    EXPECT_EQ(seen.size(), 8u);
    const CadSurface& sphere = model.parts[0].faces[0].surface;
    for (size_t i = 0; i < mesh.positions.size(); i += 3) {
        const Vec3d p{mesh.positions[i], mesh.positions[i + 1], mesh.positions[i + 2]};
        EXPECT_NEAR(norm(p - sphere.frame.origin), sphere.radius, 1e-4 * sphere.radius);
    }
}

TEST(cad_import, the_same_file_gives_the_same_model)
{
    const CadModel a = model_of(model_path("io1-cm-214.stp")), b = model_of(model_path("io1-cm-214.stp"));
    ASSERT_EQ(a.parts.size(), b.parts.size());
    for (size_t p = 0; p < a.parts.size(); ++p) {
        EXPECT_EQ(a.parts[p].mesh.positions, b.parts[p].mesh.positions);
        ASSERT_EQ(a.parts[p].faces.size(), b.parts[p].faces.size());
        for (size_t f = 0; f < a.parts[p].faces.size(); ++f)
            for (size_t l = 0; l < a.parts[p].faces[f].loops.size(); ++l)
                for (size_t u = 0; u < a.parts[p].faces[f].loops[l].size(); ++u)
                    EXPECT_EQ(a.parts[p].faces[f].loops[l][u].pcurve.control_points,
                              b.parts[p].faces[f].loops[l][u].pcurve.control_points);
    }
}

TEST(cad_import, content_decides_the_format_not_the_name)
{
    const std::string path = scratch("nozzle.igs.txt");
    std::filesystem::copy_file(model_path("nozzle.stp"), path);
    EXPECT_EQ(model_of(path).source_format, "STEP AP203");
}

TEST(cad_import, files_that_are_no_cad_models_are_refused_with_what_they_are)
{
    expect_error(scratch("missing.step"), ErrorCode::FileNotFound, "no such file");
    expect_error(scratch(""), ErrorCode::FileNotReadable, "regular file");
    expect_error(write("empty.step", ""), ErrorCode::EmptyCad, "0 bytes");
    expect_error(write("prose.step", "Dear colleague, the model is attached.\n"), ErrorCode::InvalidCad,
                 "Dear colleague");
    expect_error(write("prose.txt", "Dear colleague, the model is attached.\n"), ErrorCode::UnsupportedFormat,
                 "neither STEP, IGES nor BREP");
    expect_error(write("archive.step", "PK\x03\x04 and so on"), ErrorCode::UnsupportedFormat, "zip");
    expect_error(write("header.step",
                       "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),"
                       "'','','');\nFILE_SCHEMA(('CONFIG_CONTROL_DESIGN'));\nENDSEC;\nDATA;\nENDSEC;\n"
                       "END-ISO-10303-21;\n"),
                 ErrorCode::EmptyCad, "STEP AP203");
}

TEST(cad_import, a_truncated_file_is_named_as_such)
{
    const std::string whole = read(model_path("nozzle.stp"));
    for (const double share : {0.2, 0.5, 0.9})
        expect_error(write("cut.step", whole.substr(0, static_cast<size_t>(share * whole.size()))),
                     ErrorCode::InvalidCad, "truncated");
    expect_error(write("cut.brep", "DBRep_DrawableShape\n\nCASCADE Topology V1, (c) Matra-Datavision\nLocations 0\n"),
                 ErrorCode::InvalidCad, "BREP");
}

TEST(cad_import, progress_goes_from_reading_to_meshing)
{
    std::vector<std::string> phases;
    const auto model = import_cad(model_path("nozzle.stp"), {}, [&](const char* phase, double share) {
        EXPECT_LE(share, 1.0);
        if (phases.empty() || phases.back() != phase)
            phases.push_back(phase);
    });
    ASSERT_TRUE(model.ok());
    EXPECT_THAT(phases, testing::ElementsAre("read", "transfer", "faces", "mesh"));
}

} // namespace
