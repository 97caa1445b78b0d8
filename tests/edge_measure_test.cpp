// Edges of faces against closed forms, fine polylines summed up by other means, and the kernel's own edges.
#include "runtime/view/edge_measure.h"

#include "format/record_surface.h"
#include "preprocess/import/cad_import_kernel.h"
#include "tests/dimension_checks.h"
#include "tests/traced_file.h"
#include "tests/traced_scenes.h"

#include <BRepAdaptor_Curve.hxx>
#include <BRep_Tool.hxx>
#include <GCPnts_AbscissaPoint.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <gtest/gtest.h>

namespace trimray {
namespace {

using reference::length;
using reference::Vec3;
using reference::operator-;

/// The edge of face 0 nearest to uv_file.
std::optional<PickedEdge> edge_at(const PackImage& image, const UvPoint& uv_file, uint instance = 0)
{
    return picked_edge(image, surface_facts(image, {0, instance, uv_file, {}}));
}

TEST(edges, a_cylinders_rim_is_a_whole_circle_and_its_seam_no_edge)
{
    TracedScene scene;
    scene.add(kKindCylinder, 0.25, {0.1, 0.2, 0}, {kPi, 2});
    scene.image.faces[0].border_classes = kEdgeSeam | kEdgeSeam << 2; // u = 0 and u = 1
    const auto whole = scene.finish();
    const auto edge = edge_at(whole->pack.image, {3.1, 1.9});
    ASSERT_TRUE(edge);
    EXPECT_EQ(edge->facts.shape, EdgeShape::Circle);
    EXPECT_TRUE(edge->facts.closed);
    EXPECT_NEAR(edge->facts.length_mm, 5 * kPi, kRounded_mm);
    EXPECT_LE(edge->facts.length_error_mm, 1e-9);
    EXPECT_NEAR(edge->facts.radius_mm, 2.5, kRounded_mm);
    EXPECT_LE(length(edge->facts.centre_mm - Vec3{1, 2, 5}), kRounded_mm);
    EXPECT_NEAR(std::abs(edge->facts.axis[2]), 1, 1e-9);
    EXPECT_NEAR(edge->distance_mm, 0.25, kRounded_mm); // 0.1 patch units
    EXPECT_LE(length(edge->foot_mm - Vec3{1 + 2.5 * std::cos(3.1), 2 + 2.5 * std::sin(3.1), 5}), 1e-5);
    const auto found = dimensions_of(edge->facts);
    EXPECT_EQ(found.front().kind, DimensionKind::EdgeLength);
    EXPECT_DIMENSION(found, EdgeDiameter, 5, kRounded_mm);
    EXPECT_NO_DIMENSION(found, EdgeSweep);
}

TEST(edges, half_a_cylinder_has_straight_edges_and_arcs)
{
    TracedScene scene;
    scene.add(kKindCylinder, 0.25, {0, 0, 0}, {kPi / 2, 2});
    const auto whole = scene.finish();
    const auto side = edge_at(whole->pack.image, {1.5, 0.3});
    ASSERT_TRUE(side);
    EXPECT_EQ(side->facts.shape, EdgeShape::Straight);
    EXPECT_NEAR(side->facts.length_mm, 10, kRounded_mm);
    EXPECT_NEAR(std::abs(side->facts.to_mm[2] - side->facts.from_mm[2]), 10, kRounded_mm);
    EXPECT_EQ(dimensions_of(side->facts).size(), 1u);
    const auto arc = edge_at(whole->pack.image, {0.3, -1.9});
    ASSERT_TRUE(arc);
    EXPECT_EQ(arc->facts.shape, EdgeShape::Circle);
    EXPECT_FALSE(arc->facts.closed);
    EXPECT_NEAR(arc->facts.length_mm, 2.5 * kPi, kRounded_mm);
    EXPECT_DIMENSION(dimensions_of(arc->facts), EdgeSweep, 180, 1e-4);
}

TEST(edges, of_a_whole_torus_there_are_none)
{
    TracedScene scene;
    scene.add(kKindTorus, 0.5, {0, 0, 0}, {kPi, kPi}).param[1] = 0.25f;
    scene.image.faces[0].border_classes = 0xaa; // seams all round
    EXPECT_FALSE(edge_at(scene.finish()->pack.image, {1, 2}));
}

const shapes::Loop kBorder = shapes::polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}});

TEST(edges, a_square_hole_has_four_edges_and_a_round_one_has_one)
{
    TracedScene scene;
    scene.add(kKindPlane, 1, {0, 0, 0}, {1, 1}); // 20 mm
    scene.trim(0, {kBorder, shapes::polygon({{0.125f, 0.125f}, {0.375f, 0.125f}, {0.375f, 0.5f}, {0.125f, 0.5f}}),
                   shapes::circle(0.75, 0.5, 0.125, 0.125, 4)});
    const auto whole = scene.finish();
    const PackImage& image = whole->pack.image;
    EXPECT_EQ(border_edges(image, PlacedSurface(image, 0, 0)).size(), 4u + 4 + 1);
    const auto side = edge_at(image, {-0.25 + 0.01, -0.3}); // beside u = 0.375
    ASSERT_TRUE(side);
    EXPECT_EQ(side->facts.shape, EdgeShape::Straight);
    EXPECT_NEAR(side->facts.length_mm, 7.5, kRounded_mm);
    EXPECT_NEAR(side->distance_mm, 0.1, kRounded_mm);
    const auto hole = edge_at(image, {0.5, 0.26});
    ASSERT_TRUE(hole);
    EXPECT_EQ(hole->facts.shape, EdgeShape::Circle);
    EXPECT_NEAR(hole->facts.length_mm, 5 * kPi, 1e-5); // of 16 cubics
    EXPECT_NEAR(hole->facts.radius_mm, 2.5, kRounded_mm);
    EXPECT_NEAR(hole->distance_mm, 0.1, 1e-5);
}

/// Two half circles joined by lines, without a corner anywhere. uv_face
shapes::Loop slot(float u, float v, float half_length, float radius)
{
    const shapes::Loop round = shapes::circle(double(u), double(v), double(radius), double(radius)); // 8 arcs
    shapes::Loop loop;
    const auto add_half = [&](std::initializer_list<size_t> arcs, float shift) {
        const auto add = [&](size_t i) { loop.points.push_back({round.points[i].u + shift, round.points[i].v}); };
        for (const size_t arc : arcs) {
            for (size_t i = 0; i < 3; ++i)
                add(3 * arc + i);
            loop.cubic.push_back(true);
        }
        add(3 * *(arcs.end() - 1) + 3);
        loop.cubic.push_back(false); // to the other half
    };
    add_half({6, 7, 0, 1}, half_length);
    add_half({2, 3, 4, 5}, -half_length);
    loop.points.push_back(loop.points.front());
    return loop;
}

TEST(edges, a_slots_lines_end_where_its_arcs_begin)
{
    TracedScene scene;
    scene.add(kKindPlane, 1, {0, 0, 0}, {1, 1});
    scene.trim(0, {kBorder, slot(0.5f, 0.5f, 0.25f, 0.125f)});
    const auto whole = scene.finish();
    const PackImage& image = whole->pack.image;
    EXPECT_EQ(border_edges(image, PlacedSurface(image, 0, 0)).size(), 4u + 4);
    const auto line = edge_at(image, {0.1, 0.26});
    ASSERT_TRUE(line);
    EXPECT_EQ(line->facts.shape, EdgeShape::Straight);
    EXPECT_NEAR(line->facts.length_mm, 10, kRounded_mm);
    const auto arc = edge_at(image, {0.76, 0.1});
    ASSERT_TRUE(arc);
    EXPECT_EQ(arc->facts.shape, EdgeShape::Circle);
    EXPECT_NEAR(arc->facts.length_mm, 2.5 * kPi, 1e-4); // of 4 cubics: 4e-6
    EXPECT_LE(length(arc->facts.centre_mm - Vec3{5, 0, 0}), 1e-4);
    EXPECT_DIMENSION(dimensions_of(arc->facts), EdgeSweep, 180, 1e-2);
}

TEST(edges, an_edge_ends_where_its_class_changes)
{
    TracedScene scene;
    scene.add(kKindPlane, 1, {0, 0, 0}, {1, 1});
    scene.trim(0, {shapes::circle(0.5, 0.5, 0.25, 0.25)}); // 8 pieces
    for (size_t i = 0; i < 2; ++i)
        scene.image.trim_pieces[3 + i] |= kEdgeSmooth << kPieceClassShift;
    const auto whole = scene.finish();
    const PackImage& image = whole->pack.image;
    EXPECT_EQ(border_edges(image, PlacedSurface(image, 0, 0)).size(), 2u);
    const auto smooth = edge_at(image, {-0.49, 0}); // pieces 3 and 4 lie from 135 to 225 degrees
    ASSERT_TRUE(smooth);
    EXPECT_EQ(smooth->facts.edge_class, kEdgeSmooth);
    EXPECT_NEAR(smooth->facts.length_mm, 5 * kPi / 2, 1e-4);
}

/// The length of a loop on a face of one patch, placed: many short chords, from the records alone.
double summed_length(const PackImage& image, uint face_id, const Placement& m)
{
    constexpr int kChords = 4000; // off by their number's square: 1e-7
    const FaceRecord& face = image.faces[face_id];
    const PatchRecord& patch = image.patches[face.first_patch];
    double sum = 0;
    for (uint i = 0; i < face.piece_count; ++i) {
        const MonotonePiece piece =
            load_piece(image.trim_points.data(), face.first_point, image.trim_pieces[face.first_piece + i]);
        Vec3 last{};
        for (int k = 0; k <= kChords; ++k) {
            const double t = double(k) / kChords;
            const auto q = point_of(patch, image.control_points.data(),
                                    (bezier3(piece.u, t) - patch.uv_offset[0]) / patch.uv_scale[0],
                                    (bezier3(piece.v, t) - patch.uv_offset[1]) / patch.uv_scale[1]);
            Vec3 p{}, in_world;
            for (size_t c = 0; c < 3; ++c)
                p[c] = 10 * double(patch.scale) *
                       (patch.axis_x[c] * q[0] + patch.axis_y[c] * q[1] + patch.axis_z[c] * q[2]); // from its origin
            for (size_t r = 0; r < 3; ++r)
                in_world[r] = m[4 * r] * p[0] + m[4 * r + 1] * p[1] + m[4 * r + 2] * p[2];
            if (k > 0)
                sum += length(in_world - last);
            last = in_world;
        }
    }
    return sum;
}

TEST(edges, an_ellipse_on_every_kind_of_surface_is_as_long_as_its_chords)
{
    const Placement placements[] = {kWhereItIs,
                                    {0, -3, 0, 5, 3, 0, 0, 6, 0, 0, 3, 7},
                                    {-0.5, 0, 0, 5, 0, 0.5, 0, 6, 0, 0, 0.5, 7},
                                    {2, 0.3, 0, 0, 0, 1, 0, 0, 0, 0.2, 0.5, 0}};
    for (int kind = 0; kind < 7; ++kind) {
        TracedScene scene;
        if (kind < 5) {
            PatchRecord& patch = scene.add(uint(kind), 0.4, {0.1, 0.2, 0.3}, {1.2, 1.1});
            patch.param[1] = kind == 4 ? 0.4f : -0.3f;
        } else if (kind == 5) {
            scene.add_wave(4, {0, 0, 0}, 0.5f);
        } else {
            scene.add_bezier(2, 1, true, 0.4, {0.6, 0.5, 0.4});
            const float half = std::sqrt(0.5f);
            const float arc[3][3] = {{1, 0, 1}, {half, half, half}, {0, 1, 1}};
            for (const auto& [wx, wy, w] : arc)
                for (const float z : {-0.8f, 0.8f})
                    scene.image.control_points.insert(scene.image.control_points.end(), {wx, wy, z * w, w});
        }
        scene.trim(0, {shapes::circle(0.5, 0.45, 0.4, 0.3)});
        for (const Placement& placement : placements)
            scene.place(placement);
        const auto whole = scene.finish();
        const PackImage& image = whole->pack.image;
        for (uint i = 0; i < 4; ++i) {
            const PlacedSurface surface(image, i, 0);
            const std::vector<BorderEdge> edges = border_edges(image, surface);
            ASSERT_EQ(edges.size(), 1u) << kind << " " << i;
            const EdgeFacts facts = measure_edge(surface, edges[0]);
            const double expected = summed_length(image, 0, placements[i]);
            EXPECT_NEAR(facts.length_mm, expected, 1e-6 * expected) << kind << " " << i;
            EXPECT_LE(facts.length_error_mm, 1e-9 * expected) << kind << " " << i;
            EXPECT_EQ(facts.shape, EdgeShape::Other) << kind << " " << i;
            EXPECT_TRUE(facts.closed);
            EXPECT_EQ(dimensions_of(facts).size(), 1u);
        }
    }
}

TEST(edges, the_side_of_a_spline_face_is_measured_along_the_spline)
{
    TracedScene scene;
    scene.add_wave(3, {0, 0, 0}, 0.6f, 1);
    const auto whole = scene.finish();
    const PackImage& image = whole->pack.image;
    const auto side = edge_at(image, {0.4, 0.02});
    ASSERT_TRUE(side);
    double expected = 0;
    constexpr int kChords = 20000;
    for (int i = 0; i < kChords; ++i) {
        const auto a = point_of(image.patches[0], image.control_points.data(), double(i) / kChords, 0);
        const auto b = point_of(image.patches[0], image.control_points.data(), double(i + 1) / kChords, 0);
        expected += 10 * length(b - a);
    }
    EXPECT_NEAR(side->facts.length_mm, expected, 1e-7 * expected);
    EXPECT_EQ(side->facts.shape, EdgeShape::Other);
    EXPECT_FALSE(side->facts.closed);
}

TEST(edges, a_circle_seen_through_a_mirror_and_a_scale_stays_one_and_through_a_stretch_does_not)
{
    TracedScene scene;
    scene.add(kKindPlane, 1, {0, 0, 0}, {1, 1});
    scene.trim(0, {shapes::circle(0.5, 0.5, 0.25, 0.25, 4)});
    scene.place({-3, 0, 0, 5, 0, 3, 0, 6, 0, 0, 3, 7});
    scene.place({2, 0, 0, 5, 0, 1, 0, 6, 0, 0, 1, 7});
    const auto whole = scene.finish();
    const auto mirrored = edge_at(whole->pack.image, {0.2, 0}, 0);
    ASSERT_TRUE(mirrored);
    EXPECT_EQ(mirrored->facts.shape, EdgeShape::Circle);
    EXPECT_NEAR(mirrored->facts.radius_mm, 15, 1e-5);
    EXPECT_LE(length(mirrored->facts.centre_mm - Vec3{5, 6, 7}), 1e-5);
    const auto stretched = edge_at(whole->pack.image, {0.2, 0}, 1);
    ASSERT_TRUE(stretched);
    EXPECT_EQ(stretched->facts.shape, EdgeShape::Other);
}

// ---- converted models ----------------------------------------------------------------------------------------------

/// A model's pack, with its surfaces as they are or all as splines. No image where that fails, which fails the test.
std::shared_ptr<const Scene> converted(const std::string& name, bool native)
{
    ImportOptions options;
    options.proxy_deflection = 0;
    options.native_surfaces = native;
    const Result<CadModel> model = import_cad(TRIMRAY_TESTS_DIR "/models/" + name, options, {});
    if (model.ok())
        return scene_of_model(*model);
    ADD_FAILURE() << model.error().detail;
    return nullptr;
}

class Converted : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(edges, Converted, testing::Bool(),
                         [](const auto& native) { return native.param ? "native" : "splines"; });

TEST_P(Converted, a_cube_and_a_cylinder_have_the_edges_of_10_mm_that_their_file_says)
{
    const auto scene = converted("red_cube_blue_cylinder.step", GetParam());
    ASSERT_TRUE(scene);
    const PackImage& image = scene->pack.image;
    size_t straight = 0, round = 0;
    for (uint i = 0; i < image.instances.size(); ++i) {
        const PartRecord& part = image.parts[image.instances[i].part];
        for (uint f = part.first_face; f < part.first_face + part.face_count; ++f) {
            const PlacedSurface surface(image, i, f);
            for (const BorderEdge& edge : border_edges(image, surface)) {
                const EdgeFacts facts = measure_edge(surface, edge);
                straight += facts.shape == EdgeShape::Straight;
                round += facts.shape == EdgeShape::Circle;
                const bool circle = facts.shape == EdgeShape::Circle;
                EXPECT_NEAR(facts.length_mm, circle ? 10 * kPi : 10, dimensions_of(facts).front().error);
                EXPECT_NEAR(facts.length_mm, circle ? 10 * kPi : 10, 1e-3);
                EXPECT_NEAR(facts.radius_mm, circle ? 5 : 0, 1e-4);
            }
        }
    }
    EXPECT_EQ(straight, 6u * 4);
    EXPECT_EQ(round, 4u); // each rim on both of its faces
}

TEST_P(Converted, faces_edges_are_together_as_long_as_the_kernels)
{
    for (const char* name : {"nozzle.stp", "io1-cm-214.stp", "sg1-c5-214.stp"}) {
        const std::string path = std::string(TRIMRAY_TESTS_DIR) + "/models/" + name;
        const auto quiet = [](const char*, double) {};
        const Result<kernel::LoadedFile> file = kernel::load_file(path, kernel::CadFormat::Step, {}, quiet);
        ASSERT_TRUE(file.ok()) << path;
        const auto scene = converted(name, GetParam());
        ASSERT_TRUE(scene);
        const PackImage& image = scene->pack.image;
        ASSERT_EQ(image.parts.size(), file->parts.size());
        double worst = 0, largest_error = 0; // as shares of a face's edges
        for (uint i = 0; i < image.instances.size(); ++i) {
            const uint p = image.instances[i].part;
            TopTools_IndexedMapOfShape shapes;
            TopExp::MapShapes(file->parts[p].shape, TopAbs_FACE, shapes);
            for (uint f = 0; f < image.parts[p].face_count; ++f) {
                const TopoDS_Face& face = TopoDS::Face(shapes(int(f) + 1));
                double expected = 0;
                for (TopExp_Explorer it(face, TopAbs_EDGE); it.More(); it.Next()) {
                    const TopoDS_Edge& edge = TopoDS::Edge(it.Current());
                    if (!BRep_Tool::Degenerated(edge) && !BRep_Tool::IsClosed(edge, face))
                        expected += GCPnts_AbscissaPoint::Length(BRepAdaptor_Curve(edge), 1e-9);
                }
                const PlacedSurface surface(image, i, image.parts[p].first_face + f);
                double ours = 0, error = 0;
                for (const BorderEdge& edge : border_edges(image, surface)) {
                    const Dimension measured = dimensions_of(measure_edge(surface, edge)).front();
                    ours += measured.value;
                    error += measured.error;
                }
                EXPECT_NEAR(ours, expected, error) << name << " face " << f;
                worst = std::max(worst, std::abs(ours - expected) / std::max(expected, 1e-9));
                largest_error = std::max(largest_error, error / std::max(expected, 1e-9));
            }
        }
        std::cout << fmt::format(
            "{}: edges' lengths differ from the kernel's by at most {:.2g} of them, {:.2g} claimed\n", name, worst,
            largest_error);
        EXPECT_LE(worst, 2e-4) << name;
        EXPECT_LE(largest_error, 1e-2) << name;
    }
}

} // namespace
} // namespace trimray
