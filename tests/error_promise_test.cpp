// What --error-px promises: pictures of CAD files keep it on both tracers, and what does not keep it is found out.
#include "runtime/derived_scene.h"
#include "runtime/error_promise.h"
#include "runtime/reference_rays.h"
#include "tests/traced_file.h"
#include "tests/traced_scenes.h"

#include <gtest/gtest.h>

#include <initializer_list>
#include <limits>

namespace trimray {
namespace {

std::shared_ptr<const Scene> scene_of_test_model(const std::string& name)
{
    return scene_of_file(TRIMRAY_TESTS_DIR "/models/" + name);
}

/// A view of a model and what the reference shows of it.
struct Judged {
    std::shared_ptr<const Scene> scene;
    RenderOptions options;
    Frame right;

    Judged(std::shared_ptr<const Scene> of, uint32_t width, uint32_t height)
        : scene(std::move(of)), options(from_iso(scene->pack.image, width, height)),
          right(picture(*make_reference_tracer(scene), options))
    {
    }

    PromiseKept judge(const Frame& traced, double error_px) const
    {
        return hold_to_promise(traced, right, options.camera, ClosestReference(scene->pack.image), error_px);
    }
};

TEST(error_promise, is_kept_by_both_tracers)
{
    for (const std::string name :
         {"io1-cm-214.stp", "nozzle.stp", "M6-1x12-countersunk-screw.step", "revolved_sphere.step"})
        for (const bool vulkan : {false, true}) {
            if (vulkan && name != "nozzle.stp") // a driver takes seconds to compile for a model
                continue;
            Judged view(scene_of_test_model(name), vulkan ? 64 : 160, vulkan ? 36 : 90);
            const auto tracer = tracer_of(view.scene, vulkan);
            if (!tracer)
                continue;
            for (const double error_px : {1.0, 0.02, 1e-3}) {
                view.options.error_px = float(error_px);
                const PromiseKept kept = view.judge(picture(*tracer, view.options), error_px);
                std::cout << fmt::format("{}, {}, {} px: {} at the middle, {} within\n", name,
                                         vulkan ? "vulkan" : "cpu", error_px, kept.at_centre, kept.within);
                EXPECT_EQ(kept.at_centre + kept.within, kept.pixels);
                for (const BrokenPixel& p : kept.broken)
                    ADD_FAILURE() << p.x << ", " << p.y << ": " << p.traced_mm << " instead of " << p.right_mm
                                  << " mm, shown within " << p.shown_within_px << " px";
            }
        }
}

/// What the reference shows beside each pixel's middle.
Frame shifted(const Judged& view, double by_px)
{
    const ReferenceRays rays(view.options.camera, view.options.width, view.options.height);
    const ClosestReference closest(view.scene->pack.image);
    Frame frame = view.right;
    for (uint32_t y = 0; y < frame.height; ++y)
        for (uint32_t x = 0; x < frame.width; ++x) {
            const ReferenceHit hit = closest.closest(rays.through(x + 0.5 + by_px, y + 0.5));
            const size_t i = size_t{y} * frame.width + x;
            frame.depth_mm[i] = hit.hit ? float(hit.distance_mm) : std::numeric_limits<float>::infinity();
            frame.face[i] = hit.hit ? int32_t(hit.face) : -1;
            frame.instance[i] = hit.hit ? int32_t(hit.instance) : -1;
        }
    return frame;
}

TEST(error_promise, a_picture_moved_by_part_of_a_pixel_keeps_that_part_and_no_less)
{
    const Judged view(scene_of_test_model("nozzle.stp"), 24, 18);
    const Frame moved = shifted(view, 0.3);
    const PromiseKept wide = view.judge(moved, 0.3);
    EXPECT_EQ(wide.broken.size(), 0u);
    EXPECT_GT(wide.within, 0u) << "no pixel shows the move";
    const PromiseKept narrow = view.judge(moved, 0.05);
    ASSERT_GT(narrow.broken.size(), 10u);
    EXPECT_EQ(narrow.at_centre + narrow.within + narrow.broken.size(), narrow.pixels);
    for (const BrokenPixel& p : narrow.broken) // tried at 0.1, 0.2, 0.4, ...
        EXPECT_LE(p.shown_within_px, 0.4) << p.x << ", " << p.y;
    ASSERT_NE(narrow.worst(), nullptr);
    EXPECT_EQ(narrow.worst()->shown_within_px, 0.4);
}

TEST(error_promise, a_hit_out_of_thin_air_and_a_depth_that_is_no_number_break_it)
{
    const Judged view(scene_of_test_model("unit_sphere.stp"), 32, 24);
    Frame forged = view.right;
    ASSERT_EQ(forged.face[0], -1);
    forged.face[0] = forged.instance[0] = 0;
    forged.depth_mm[0] = 1;
    const size_t middle = size_t{12} * 32 + 16;
    ASSERT_GE(forged.face[middle], 0);
    forged.depth_mm[middle] = std::numeric_limits<float>::quiet_NaN();
    const PromiseKept kept = view.judge(forged, 1);
    ASSERT_EQ(kept.broken.size(), 2u);
    EXPECT_EQ(kept.worst()->shown_within_px, std::numeric_limits<double>::infinity());
}

TEST(error_promise, is_broken_by_one_start_in_one_leaf_a_patch)
{
    Judged view(with_leaf_budget(*scene_of_test_model("nozzle.stp"), 1), 48, 27);
    view.options.closest = ClosestPolicy::Stochastic;
    EXPECT_GT(view.judge(draw(view.scene, view.options).frame, 0.02).broken.size(), 0u);
}

TEST(error_promise, is_broken_by_textures_that_are_too_small)
{
    constexpr double kBytes = 500;
    const auto scene = scene_of_test_model("io1-cm-214.stp");
    Judged view(with_textures(*scene, {.source = TrimSource::Mask, .layout = TrimLayout::Square}, kBytes), 64, 36);
    view.options.trim = TrimMode::Sdf;
    EXPECT_GT(view.judge(draw(view.scene, view.options).frame, 0.02).broken.size(), 0u);
}

} // namespace
} // namespace trimray
