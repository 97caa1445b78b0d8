// Curvatures through the whole chain (file, model, pack bytes, tracer) against the CAD kernel's own, GeomLProp_SLProps
// at the kernel's own intersection of each ray.
#include "format/bezier_reference.h"
#include "tests/occt_models.h"
#include "tests/occt_oracle.h"
#include "tests/traced_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace trimray {
namespace {

constexpr uint32_t kWidth = 160, kHeight = 120;
constexpr double kFovDeg = 30;
constexpr double kRequired = 1e-4;   // of the larger curvature
constexpr double kSamePlace = 1e-6;  // of the diagonal: both met the same point
constexpr double kFlat = 1e-3;       // over the diagonal: what curves less is measured by this
constexpr double kSameNormal = 1e-4; // 1 - the cosine: elsewhere is another face's border, or a pole

std::string model_path(const std::string& name)
{
    return std::string(TRIMRAY_TESTS_DIR) + "/models/" + name;
}

/// A patch of a face in double, and where on it uv_face lies; nothing on native faces.
struct PatchInDouble {
    const PatchRecord& patch;
    reference::BezierReference surface;
    double u, v;
};
std::optional<PatchInDouble> patch_at(const PackImage& image, const FaceRecord& face,
                                      const std::array<double, 2>& uv_face)
{
    for (uint p = face.first_patch; p < face.first_patch + face.patch_count; ++p) {
        const PatchRecord& patch = image.patches[p];
        const double u = (uv_face[0] - double(patch.uv_offset[0])) / double(patch.uv_scale[0]);
        const double v = (uv_face[1] - double(patch.uv_offset[1])) / double(patch.uv_scale[1]);
        if ((patch.shape & 0xffu) == kKindBezier && std::abs(u - 0.5) <= 0.5 + 1e-6 && std::abs(v - 0.5) <= 0.5 + 1e-6)
            return PatchInDouble{patch, {patch, image.control_points.data(), 0, 0}, u, v};
    }
    return {};
}

/// Larger and smaller curvature of the pack's own patch, patch units, by the textbook: H +- sqrt(H^2 - K), second
/// derivatives by differences of first ones.
std::array<double, 2> curvatures_in_pack(const PatchInDouble& at)
{
    using namespace reference;
    constexpr double h = 1e-5;
    const auto derivative = [&](double du, double dv, Vec3 SurfacePoint::*of) {
        return (at.surface.evaluate(at.u + du, at.v + dv).*of - at.surface.evaluate(at.u - du, at.v - dv).*of) *
               (0.5 / h);
    };
    const SurfacePoint s = at.surface.evaluate(at.u, at.v);
    const Vec3 across = cross(s.du, s.dv), n = across * (-1 / length(across));
    const double L = dot(derivative(h, 0, &SurfacePoint::du), n), M = dot(derivative(0, h, &SurfacePoint::du), n),
                 N = dot(derivative(0, h, &SurfacePoint::dv), n);
    const double E = dot(s.du, s.du), F = dot(s.du, s.dv), G = dot(s.dv, s.dv), area = dot(across, across);
    const double mean = (E * N - 2 * F * M + G * L) / (2 * area), gaussian = (L * N - M * M) / area;
    const double spread = std::sqrt(std::max(mean * mean - gaussian, 0.0));
    return {mean + spread, mean - spread};
}

/// Bound of what single precision of a patch's control points makes of its curvatures, 1 / patch unit. With e_u the
/// bound of what S_u loses (PatchRecord::param), a degree times a difference of two points, S_uu, that times a
/// difference of two such differences, loses 2 (n - 1) e_u.
double lost_in_pack(const PatchInDouble& at)
{
    using namespace reference;
    const SurfacePoint s = at.surface.evaluate(at.u, at.v);
    const double n = at.patch.shape >> 8 & 0xffu, m = at.patch.shape >> 16 & 0xffu;
    const double eu = double(at.patch.param[0]), ev = double(at.patch.param[1]);
    const double g = length(s.du), h = length(s.dv), sine = length(cross(s.du, s.dv)) / (g * h);
    const double lost =
        2 * (n - 1) * eu / (g * g) + 4 * std::min(m * eu, n * ev) / (g * h) + 2 * (m - 1) * ev / (h * h);
    return lost / (sine * sine);
}

struct Compared {
    double error;   // of the worst of the four, of the larger curvature or its square
    double allowed; // kRequired, and what the pack has lost
    double in_pack; // how far off the larger and the smaller are from those of the pack's own patch in double
    std::string text;
};
using BySurface = std::map<std::string, std::vector<Compared>>;

/// Every pixel where both met the same point of a face that is as in the file, in two views.
BySurface compare_curvatures(const std::string& path, const std::shared_ptr<const Scene>& scene)
{
    BySurface found;
    std::string error;
    const auto occt = oracle::Oracle::load(path, {}, error);
    const auto cpu = make_cpu_tracer(scene);
    if (!occt || !cpu.ok()) {
        ADD_FAILURE() << path << ": " << error;
        return found;
    }
    const PackImage& image = scene->pack.image;
    for (const oracle::Point& towards : {oracle::Point{0.9, -1.3, 0.8}, oracle::Point{-1.1, 0.7, -0.6}}) {
        const oracle::View view =
            oracle::frame_box(occt->lo_mm(), occt->hi_mm(), towards, {0, 0, 1}, double(kWidth) / kHeight, kFovDeg);
        const std::vector<oracle::OracleHit> hits = occt->cast(oracle::view_rays(view, kWidth, kHeight));
        RenderOptions options;
        options.width = kWidth;
        options.height = kHeight;
        options.camera = {view.eye, view.target, view.up, view.fov_deg};
        options.error_px = 1e-4f;
        std::array<Frame, 4> frames;
        constexpr std::array<SurfaceMap, 4> kMaps = {SurfaceMap::CurvatureMax, SurfaceMap::CurvatureMin,
                                                     SurfaceMap::CurvatureMean, SurfaceMap::CurvatureGaussian};
        for (size_t m = 0; m < 4; ++m) {
            options.look.map.map = kMaps[m];
            frames[m] = picture(**cpu, options);
        }
        const Frame& frame = frames[0];
        for (size_t i = 0; i < frame.face.size(); ++i) {
            if (!hits[i].hit() || frame.face[i] < 0 ||
                !(std::abs(double(frame.depth_mm[i]) - hits[i].distance_mm) <= kSamePlace * occt->diagonal_mm()))
                continue;
            const FaceRecord& face = image.faces[size_t(frame.face[i])];
            if ((face.flags & kFaceApproximated) != 0)
                continue;
            oracle::Point normal{};
            for (size_t c = 0; c < 3; ++c)
                normal[c] = double(frame.normal[3 * i + c]);
            const auto kernel = occt->curvatures(hits[i], normal);
            if (!kernel)
                continue;
            double facing = 0;
            for (size_t c = 0; c < 3; ++c)
                facing += normal[c] * kernel->normal[c];
            if (std::abs(facing) < 1 - kSameNormal)
                continue;
            const double size =
                std::max({std::abs(kernel->larger), std::abs(kernel->smaller), kFlat / occt->diagonal_mm()});
            const std::array<double, 4> expected = {kernel->larger, kernel->smaller, kernel->mean, kernel->gaussian};
            Compared compared{};
            for (size_t m = 0; m < 4; ++m)
                compared.error = std::max(compared.error, std::abs(double(frames[m].map_value[i]) - expected[m]) /
                                                              (m == 3 ? size * size : size));
            std::array<double, 2> uv_face{};
            for (size_t c = 0; c < 2; ++c)
                uv_face[c] =
                    (double(frame.uv[2 * i + c]) - face.domain_lo[c]) / (face.domain_hi[c] - face.domain_lo[c]);
            compared.allowed = kRequired;
            if (const auto patch = patch_at(image, face, uv_face)) {
                const double per_mm = 1 / (double(patch->patch.scale) * image.parts[face.part].scale_mm);
                // a Gaussian curvature is the product of both
                compared.allowed += 2 * lost_in_pack(*patch) * per_mm / size;
                const auto [a, b] = curvatures_in_pack(*patch);
                const double turn = (face.flags & kFaceReversed) != 0 ? -per_mm : per_mm;
                compared.in_pack = std::max(std::abs(double(frames[0].map_value[i]) - std::max(turn * a, turn * b)),
                                            std::abs(double(frames[1].map_value[i]) - std::min(turn * a, turn * b))) /
                                   size;
            }
            compared.text =
                fmt::format("pixel {} of face {}: {:.9g} and {:.9g}, not {:.9g} and {:.9g}", i, frame.face[i],
                            frames[0].map_value[i], frames[1].map_value[i], expected[0], expected[1]);
            found[kernel->surface].push_back(compared);
        }
    }
    return found;
}

/// Prints how far off they are; with `strict` none may be off by more than kRequired; else by what the pack lost
/// besides, and all must be what the pack's patches have in double. Returns the kinds of surfaces seen.
std::set<std::string> expect_kernels_curvatures(const std::string& path, const std::shared_ptr<const Scene>& scene,
                                                bool strict)
{
    if (!scene)
        return {};
    std::set<std::string> kinds;
    for (auto& [surface, list] : compare_curvatures(path, scene)) {
        std::sort(list.begin(), list.end(), [](const Compared& a, const Compared& b) { return a.error < b.error; });
        size_t above = 0, wrong = 0;
        for (const Compared& c : list) {
            above += c.error > kRequired;
            const bool bad = c.error > (strict ? kRequired : c.allowed);
            if (bad && ++wrong < 5)
                ADD_FAILURE() << path << ", " << surface << ", " << c.text << ": off by " << c.error << ", allowed "
                              << c.allowed;
        }
        double worst = 0;
        for (const Compared& c : list)
            worst = std::max(worst, c.in_pack);
        std::cout << fmt::format("{}, {}: {} points, off by {:.2g} at the median, {:.2g} at 99 %, {:.2g} at most; {} "
                                 "above {}; {:.2g} from the pack's own patches\n",
                                 std::filesystem::path(path).filename().string(), surface, list.size(),
                                 list[list.size() / 2].error, list[list.size() * 99 / 100].error, list.back().error,
                                 above, kRequired, worst);
        EXPECT_EQ(wrong, 0u);
        EXPECT_TRUE(strict || worst <= kRequired) << surface << ": off by " << worst << " from the pack's own patches";
        kinds.insert(surface);
    }
    EXPECT_FALSE(kinds.empty()) << path << ": the view shows nothing";
    return kinds;
}

class CurvatureAgainstOcct : public testing::TestWithParam<const char*> {};

TEST_P(CurvatureAgainstOcct, WithinOneInTenThousand)
{
    expect_kernels_curvatures(model_path(GetParam()), scene_of_file(model_path(GetParam())), true);
}

std::string test_name(const testing::TestParamInfo<const char*>& info)
{
    std::string name = info.param;
    for (char& c : name)
        c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
    return name;
}

INSTANTIATE_TEST_SUITE_P(RealModels, CurvatureAgainstOcct,
                         testing::Values("nozzle.stp", // tori, cones, rational B-splines
                                         "unit_sphere.stp", "revolved_sphere.step", "io1-cm-214.stp", "sg1-c5-214.stp",
                                         "mayo_332_file.stp",
                                         "NIST_MBE_PMI_11.stp", // rational B-splines
                                         "NIST_MBE_PMI_3.stp",  // inches
                                         "abc_00000050.step",   // metres
                                         "M6-1x12-countersunk-screw.step"),
                         test_name);

// Wings of polynomial B-splines, so flat that of their second differences control points of single precision keep three
// digits: what is more than kRequired off must be what they have lost.
TEST(CurvatureAgainstOcctMade, FlatWingsLoseWhatTheirControlPointsLost)
{
    const std::string path = model_path("D150WithGuides_wing.igs");
    const auto kinds = expect_kernels_curvatures(path, scene_of_file(path), false);
    EXPECT_TRUE(kinds.contains("bspline"));
}

TEST(CurvatureAgainstOcctMade, EveryKindOfSurfaceThatIsNotApproximated)
{
    const TemporaryFile file("kinds.brep");
    ASSERT_TRUE(oracle::write_every_kind(file.path));
    ImportOptions options;
    options.proxy_deflection = 0;
    const Result<CadModel> model = import_cad(file.path, options, {});
    ASSERT_TRUE(model.ok());
    BuildReport report; // two of its faces are not smooth enough for any pack
    const auto kinds = expect_kernels_curvatures(file.path, scene_of_image(build_pack(*model, {}, report)), false);
    for (const char* kind : {"plane", "cylinder", "cone", "sphere", "torus", "bezier", "bspline", "extrusion"})
        EXPECT_TRUE(kinds.contains(kind)) << kind;
}

TEST(CurvatureAgainstOcctMade, PlacementsTurnedAndMirrored)
{
    const TemporaryFile file("placed.brep");
    ASSERT_TRUE(oracle::write_placed_copies(model_path("nozzle.stp"), file.path));
    expect_kernels_curvatures(file.path, scene_of_file(file.path), true);
}

TEST(CurvatureAgainstOcctMade, LeftHandedAxisSystems)
{
    const TemporaryFile file("left_handed.brep");
    ASSERT_TRUE(oracle::write_left_handed_copy(model_path("nozzle.stp"), file.path));
    expect_kernels_curvatures(file.path, scene_of_file(file.path), true);
}

} // namespace
} // namespace trimray
