// Real faces: what the trims leave of each surface has the area that the CAD kernel computes by its own means.
#include "tests/trim_areas.h"

#include "preprocess/import/cad_import_kernel.h"

#include <BRepGProp.hxx>
#include <GProp_GProps.hxx>
#include <TopExp.hxx>
#include <TopoDS.hxx>
#include <gtest/gtest.h>

namespace trimray {
namespace {

TEST(trim_areas, every_face_of_real_models_has_the_kernels_area)
{
    size_t faces = 0;
    for (const char* name : {"NIST_MBE_PMI_3.stp", "NIST_MBE_PMI_11.stp", "M6-1x12-countersunk-screw.step",
                             "abc_00000050.step", "io1-cm-214.stp", "nozzle.stp", "sg1-c5-214.stp", "unit_sphere.stp",
                             "revolved_sphere.step", "red_cube_blue_cylinder.step"}) {
        const std::string path = std::string(TRIMRAY_TESTS_DIR) + "/models/" + name;
        const auto quiet = [](const char*, double) {};
        Result<kernel::LoadedFile> file = kernel::load_file(path, kernel::CadFormat::Step, {}, quiet);
        ASSERT_TRUE(file.ok()) << path;
        std::vector<CadDroppedFace> dropped;
        for (uint32_t p = 0; p < file->parts.size(); ++p) {
            const CadPart part = kernel::convert_part(file->parts[p], p, {}, dropped, quiet);
            TopTools_IndexedMapOfShape shapes;
            TopExp::MapShapes(file->parts[p].shape, TopAbs_FACE, shapes);
            for (const CadFace& face : part.faces) {
                const Result<TrimLoops> loops = build_trim_loops(face, {.grow = false}); // the curves themselves
                ASSERT_TRUE(loops.ok()) << name << " face " << face.face_in_part << ": " << loops.error().detail;
                const double ours = trimmed_area(face.surface, *loops);
                const TopoDS_Shape& shape = shapes(static_cast<int>(face.face_in_part) + 1);
                // the kernel has two quadratures, and each is off by up to a percent on some faces: one must agree
                GProp_GProps fixed, adaptive;
                BRepGProp::SurfaceProperties(shape, fixed);
                double error = std::abs(ours - std::abs(fixed.Mass())) / ours;
                if (error > 1e-5) {
                    BRepGProp::SurfaceProperties(shape, adaptive, 1e-7);
                    error = std::min(error, std::abs(ours - std::abs(adaptive.Mass())) / ours);
                }
                EXPECT_LT(error, 5e-4) << name << " face " << face.face_in_part << " " << face.surface.source_kind;
                ++faces;
            }
        }
        EXPECT_TRUE(dropped.empty()) << name;
    }
    EXPECT_GT(faces, 100u);
}

} // namespace
} // namespace trimray
