// What `certified` claims, against the reference for closest hits: on both tracers a pixel that is certified is right,
// and no ray that meets a surface is said to miss it, where surfaces fold, touch and turn away.
#include "tests/against_reference.h"
#include "tests/keep_vulkan_loaded.h"
#include "tests/traced_scenes.h"

#include <gtest/gtest.h>

#include <initializer_list>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace trimray {
namespace {

constexpr double kPi = std::numbers::pi;

/// The device's name.
class Certified : public testing::TestWithParam<const char*> {
protected:
    static void SetUpTestSuite() { keep_vulkan_loaded(); }

    bool on_cpu() const { return std::string(GetParam()) == "cpu"; }

    /// Traces a scene, on the software driver in smaller pictures, and expects the claims to hold. Nothing if there is
    /// no such device.
    std::vector<AgainstReference> compared(const std::shared_ptr<const Scene>& scene,
                                           std::initializer_list<Camera> cameras)
    {
        std::vector<AgainstReference> all;
        const Result<std::unique_ptr<Tracer>> tracer =
            on_cpu() ? make_cpu_tracer(scene) : make_vulkan_tracer(scene, true, false);
        if (!tracer.ok()) {
            EXPECT_EQ(tracer.error().code, ErrorCode::NoDevice) << tracer.error().detail;
            return all;
        }
        const ClosestReference closest(scene->pack.image);
        for (const Camera& camera : cameras) {
            RenderOptions options;
            options.width = on_cpu() ? 320 : 80;
            options.height = on_cpu() ? 240 : 60;
            options.camera = camera;
            RenderStats stats;
            const Result<Frame> frame = (*tracer)->render(options, stats);
            EXPECT_TRUE(frame.ok());
            if (!frame.ok())
                return {};
            AgainstReference found = compare_with_reference(*frame, camera, closest);
            EXPECT_GT(found.both_hit, found.rays / 20) << "the view shows nothing";
            EXPECT_EQ(found.certified_wrong, 0u);
            EXPECT_EQ(found.not_finite, 0u);
            EXPECT_EQ(found.open, 0u);
            EXPECT_EQ(found.uncertified, stats.work.uncertified_pixels);
            all.push_back(std::move(found));
        }
        return all;
    }

    /// And expects all pixels to be right and few to be uncertified.
    void expect_honest(const std::shared_ptr<const Scene>& scene, std::initializer_list<Camera> cameras,
                       double most_uncertified)
    {
        uint64_t uncertified = 0, rays = 0;
        for (const AgainstReference& found : compared(scene, cameras)) {
            for (const FaultyPixel& p : found.pixels)
                if (p.doubt == Doubt::None && p.fault != Fault::WrongFace)
                    ADD_FAILURE() << p.x << ", " << p.y << ": " << kFaultNames[size_t(p.fault)]
                                  << (p.certified ? ", certified" : "") << ", " << p.hair_px << " px from a rim, "
                                  << p.tracer_mm << " and " << p.reference_mm << " mm";
            uncertified += found.uncertified;
            rays += found.rays;
        }
        if (rays == 0)
            GTEST_SKIP() << "SKIPPED: no such device";
        EXPECT_LE(double(uncertified), most_uncertified * double(rays)) << uncertified << " of " << rays;
    }
};

/// Patches that pass over themselves: rays meet them up to five times.
TracedScene folded_patches()
{
    TracedScene scene;
    std::mt19937 random(3);
    const auto uniform = [&random](double lo, double hi) {
        return std::uniform_real_distribution<double>(lo, hi)(random);
    };
    for (int k = 0; k < 12; ++k) {
        const int degree = 3 + k % 4;
        const bool rational = k % 2 == 1;
        scene.add_bezier(degree, degree, rational, 0.2, {0.45 * (k % 4) - 0.68, 0.45 * (k / 4) - 0.45, 0});
        for (int i = 0; i <= degree; ++i) {
            for (int j = 0; j <= degree; ++j) {
                const double w = rational ? uniform(0.4, 1.6) : 1;
                const double x = 2.0 * i / degree - 1 + uniform(-0.7, 0.7), y = 2.0 * j / degree - 1;
                for (const double c : {x * 0.6, y, uniform(-0.8, 0.8)})
                    scene.image.control_points.push_back(static_cast<float>(w * c));
                if (rational)
                    scene.image.control_points.push_back(static_cast<float>(w));
            }
        }
    }
    return scene;
}

TEST_P(Certified, HoldsOnSurfacesOfEveryKind)
{
    expect_honest(all_kinds().finish(), {kOverview, {{-14, -20, 6}, {0, 0, 1}, {0, 0, 1}, 45}}, 0.02);
}

TEST_P(Certified, HoldsOnPatchesThatFold)
{
    expect_honest(folded_patches().finish(),
                  {{{4, -12, 20}, {0, 0, 0}, {0, 0, 1}, 45}, {{20, 4, 3}, {0, 0, 0}, {0, 0, 1}, 45}}, 0.2);
}

TEST_P(Certified, HoldsWhereRaysTouchSpheresAndTori)
{
    // a camera so far away that rays are nearly parallel; rims of spheres and tori run along rows of pixels
    TracedScene scene;
    for (int k = 0; k < 4; ++k) {
        scene.add(kKindSphere, 0.2, {0.44 * k - 0.66, 0, 0.3}, {kPi, kPi / 2});
        PatchRecord& torus = scene.add(kKindTorus, 0.15, {0.44 * k - 0.66, 0, -0.3}, {kPi, kPi});
        torus.param[1] = 0.02f + 0.1f * static_cast<float>(k);
    }
    const auto made = scene.finish();
    expect_honest(made, {{{0, -4000, 0}, {0, 0, 0}, {0, 0, 1}, 0.3}, {{0, -40, 0.1}, {0, 0, 0}, {0, 0, 1}, 28}}, 0.02);
}

TEST_P(Certified, HoldsWhereAPixelIsSmallerThanRounding)
{
    // a hill of 20 mm, from so near that rounding is some pixels, at its side and at a hole in its middle
    TracedScene scene;
    scene.add_bezier(3, 3, false, 1, {0, 0, 0});
    for (int i = 0; i <= 3; ++i)
        for (int j = 0; j <= 3; ++j)
            for (const double c :
                 {(2.0 / 3 * i - 1) * 0.9, 2.0 / 3 * j - 1, (i % 3 == 0 || j % 3 == 0 ? 0 : 0.3) + 0.13 * j})
                scene.image.control_points.push_back(static_cast<float>(c));
    scene.trim(0, {shapes::polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}}), shapes::circle(0.5, 0.5, 0.2, 0.2)});
    const auto found = compared(scene.finish(), {{{9.00003, 3, 2.5353}, {9, 3, 2.535}, {0, 1, 0}, 45},
                                                 {{3.60003, 0, 3.3678}, {3.6, 0, 3.3675}, {0, 1, 0}, 45}});
    if (found.empty())
        GTEST_SKIP() << "SKIPPED: no such device";
    for (const AgainstReference& view : found) {
        uint64_t wrong = 0;
        for (const uint64_t faults : view.faults)
            wrong += faults;
        EXPECT_GT(wrong, 0u) << "not near enough to tell";
        EXPECT_GT(view.both_hit - view.uncertified, view.rays / 100) << "and yet something is certain";
    }
}

INSTANTIATE_TEST_SUITE_P(OnEachTracer, Certified, testing::Values("cpu", "vulkan"),
                         [](const testing::TestParamInfo<const char*>& info) { return info.param; });

} // namespace
} // namespace trimray
