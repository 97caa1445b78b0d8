// Hard case 24: offset, swept and other surfaces, which only an approximation makes splines of.
#include "preprocess/bezier_patch.h"
#include "preprocess/vec3d.h"
#include "tests/occt_models.h"
#include "tests/occt_oracle.h"
#include "tests/traced_file.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace trimray::hard {
namespace {

constexpr double kRelativeTolerance = 1e-6; // the importer's, of the part's diagonal

/// About how far a point lies from the torus-like surface that the test's ellipse makes about z: F / |grad F| of
/// F = ((r - 8) / 5)^2 + (z / 3)^2 - 1.
double off_revolved_ellipse_mm(const Vec3d& p)
{
    const double a = (std::hypot(p.x, p.y) - 8) / 5, b = p.z / 3;
    return std::abs(a * a + b * b - 1) / (2 * std::hypot(a / 5, b / 3));
}

class Kinds24 : public testing::Test {
protected:
    Kinds24() : file_("kinds.brep"), kinds_(oracle::kinds_of_faces())
    {
        EXPECT_TRUE(oracle::write_every_kind(file_.path));
        ImportOptions options;
        options.proxy_deflection = 0;
        Result<CadModel> model = import_cad(file_.path, options, {});
        EXPECT_TRUE(model.ok());
        if (model.ok())
            model_ = std::move(*model);
    }

    bool is_dropped(int32_t face_in_part) const
    {
        return std::any_of(model_.dropped.begin(), model_.dropped.end(),
                           [&](const CadDroppedFace& face) { return int32_t(face.face_in_part) == face_in_part; });
    }

    TemporaryFile file_;
    std::vector<oracle::KindOfFace> kinds_;
    CadModel model_;
};

TEST_F(Kinds24, EveryKindIsConvertedWithItsDeviationOrNamed)
{
    ASSERT_EQ(model_.parts.size(), 1u);
    const CadPart& part = model_.parts[0];
    ASSERT_EQ(part.faces.size() + model_.dropped.size(), kinds_.size());
    std::set<uint32_t> seen;
    int approximated = 0;
    double largest_mm = 0;
    for (const CadFace& face : part.faces) {
        const oracle::KindOfFace& kind = kinds_[face.face_in_part];
        EXPECT_EQ(face.surface.source_kind, kind.source_kind) << kind.name;
        seen.insert(face.face_in_part);
        approximated += face.surface.deviation_mm > 1e-12;
        largest_mm = std::max(largest_mm, face.surface.deviation_mm);
    }
    // offsets of what an offset of a spline sweeps, which bends abruptly at that spline's knots
    for (const CadDroppedFace& face : model_.dropped) {
        seen.insert(face.face_in_part);
        EXPECT_EQ(kinds_[face.face_in_part].name, std::string("an offset curve"));
        EXPECT_EQ(kinds_[face.face_in_part].source_kind, std::string("offset"));
        EXPECT_THAT(face.reason, testing::HasSubstr("not smooth enough"));
    }
    EXPECT_EQ(seen.size(), kinds_.size());
    EXPECT_EQ(model_.dropped.size(), 2u);
    const double diagonal_mm =
        std::hypot(oracle::kKindsPerRow, kinds_.size() / double(oracle::kKindsPerRow)) * oracle::kKindStep_mm;
    EXPECT_LE(largest_mm, kRelativeTolerance * diagonal_mm);
    std::cout << fmt::format("{} faces, {} approximated within {:.2g} mm, {} named\n", kinds_.size(), approximated,
                             largest_mm, model_.dropped.size());
}

TEST_F(Kinds24, TheReportedDeviationIsThatOfBruteForce)
{
    for (const CadFace& face : model_.parts[0].faces) {
        const oracle::KindOfFace& kind = kinds_[face.face_in_part];
        if (kind.source_kind != std::string("revolution") || kind.name != std::string("an ellipse"))
            continue;
        const Rect2d& domain = face.surface.natural_bounds;
        const Vec3d place{oracle::kKindStep_mm * (face.face_in_part % oracle::kKindsPerRow),
                          oracle::kKindStep_mm * (face.face_in_part / oracle::kKindsPerRow), 0};
        double worst_mm = 0;
        constexpr int kSamples = 400;
        for (int i = 0; i <= kSamples; ++i)
            for (int j = 0; j <= kSamples; ++j) {
                const double u = std::lerp(domain.lo.x, domain.hi.x, i / double(kSamples));
                const double v = std::lerp(domain.lo.y, domain.hi.y, j / double(kSamples));
                worst_mm = std::max(worst_mm, off_revolved_ellipse_mm(evaluate(face.surface, u, v).p - place));
            }
        std::cout << fmt::format("reported {:.3g} mm, found {:.3g} mm\n", face.surface.deviation_mm, worst_mm);
        EXPECT_LE(worst_mm, 1.05 * face.surface.deviation_mm); // which is measured between nodes
        EXPECT_GE(worst_mm, 0.5 * face.surface.deviation_mm);
        return;
    }
    ADD_FAILURE() << "there is no revolved ellipse";
}

TEST_F(Kinds24, RaysMeetTheKernelsOwnSurfaces)
{
    BuildReport report;
    auto scene = std::make_shared<Scene>();
    scene->pack.image = build_pack(model_, {}, report);
    std::string error;
    const auto occt = oracle::Oracle::load(file_.path, {}, error);
    ASSERT_TRUE(occt) << error;
    const auto view = oracle::frame_box(occt->lo_mm(), occt->hi_mm(), {0.3, -0.7, 0.9}, {0, 0, 1}, 1.5, 30);
    RenderOptions options;
    options.camera = {view.eye, view.target, view.up, view.fov_deg};
    for (const bool vulkan : {false, true}) {
        options.height = vulkan ? 80 : 160;
        options.width = options.height * 3 / 2;
        const Frame frame = right_picture(scene, options, vulkan, "every kind", 2);
        if (frame.face.empty())
            continue;
        const auto rays = oracle::view_rays(view, options.width, options.height);
        const oracle::Agreement agreement = occt->compare(rays, frame.depth_mm, occt->cast(rays));
        size_t of_dropped = 0, others = 0;
        for (const oracle::Disagreement& d : agreement.disagreements)
            if (d.cause == oracle::Cause::Unexplained)
                ++(is_dropped(d.face) ? of_dropped : others);
        std::cout << fmt::format("{} of {} rays meet what the kernel's do; {} would meet a face that was dropped\n",
                                 agreement.agree, agreement.rays, of_dropped);
        EXPECT_EQ(others, 0u);
        EXPECT_GT(agreement.both_hit, agreement.rays / 50);
    }
}

} // namespace
} // namespace trimray::hard
