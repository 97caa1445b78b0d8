// RenderOptions::specialise changes what a tracer compiles in, never the picture: with it and without it all bits are
// the same, on both tracers, whatever is asked for.
#include "runtime/differing_pixels.h"
#include "runtime/tracer.h"
#include "tests/compare_frames.h"
#include "tests/keep_vulkan_loaded.h"
#include "tests/traced_scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace trimray {
namespace {

struct Asked {
    std::string name;
    std::function<void(RenderOptions&)> ask;
};

void ask_for_a_shadow(RenderOptions& options)
{
    Light sun;
    sun.direction = {1, 2, -3};
    sun.shadows = true;
    options.look.lights = {sun};
}

const std::vector<Asked> kAsked = {
    {"nothing", [](RenderOptions&) {}},
    {"edges", [](RenderOptions& o) { o.edges = EdgeLines::All; }},
    {"a section",
     [](RenderOptions& o) {
         o.look.section.planes = {{{}, {1, 0, 0}}};
     }},
    {"a map", [](RenderOptions& o) { o.look.map.map = SurfaceMap::CurvatureMean; }},
    {"a shadow", ask_for_a_shadow},
};

std::shared_ptr<const Scene> scene_of_all_kinds()
{
    TracedScene builder = all_kinds();
    builder.place({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    builder.place({-1, 0, 0, 0, 0, 1, 0, 12, 0, 0, 1, 10}); // mirrored
    return builder.finish();
}

void expect_same_pictures(Tracer& tracer, const RenderOptions& view)
{
    for (const Asked& asked : kAsked) {
        RenderOptions options = view;
        asked.ask(options);
        RenderStats stats, late_stats;
        const Result<Frame> frame = tracer.render(options, stats);
        ASSERT_TRUE(frame.ok()) << asked.name << ": " << frame.error().detail;
        options.specialise = false;
        const Result<Frame> late = tracer.render(options, late_stats);
        ASSERT_TRUE(late.ok()) << asked.name << ": " << late.error().detail;
        EXPECT_EQ(differing_pixels(*frame, *late), 0u) << asked.name;
        EXPECT_TRUE(same_bits(frame->map_value, late->map_value)) << asked.name;
        EXPECT_EQ(stats.work.leaf_visits, late_stats.work.leaf_visits) << asked.name;
        const auto hits = std::count_if(frame->face.begin(), frame->face.end(), [](int32_t face) { return face >= 0; });
        EXPECT_GT(size_t(hits), frame->face.size() / 20) << asked.name << ": the view shows nothing";
    }
}

TEST(unspecialised, pictures_of_the_cpu_tracer_are_the_same)
{
    const auto tracer = make_cpu_tracer(scene_of_all_kinds());
    ASSERT_TRUE(tracer.ok());
    expect_same_pictures(**tracer, overview(48, 32));
}

TEST(unspecialised, pictures_through_vulkan_are_the_same)
{
    keep_vulkan_loaded();
    const auto tracer = make_vulkan_tracer(scene_of_all_kinds(), true, true);
    if (!tracer.ok() && tracer.error().code == ErrorCode::NoDevice)
        GTEST_SKIP() << "SKIPPED: no Vulkan driver";
    ASSERT_TRUE(tracer.ok());
    expect_same_pictures(**tracer, overview(48, 32));
}

} // namespace
} // namespace trimray
