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

namespace trimray {
namespace {

constexpr double kPi = std::numbers::pi;

/// The device's name.
class Certified : public testing::TestWithParam<const char*> {
protected:
    static void SetUpTestSuite() { keep_vulkan_loaded(); }

    bool on_cpu() const { return std::string(GetParam()) == "cpu"; }

    /// Traces a scene, on the software driver in smaller pictures, and expects the claims to hold and few pixels to be
    /// uncertified.
    void expect_honest(const std::shared_ptr<const Scene>& scene, std::initializer_list<Camera> cameras,
                       double most_uncertified)
    {
        const Result<std::unique_ptr<Tracer>> tracer =
            on_cpu() ? make_cpu_tracer(scene) : make_vulkan_tracer(scene, true, false);
        if (!tracer.ok() && tracer.error().code == ErrorCode::NoDevice)
            GTEST_SKIP() << "SKIPPED: " << tracer.error().detail;
        ASSERT_TRUE(tracer.ok()) << tracer.error().detail;
        const ClosestReference closest(scene->pack.image);
        uint64_t uncertified = 0, rays = 0;
        for (const Camera& camera : cameras) {
            RenderOptions options;
            options.width = on_cpu() ? 320 : 80;
            options.height = on_cpu() ? 240 : 60;
            options.camera = camera;
            RenderStats stats;
            const Result<Frame> frame = (*tracer)->render(options, stats);
            ASSERT_TRUE(frame.ok()) << frame.error().detail;
            const AgainstReference found = compare_with_reference(*frame, camera, closest);
            EXPECT_GT(found.both_hit, found.rays / 20) << "the view shows nothing";
            EXPECT_EQ(found.certified_wrong, 0u);
            EXPECT_EQ(found.not_finite, 0u);
            EXPECT_EQ(found.open, 0u);
            EXPECT_EQ(found.uncertified, stats.work.uncertified_pixels);
            for (const FaultyPixel& p : found.pixels)
                if (p.doubt == Doubt::None && p.fault != Fault::WrongFace)
                    ADD_FAILURE() << p.x << ", " << p.y << ": " << kFaultNames[size_t(p.fault)]
                                  << (p.certified ? ", certified" : "") << ", " << p.hair_px << " px from a rim, "
                                  << p.tracer_mm << " and " << p.reference_mm << " mm";
            uncertified += found.uncertified;
            rays += found.rays;
        }
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

INSTANTIATE_TEST_SUITE_P(OnEachTracer, Certified, testing::Values("cpu", "vulkan"),
                         [](const testing::TestParamInfo<const char*>& info) { return info.param; });

} // namespace
} // namespace trimray
