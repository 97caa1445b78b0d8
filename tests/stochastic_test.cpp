// The paper's own method for closest hits: hits that only ever come nearer, what its first frame loses and its later
// ones find, on both tracers.
#include "runtime/closest_errors.h"
#include "runtime/derived_scene.h"
#include "runtime/stochastic_frames.h"
#include "tests/compare_frames.h"
#include "tests/keep_vulkan_loaded.h"
#include "tests/traced_scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace trimray {
namespace {

/// A wave seen from its side, so that most rays meet it several times.
RenderOptions beside_the_wave()
{
    RenderOptions options;
    options.width = 128;
    options.height = 96;
    options.camera = {{-28, 9, 11}, {0, 0, 0}, {0, 0, 1}, 35};
    return options;
}

std::shared_ptr<const Scene> wave()
{
    TracedScene scene;
    scene.add_wave(9, {0, 0, 0}, 0.8f);
    return scene.finish();
}

Drawn stochastic(const std::shared_ptr<const Scene>& scene, RenderOptions options, uint32_t frames)
{
    options.closest = ClosestPolicy::Stochastic;
    options.frames = frames;
    return draw(scene, options);
}

TEST(stochastic, starts_in_the_middle_and_then_anywhere)
{
    EXPECT_EQ(start_of_frame(0), (std::array{0.5f, 0.5f}));
    constexpr uint32_t kDraws = 4096, kCells = 8;
    std::array<int, kCells * kCells> drawn{};
    for (uint32_t frame = 1; frame <= kDraws; ++frame) {
        const auto [u, v] = start_of_frame(frame);
        ASSERT_TRUE(u >= 0 && u < 1 && v >= 0 && v < 1);
        ++drawn[size_t(u * kCells) * kCells + size_t(v * kCells)];
    }
    for (const int in_cell : drawn) // 64 expected in each, 8 is its standard deviation
        EXPECT_NEAR(in_cell, int(kDraws / drawn.size()), 32);
}

TEST(stochastic, a_pixel_changes_only_when_its_hit_is_nearer)
{
    for (const auto& scene : {with_leaf_budget(*wave(), 1), all_kinds().finish()}) {
        RenderOptions options = beside_the_wave();
        options.width /= 2;
        options.height /= 2;
        Frame before = stochastic(scene, options, 1).frame;
        size_t nearer = 0;
        for (const uint32_t frames : {2u, 3u, 5u, 8u}) {
            Frame after = stochastic(scene, options, frames).frame;
            for (size_t i = 0; i < after.depth_mm.size(); ++i) {
                ASSERT_LE(after.depth_mm[i], before.depth_mm[i]) << "frame " << frames << ", pixel " << i;
                nearer += after.depth_mm[i] < before.depth_mm[i];
            }
            before = std::move(after);
        }
        if (scene->pack.image.faces.size() == 1) {
            EXPECT_GT(nearer, 25u);
        }
    }
}

TEST(stochastic, the_first_frame_loses_hits_that_later_ones_find)
{
    const auto scene = wave(), one_leaf = with_leaf_budget(*scene, 1);
    ASSERT_EQ(one_leaf->pack.image.leaves.size(), 1u);
    const RenderOptions options = beside_the_wave();
    Result<ReferencePicture> reference = ReferencePicture::make(scene, options);
    ASSERT_TRUE(reference.ok()) << reference.error().detail;
    const auto wrong_after = [&](uint32_t frames) {
        return reference->errors(stochastic(one_leaf, options, frames).frame).wrong();
    };
    const uint64_t pixels = uint64_t{options.width} * options.height;
    const uint64_t first = wrong_after(1), tenth = wrong_after(10), last = wrong_after(100);
    std::cout << "wrong pixels of " << pixels << ": " << first << " in frame 1, " << tenth << " in frame 10, " << last
              << " in frame 100\n";
    EXPECT_GT(first, pixels / 20);
    EXPECT_LT(tenth, first / 2);
    EXPECT_LT(last, pixels / 500);
    const uint64_t certified = reference->errors(draw(scene, options).frame).wrong();
    EXPECT_EQ(certified, 0u) << "one frame, with the leaves that it asks for";
}

TEST(stochastic, claims_nothing)
{
    const auto scene = all_kinds().finish();
    RenderOptions options = overview(94, 61);
    for (const uint32_t frames : {1u, 3u}) {
        const Drawn drawn = stochastic(scene, options, frames);
        EXPECT_EQ(std::count(drawn.frame.certified.begin(), drawn.frame.certified.end(), 1), 0);
        EXPECT_EQ(drawn.stats.work.uncertified_pixels, 94u * 61u);
        EXPECT_EQ(drawn.stats.frame_ms.size(), frames);
    }
}

TEST(stochastic, certified_frames_are_all_the_same)
{
    const auto scene = all_kinds().finish();
    RenderOptions options = overview(94, 61);
    const Drawn one = draw(scene, options);
    options.frames = 3;
    const Drawn three = draw(scene, options);
    EXPECT_TRUE(same_bits(one.frame.depth_mm, three.frame.depth_mm));
    EXPECT_TRUE(same_bits(one.frame.rgba, three.frame.rgba));
    EXPECT_TRUE(same_bits(one.frame.certified, three.frame.certified));
    EXPECT_EQ(one.stats.work.newton_steps, three.stats.work.newton_steps);
}

TEST(stochastic, gives_the_same_bits_on_every_instruction_set_and_any_number_of_threads)
{
    const auto scene = with_leaf_budget(*all_kinds().finish(), 1);
    RenderOptions options = overview(94, 61);
    options.closest = ClosestPolicy::Stochastic;
    options.frames = 5;
    const Drawn first = draw(scene, options);
    for (const char* set : {"avx512", "avx2", "sse4"}) {
        if (!make_cpu_tracer(scene, set).ok())
            continue;
        for (const uint32_t threads : {1u, 2u}) {
            options.threads = threads;
            const Drawn other = draw(scene, options, set);
            EXPECT_TRUE(same_bits(first.frame.depth_mm, other.frame.depth_mm)) << set;
            EXPECT_TRUE(same_bits(first.frame.rgba, other.frame.rgba)) << set;
            EXPECT_TRUE(same_bits(first.frame.face, other.frame.face)) << set;
            EXPECT_EQ(first.stats.work.newton_steps, other.stats.work.newton_steps) << set;
        }
    }
}

TEST(stochastic, both_tracers_draw_the_same_starts)
{
    keep_vulkan_loaded();
    const auto scene = with_leaf_budget(*wave(), 1);
    auto vulkan = make_vulkan_tracer(scene, true, false);
    if (!vulkan.ok() && vulkan.error().code == ErrorCode::NoDevice)
        GTEST_SKIP() << "SKIPPED: " << vulkan.error().detail;
    ASSERT_TRUE(vulkan.ok()) << vulkan.error().detail;
    for (const uint32_t frames : {1u, 4u}) {
        RenderOptions options = beside_the_wave();
        options.closest = ClosestPolicy::Stochastic;
        options.frames = frames;
        RenderStats stats;
        const Result<Frame> gpu = (*vulkan)->render(options, stats);
        ASSERT_TRUE(gpu.ok()) << gpu.error().detail;
        const Drawn cpu = draw(scene, options);
        const int pixels = int(options.width * options.height);
        EXPECT_EQ(int(stats.work.uncertified_pixels), pixels);
        EXPECT_EQ(stats.frame_ms.size(), frames);
        int hits = 0, differ = 0;
        for (size_t i = 0; i < gpu->face.size(); ++i) {
            hits += gpu->face[i] >= 0;
            const bool near = std::abs(cpu.frame.depth_mm[i] - gpu->depth_mm[i]) <= 1e-5f * cpu.frame.depth_mm[i];
            differ += cpu.frame.face[i] != gpu->face[i] || (gpu->face[i] >= 0 && !near);
        }
        std::cout << "frames " << frames << ": " << differ << " of " << pixels << " pixels differ\n";
        EXPECT_GT(hits, pixels / 8);
        EXPECT_LE(differ, pixels / 1000) << "far from its roots Newton is chaotic: rounding decides where it ends";
        const double steps = double(cpu.stats.work.newton_steps);
        EXPECT_NEAR(double(stats.work.newton_steps), steps, 0.001 * steps);
    }
}

} // namespace
} // namespace trimray
