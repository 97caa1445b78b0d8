// Moving cameras: pictures that begin from the last one's hits are those made without, bit for bit, wherever the camera
// goes. Through Vulkan's software driver where there is no other, with the validation layers.
#include "runtime/tracer.h"
#include "runtime/vk_device.h"
#include "tests/compare_frames.h"
#include "tests/keep_vulkan_loaded.h"
#include "tests/traced_scenes.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

namespace trimray {
namespace {

struct Picture {
    Frame frame;
    RenderStats stats;
};

class moving : public testing::Test {
protected:
    static void SetUpTestSuite() { keep_vulkan_loaded(); }
    void SetUp() override { messages_before_ = vk_validation_message_count(); }
    void TearDown() override { EXPECT_EQ(vk_validation_message_count(), messages_before_); }

    /// False where there is no driver; then the test is skipped.
    bool trace(const std::shared_ptr<const Scene>& scene)
    {
        auto made = make_vulkan_tracer(scene, true, true);
        if (!made.ok() && made.error().code == ErrorCode::NoDevice)
            return false;
        EXPECT_TRUE(made.ok()) << made.error().where << ": " << made.error().detail;
        tracer_ = made.ok() ? std::move(*made) : nullptr;
        return tracer_ != nullptr;
    }

    Picture picture(RenderOptions options, bool reuse)
    {
        options.reuse_last = reuse;
        Picture made;
        Result<Frame> frame = tracer_->render(options, made.stats);
        EXPECT_TRUE(frame.ok()) << frame.error().where << ": " << frame.error().detail;
        if (frame.ok())
            made.frame = std::move(*frame);
        return made;
    }

    /// One picture made both ways, which are expected to be the same. `reused`: whether hits of one before are
    /// expected. Returns how many leaf visits reuse saves.
    int64_t expect_same_picture(const RenderOptions& options, bool reused, const std::string& what)
    {
        const Picture plain = picture(options, false), reusing = picture(options, true);
        EXPECT_FALSE(plain.stats.reused_last) << what;
        EXPECT_EQ(reusing.stats.reused_last, reused) << what;
        const Frame &a = plain.frame, &b = reusing.frame;
        EXPECT_TRUE(same_bits(a.rgba, b.rgba)) << what;
        EXPECT_TRUE(same_bits(a.depth_mm, b.depth_mm)) << what;
        EXPECT_TRUE(same_bits(a.normal, b.normal)) << what;
        EXPECT_TRUE(same_bits(a.uv, b.uv)) << what;
        EXPECT_TRUE(same_bits(a.face, b.face)) << what;
        EXPECT_TRUE(same_bits(a.instance, b.instance)) << what;
        EXPECT_TRUE(same_bits(a.certified, b.certified)) << what;
        const auto hits = a.face.size() - size_t(std::count(a.face.begin(), a.face.end(), -1));
        EXPECT_GT(hits, a.face.size() / 20) << what << ": the view shows nothing";
        return int64_t(plain.stats.work.leaf_visits) - int64_t(reusing.stats.work.leaf_visits);
    }

    /// A camera that begins, stands still, turns about the origin, comes near, jumps behind and tips over. Returns how
    /// many leaf visits reuse saves while it stands still.
    int64_t expect_same_pictures(RenderOptions options)
    {
        expect_same_picture(options, false, "first");
        const int64_t saved = expect_same_picture(options, true, "standing still");
        EXPECT_GE(saved, 0) << "each ray begins with the leaf that it hits";
        for (const double degrees : {0.5, 2.0, 10.0, 170.0}) {
            options.camera.eye = turned(options.camera.eye, degrees);
            expect_same_picture(options, true, fmt::format("turned by {} degrees", degrees));
        }
        for (double& e : options.camera.eye)
            e *= 0.7;
        expect_same_picture(options, true, "nearer");
        options.camera.up = {0, 0, -1};
        expect_same_picture(options, true, "upside down");
        std::swap(options.camera.eye, options.camera.target);
        options.camera.fov_deg = 90;
        expect_same_picture(options, true, "back from the middle");
        return saved;
    }

    static std::array<double, 3> turned(const std::array<double, 3>& eye, double degrees)
    {
        const double angle = degrees * std::numbers::pi / 180, c = std::cos(angle), s = std::sin(angle);
        return {c * eye[0] - s * eye[1], s * eye[0] + c * eye[1], eye[2]};
    }

    std::unique_ptr<Tracer> tracer_;

private:
    uint64_t messages_before_ = 0;
};

#define TRACE_OR_SKIP(scene)                                                                                           \
    if (!trace(scene))                                                                                                 \
    GTEST_SKIP() << "SKIPPED: no Vulkan driver"

TEST_F(moving, pictures_of_all_kinds_of_surfaces_are_the_same)
{
    TracedScene builder = all_kinds();
    builder.place({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    builder.place({-1, 0, 0, 0, 0, 1, 0, 12, 0, 0, 1, 10}); // mirrored
    TRACE_OR_SKIP(builder.finish());
    expect_same_pictures(overview(160, 90));
}

TEST_F(moving, pictures_of_a_wave_are_the_same)
{
    TracedScene builder;
    builder.add_wave(9, {0, 0, 0}, 0.8f);
    TRACE_OR_SKIP(builder.finish());
    RenderOptions options = overview(128, 96);
    options.camera.eye = {-28, 9, 11}; // from beside, so that most rays meet it several times
    EXPECT_GT(expect_same_pictures(options), 0);
}

TEST_F(moving, pictures_of_rims_are_the_same)
{
    TRACE_OR_SKIP(slab(kFaceRims));
    expect_same_pictures(overview(160, 90));
}

TEST_F(moving, a_picture_of_another_size_begins_anew)
{
    TRACE_OR_SKIP(slab(0));
    for (const uint32_t width : {64u, 96u, 64u, 96u}) {
        expect_same_picture(overview(width, 48), false, "another size");
        expect_same_picture(overview(width, 48), true, "the same size");
    }
}

TEST_F(moving, frames_of_one_picture_begin_from_the_same_hits)
{
    TRACE_OR_SKIP(slab(0));
    RenderOptions options = overview(96, 54);
    picture(options, true);
    options.frames = 3;
    options.camera.eye = turned(options.camera.eye, 3);
    const WorkCounts thrice = picture(options, true).stats.work;
    options.frames = 1;
    options.camera = kOverview;
    picture(options, true);
    options.camera.eye = turned(options.camera.eye, 3);
    const WorkCounts once = picture(options, true).stats.work;
    EXPECT_EQ(once.node_visits, thrice.node_visits);
    EXPECT_EQ(once.leaf_visits, thrice.leaf_visits);
    EXPECT_EQ(once.newton_steps, thrice.newton_steps);
}

TEST_F(moving, stochastic_frames_and_the_cpu_tracer_reuse_nothing)
{
    RenderOptions options = overview(64, 48);
    options.reuse_last = true;
    EXPECT_FALSE(draw(slab(0), options).stats.reused_last);
    TRACE_OR_SKIP(slab(0));
    options.closest = ClosestPolicy::Stochastic;
    for (int i = 0; i < 2; ++i)
        EXPECT_FALSE(picture(options, true).stats.reused_last);
}

} // namespace
} // namespace trimray
