// Gaps between neighbouring faces: none shows the inside of a closed solid.
#include "preprocess/bezier_patch.h"
#include "preprocess/build_pack.h"
#include "preprocess/import/cad_import.h"
#include "preprocess/vec3d.h"
#include "tests/hard/leaks.h"
#include "tests/keep_vulkan_loaded.h"
#include "tests/occt_solids.h"
#include "tests/traced_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <iostream>
#include <numbers>
#include <random>
#include <unistd.h>

namespace trimray::hard {
namespace {

constexpr double kRim = 1e-5; // of the diagonal: rounding and the tracers' slack at a domain's border
constexpr uint32_t kPixels = 256, kMovedPixels = 192, kVulkanPixels = 48;

std::optional<CadModel> model_of(const std::string& path)
{
    ImportOptions options;
    options.proxy_deflection = 0;
    Result<CadModel> model = import_cad(path, options, {});
    if (!model.ok())
        return std::nullopt;
    return std::move(*model);
}

std::optional<CadModel> model_of(oracle::Solid solid)
{
    const auto path = std::filesystem::temp_directory_path() / fmt::format("trimray_leaks_{}.brep", getpid());
    if (!oracle::write_closed_solid(solid, path.string()))
        return std::nullopt;
    std::optional<CadModel> model = model_of(path.string());
    std::filesystem::remove(path);
    return model;
}

std::shared_ptr<const Scene> scene_of(const CadModel& model, bool grow)
{
    BuildOptions options;
    options.trims.grow = grow;
    BuildReport report;
    const PackImage image = build_pack(model, options, report);
    EXPECT_EQ(report.faces, report.converted);
    for (const FaceFinding& found : report.trim_findings) {
        const TrimFindingKind kind = found.finding.kind;
        const bool closed_and_grown = kind != TrimFindingKind::OpenLoop && kind != TrimFindingKind::NotGrown;
        EXPECT_TRUE(closed_and_grown) << "face " << found.face_in_part << ": " << finding_detail(found.finding);
    }
    return scene_of_image(image);
}

/// Counts in pictures of all `views`, from outside and from within.
struct Counts {
    LeakCount outside, inside;
};

Counts count(Tracer& tracer, Tracer& true_tracer, const PackImage& true_image, const ClosedModel& closed,
             const std::vector<LeakView>& views, TrimMode mode, uint32_t pixels)
{
    Counts counts;
    for (const LeakView& view : views) {
        RenderOptions options;
        options.width = options.height = pixels;
        options.camera = view.camera;
        options.trim = mode;
        options.shade = false;
        RenderStats stats;
        const Result<Frame> frame = tracer.render(options, stats), true_frame = true_tracer.render(options, stats);
        if (!frame.ok() || !true_frame.ok()) {
            ADD_FAILURE() << (frame.ok() ? true_frame : frame).error().detail;
            return counts;
        }
        const TruePicture truth{true_image, *true_frame};
        (view.inside ? counts.inside : counts.outside) += closed.count(options, *frame, view.inside, &truth);
    }
    return counts;
}

/// Grown borders let no ray pass, and show no back from outside, not even at rims.
void expect_tight(const Counts& counts, const std::string& name)
{
    EXPECT_EQ(counts.outside.leaks, 0) << name;
    EXPECT_EQ(counts.outside.rims, 0) << name;
    EXPECT_EQ(counts.outside.holes, 0) << name;
    EXPECT_EQ(counts.inside.leaks, 0) << name;
}

/// What each mode leaks of a model, its borders as they are and grown. The CPU tracer is asked, and Vulkan's too unless
/// told otherwise; the views are those of the grown model. `truth`: the model before its pcurves were moved.
struct Leaks {
    Counts as_is, grown;
};

Leaks measure(const CadModel& model, const CadModel& truth, const std::string& name, double tolerance_mm,
              uint32_t pixels, bool with_vulkan = true)
{
    Leaks leaks;
    const auto true_scene = scene_of(truth, false);
    if (!true_scene)
        return leaks;
    const auto true_tracer = make_cpu_tracer(true_scene);
    EXPECT_TRUE(true_tracer.ok());
    std::vector<LeakView> views;
    for (const bool grow : {true, false}) {
        const auto scene = scene_of(model, grow);
        if (!scene)
            return leaks;
        const Bounds bounds = bounds_of(scene->pack.image);
        const ClosedModel closed(scene, kRim * bounds.diagonal() + 8 * tolerance_mm);
        auto cpu = make_cpu_tracer(scene);
        EXPECT_TRUE(cpu.ok());
        if (views.empty())
            views = leak_views(*scene, bounds, 2, 4, pixels);
        EXPECT_GE(std::count_if(views.begin(), views.end(), [](const LeakView& view) { return view.inside; }), 6)
            << name;
        for (const TrimMode mode : {TrimMode::Exact, TrimMode::Hybrid}) {
            const Counts counts = count(**cpu, **true_tracer, true_scene->pack.image, closed, views, mode, pixels);
            std::cout << fmt::format("{}, {}, borders {}: outside {} leaks, {} at rims, {} grazing, {} holes of {} "
                                     "rays; inside {} of {}\n",
                                     name, mode == TrimMode::Exact ? "exact" : "hybrid", grow ? "grown" : "as is",
                                     counts.outside.leaks, counts.outside.rims, counts.outside.grazing,
                                     counts.outside.holes, counts.outside.rays, counts.inside.leaks,
                                     counts.inside.rays);
            if (grow)
                expect_tight(counts, name);
            (grow ? leaks.grown : leaks.as_is) = counts;
        }
        if (!grow || !with_vulkan)
            continue;
        auto vulkan = make_vulkan_tracer(scene, true, false);
        if (!vulkan.ok()) {
            std::cout << "skipped vulkan: " << vulkan.error().detail << "\n";
            continue;
        }
        for (const TrimMode mode : {TrimMode::Exact, TrimMode::Hybrid})
            expect_tight(count(**vulkan, **true_tracer, true_scene->pack.image, closed, views, mode, kVulkanPixels),
                         name + " vulkan");
    }
    return leaks;
}

enum class Moved { Faces, Pcurves };

/// Moves the loops of every face, or every pcurve by itself, by up to `most_mm`, and says so as the importer would.
/// Poles are where the surface says, and a seam moves with its face alone.
void move_pcurves(CadModel& model, Moved moved, double most_mm, double tolerance_mm)
{
    std::mt19937 rng(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (CadPart& part : model.parts) {
        for (CadEdge& edge : part.edges)
            edge.tolerance_mm = tolerance_mm;
        for (CadFace& face : part.faces) {
            face.tolerance_mm = tolerance_mm;
            double angle = 0, mm = 0;
            const auto draw = [&] {
                angle = std::numbers::pi * uniform(rng);
                mm = most_mm * uniform(rng);
            };
            draw();
            for (const CadLoop& loop : face.loops)
                for (const CadEdgeUse& use : loop)
                    if (use.degenerate)
                        mm = 0;
            for (CadLoop& loop : face.loops)
                for (CadEdgeUse& use : loop) {
                    const bool fixed = use.seam || use.degenerate;
                    use.gap_mm = fixed ? 0 : 2 * most_mm; // both neighbours'
                    if (moved == Moved::Pcurves && fixed)
                        continue;
                    if (moved == Moved::Pcurves)
                        draw();
                    const auto& p = use.pcurve.control_points[use.pcurve.control_points.size() / 2];
                    const SurfaceDerivatives s = evaluate(face.surface, p[0] / p[2], p[1] / p[2]);
                    for (auto& point : use.pcurve.control_points) {
                        point[0] += mm * std::cos(angle) / norm(s.du) * point[2];
                        point[1] += mm * std::sin(angle) / norm(s.dv) * point[2];
                    }
                }
        }
    }
}

class Leaks14 : public testing::TestWithParam<oracle::Solid> {};

TEST_P(Leaks14, NoRayPassesBetweenTheFacesOfAClosedSolid)
{
    keep_vulkan_loaded();
    const auto model = model_of(GetParam());
    ASSERT_TRUE(model) << "the kernel made no closed solid";
    measure(*model, *model, oracle::solid_name(GetParam()), 0, kPixels);
}

/// Leaks of a solid whose pcurves are off by up to 0.9 tolerances of 1e-3 of its size.
Leaks measure_moved(oracle::Solid solid, Moved moved, const std::string& how)
{
    keep_vulkan_loaded();
    constexpr double kTolerance_mm = 0.1;
    auto model = model_of(solid);
    if (!model) {
        ADD_FAILURE() << "the kernel made no closed solid";
        return {};
    }
    const CadModel truth = *model;
    move_pcurves(*model, moved, 0.9 * kTolerance_mm, kTolerance_mm);
    return measure(*model, truth, oracle::solid_name(solid) + how, kTolerance_mm, kMovedPixels);
}

TEST_P(Leaks14, NorWherePcurvesAreOffWithinTheTolerance)
{
    const Leaks leaks = measure_moved(GetParam(), Moved::Faces, " with loops moved");
    EXPECT_GT(leaks.as_is.outside.leaks + leaks.as_is.inside.leaks, 1000) << "the test shows nothing";
}

TEST_P(Leaks14, NorWhereEachPcurveIsOffByItself)
{
    const Leaks leaks = measure_moved(GetParam(), Moved::Pcurves, " with pcurves moved");
    EXPECT_GT(leaks.as_is.outside.leaks + leaks.as_is.inside.leaks, 0) << "the test shows nothing";
}

INSTANTIATE_TEST_SUITE_P(case_14, Leaks14, testing::ValuesIn(oracle::kSolids),
                         [](const testing::TestParamInfo<oracle::Solid>& info) {
                             std::string name = oracle::solid_name(info.param);
                             std::replace(name.begin(), name.end(), ' ', '_');
                             return name;
                         });

// Closed models as files have them, each of which leaks where its borders are left as they are. On the CPU: a driver
// takes longer to compile for a scene than the rest of the test
class RealModels14 : public testing::TestWithParam<const char*> {};

TEST_P(RealModels14, LeakNothing)
{
    const auto model = model_of(std::string(TRIMRAY_TESTS_DIR) + "/models/" + GetParam());
    ASSERT_TRUE(model);
    double tolerance_mm = 0;
    for (const CadPart& part : model->parts)
        for (const CadFace& face : part.faces)
            tolerance_mm = std::max(tolerance_mm, face.tolerance_mm);
    const Leaks leaks = measure(*model, *model, GetParam(), tolerance_mm, kMovedPixels, false);
    EXPECT_GT(leaks.as_is.outside.leaks + leaks.as_is.inside.leaks, 0) << "the test shows nothing";
}

INSTANTIATE_TEST_SUITE_P(case_14, RealModels14,
                         testing::Values("nozzle.stp", "io1-cm-214.stp", "M6-1x12-countersunk-screw.step"),
                         [](const testing::TestParamInfo<const char*>& info) {
                             const std::string file = info.param;
                             return file.substr(0, file.find_first_of("-."));
                         });

} // namespace
} // namespace trimray::hard
