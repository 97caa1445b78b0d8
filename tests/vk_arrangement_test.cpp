// Placements hidden and moved apart through Vulkan: as the CPU tracer shows them, and as packs without what is hidden.
// On the software driver where there is no other, with the validation layers.
#include "runtime/vk_device.h"
#include "tests/compare_frames.h"
#include "tests/keep_vulkan_loaded.h"
#include "tests/kit_scene.h"

#include <gtest/gtest.h>

namespace trimray {
namespace {

class vk_arrangement : public testing::Test {
protected:
    static void SetUpTestSuite() { keep_vulkan_loaded(); }
    void SetUp() override
    {
        messages_before_ = vk_validation_message_count();
        auto made = make_vulkan_tracer(kit_of({0, 1, 2, 3}), true, true);
        if (!made.ok() && made.error().code == ErrorCode::NoDevice)
            GTEST_SKIP() << "SKIPPED: " << made.error().detail;
        ASSERT_TRUE(made.ok()) << made.error().where << ": " << made.error().detail;
        tracer_ = std::move(*made);
    }
    void TearDown() override { EXPECT_EQ(vk_validation_message_count(), messages_before_); }

    Frame render(const RenderOptions& options, RenderStats* stats = nullptr)
    {
        RenderStats own;
        Result<Frame> frame = tracer_->render(options, stats ? *stats : own);
        EXPECT_TRUE(frame.ok()) << frame.error().where << ": " << frame.error().detail;
        return frame.ok() ? std::move(*frame) : Frame{};
    }

    /// By the CPU tracer, which has tests of its own.
    static Frame expected(const RenderOptions& options) { return draw(kit_of({0, 1, 2, 3}), options).frame; }

    std::unique_ptr<Tracer> tracer_;

private:
    uint64_t messages_before_ = 0;
};

TEST_F(vk_arrangement, is_the_cpu_tracers)
{
    for (const Arrangement& asked : {Arrangement{{}, {"lid"}, 0}, Arrangement{{"rings"}, {}, 0},
                                     Arrangement{{}, {}, 1.5}, Arrangement{{}, {"base"}, 0.5}, Arrangement{}}) {
        RenderOptions options = kit_picture(96, 64);
        options.look.arrangement = asked;
        const Frame frame = render(options);
        const Disagreement d = compare(expected(options), frame, options);
        EXPECT_GT(d.hits, 200);
        expect_small(d, int(options.width * options.height));
    }
}

TEST_F(vk_arrangement, rays_from_elsewhere_follow_it)
{
    RenderOptions options = kit_picture(64, 48);
    Light sun;
    sun.direction = {1, 2, -3};
    sun.shadows = true;
    options.look.lights = {sun};
    for (const Arrangement& asked : {Arrangement{}, Arrangement{{}, {"lid"}, 1}}) {
        options.look.arrangement = asked; // what the device holds of the last one must go
        const Frame frame = render(options), right = expected(options);
        size_t unlike = 0;
        for (size_t i = 0; i < frame.face.size(); ++i)
            unlike += std::abs(frame.rgba[4 * i] - right.rgba[4 * i]) > 1e-2f;
        EXPECT_LE(unlike, frame.face.size() / 200);
        EXPECT_GT(count_hits(frame), 200);
    }
}

TEST_F(vk_arrangement, nothing_left_is_an_empty_picture)
{
    RenderOptions options = kit_picture(40, 30);
    options.look.arrangement.hide = {"plates", "rings"};
    EXPECT_EQ(count_hits(render(options)), 0);
}

TEST_F(vk_arrangement, hits_of_what_is_hidden_now_are_not_reused)
{
    RenderOptions options = kit_picture(64, 48);
    options.reuse_last = true;
    render(options);
    RenderStats stats;
    options.look.arrangement.hide = {"lid"};
    const Frame frame = render(options, &stats);
    EXPECT_FALSE(stats.reused_last);
    EXPECT_EQ(std::count(frame.instance.begin(), frame.instance.end(), 2), 0);
    render(options, &stats);
    EXPECT_TRUE(stats.reused_last) << "the arrangement is the same";
}

} // namespace
} // namespace trimray
