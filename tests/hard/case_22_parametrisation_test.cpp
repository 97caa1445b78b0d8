// Hard case 22: a surface in other parameters than the file's needs its pcurves in those too.
#include "format/trim_piece.h"
#include "preprocess/bezier_patch.h"
#include "preprocess/trims/trim_curve.h"
#include "preprocess/vec3d.h"
#include "tests/occt_solids.h"
#include "tests/traced_file.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace trimray::hard {
namespace {

constexpr double kSize_mm = 72; // the cylinder's diagonal
constexpr double kMost = 1e-6;  // border errors, of the size
// The default tolerance is relative to the domain's longer side, here 1.7 sizes, and errors are measured at up to 1.5
// of their least; grown borders lie farther out by what neighbours may miss each other by
constexpr double kFine = 2.5e-7, kMostAtDefault = 2.6e-6, kMostGrown = 8e-6;

/// Distance of a border's point from the nearest edge of the slotted cylinder, in closed form: every edge, and the
/// seam, lies in two of these surfaces, which meet at 45 degrees at least, so it is within 1.5 of what this returns.
double off_edges_mm(const Vec3d& p)
{
    const double c = std::cos(oracle::kSlotTurn), s = std::sin(oracle::kSlotTurn), z = p.z - 30;
    const double across = c * p.y + s * z, along = -s * p.y + c * z;
    std::array<double, 9> off{std::hypot(p.x, p.y) - 20,
                              p.z,
                              p.z - 60,
                              p.x - 10,
                              across - 5,
                              across + 5,
                              along - 15,
                              along + 15,
                              std::sin(oracle::kSlotSeam) * p.x - std::cos(oracle::kSlotSeam) * p.y};
    for (double& d : off)
        d = std::abs(d);
    std::nth_element(off.begin(), off.begin() + 1, off.end());
    return off[1];
}

Vec3d surface_point(const CadSurface& surface, double u, double v)
{
    return evaluate(surface, u, v).p;
}

/// Of the pcurves as they are imported.
double imported_mm(const CadModel& model)
{
    double worst = 0;
    for (const CadFace& face : model.parts[0].faces)
        for (const CadLoop& loop : face.loops)
            for (const CadEdgeUse& use : loop)
                for (int i = 0; i <= 200; ++i) {
                    const Vec2d uv = curve_point(use.pcurve, std::lerp(use.first, use.last, i / 200.0));
                    worst = std::max(worst, off_edges_mm(surface_point(face.surface, uv.x, uv.y)));
                }
    return worst;
}

/// Of the pieces in the pack, in single precision.
double packed_mm(const CadModel& model, const PackImage& image)
{
    double worst = 0;
    for (size_t f = 0; f < image.faces.size(); ++f) {
        const FaceRecord& face = image.faces[f];
        for (uint i = 0; i < face.piece_count; ++i) {
            const MonotonePiece piece =
                load_piece(image.trim_points.data(), face.first_point, image.trim_pieces[face.first_piece + i]);
            for (int k = 0; k <= 50; ++k) {
                const double u = std::lerp(face.domain_lo[0], face.domain_hi[0], bezier3(piece.u, k / 50.0));
                const double v = std::lerp(face.domain_lo[1], face.domain_hi[1], bezier3(piece.v, k / 50.0));
                worst = std::max(worst, off_edges_mm(surface_point(model.parts[0].faces[f].surface, u, v)));
            }
        }
    }
    return worst;
}

/// Largest border errors, of the size.
struct BorderErrors {
    double imported, packed, grown;
};

BorderErrors measure(const CadModel& model, double tolerance)
{
    BorderErrors errors{imported_mm(model) / kSize_mm, 0, 0};
    for (const bool grow : {false, true}) {
        BuildOptions options;
        options.trims.tolerance = tolerance;
        options.trims.grow = grow;
        BuildReport report;
        const PackImage image = build_pack(model, options, report);
        EXPECT_EQ(image.faces.size(), model.parts[0].faces.size());
        (grow ? errors.grown : errors.packed) = packed_mm(model, image) / kSize_mm;
    }
    return errors;
}

TEST(case_22, a_slots_border_stays_where_it_is_in_space_and_looks_the_same)
{
    const TemporaryFile file("slot.brep");
    ASSERT_TRUE(oracle::write_slotted_cylinder(file.path));
    std::array<Frame, 2> of_native;
    for (const bool native : {true, false}) {
        const std::string name = native ? "native" : "as splines";
        ImportOptions import_options;
        import_options.native_surfaces = native;
        import_options.proxy_deflection = 0;
        const Result<CadModel> model = import_cad(file.path, import_options, {});
        ASSERT_TRUE(model.ok());
        ASSERT_EQ(model->parts[0].faces.size(), 8u);
        for (const CadFace& face : model->parts[0].faces)
            EXPECT_EQ(face.surface.kind == kKindBezier, !native);

        const BorderErrors plain = measure(*model, TrimOptions{}.tolerance), fine = measure(*model, kFine);
        for (const auto& [what, errors] : {std::pair("", plain), std::pair(" at a finer tolerance", fine)})
            std::cout << fmt::format("{}{}: imported {:.2g} of the size, packed {:.2g}, grown {:.2g}\n", name, what,
                                     errors.imported, errors.packed, errors.grown);
        EXPECT_LT(plain.imported, kMost) << name;
        EXPECT_LT(fine.packed, kMost) << name;
        EXPECT_LT(plain.packed, kMostAtDefault) << name;
        EXPECT_LT(plain.grown, kMostGrown) << name;

        RenderOptions options;
        options.camera = {{130, -40, 70}, {0, 0, 30}, {0, 0, 1}, 35};
        const auto scene = scene_of_model(*model);
        ASSERT_TRUE(scene);
        for (const bool vulkan : {false, true}) {
            options.width = options.height = vulkan ? 64 : 128;
            const Frame frame = right_picture(scene, options, vulkan, name, native ? 0 : 2);
            if (native)
                of_native[vulkan] = frame;
            expect_same(of_native[vulkan], frame, options, name);
        }
    }
}

} // namespace
} // namespace trimray::hard
