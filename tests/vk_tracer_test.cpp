// The Vulkan tracer on whatever driver is there (a software one in CI), with the validation layers, whose messages are
// errors. The CPU tracer is what it must agree with; where both could be wrong alike, a sphere is computed by hand.
#include "format/derive.h"
#include "format/derive_kd.h"
#include "runtime/tracer.h"
#include "runtime/vk_buffer.h"
#include "runtime/vk_device.h"
#include "tests/compare_frames.h"
#include "tests/keep_vulkan_loaded.h"
#include "tests/traced_scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <string>

namespace trimray {
namespace {

RenderOptions small_picture(std::array<double, 3> eye, std::array<double, 3> target = {0, 0, 0})
{
    RenderOptions options;
    options.width = 160;
    options.height = 90;
    options.camera.eye = eye;
    options.camera.target = target;
    return options;
}

class vk_tracer : public testing::Test {
protected:
    static void SetUpTestSuite() { keep_vulkan_loaded(); }
    void SetUp() override
    {
        messages_before_ = vk_validation_message_count();
        const auto device = VulkanDevice::create(true, true);
        if (!device.ok() && device.error().code == ErrorCode::NoDevice)
            GTEST_SKIP() << "SKIPPED: " << device.error().detail;
    }
    // those at destruction included
    void TearDown() override { EXPECT_EQ(vk_validation_message_count(), messages_before_); }

    static std::unique_ptr<Tracer> make(const std::shared_ptr<const Scene>& scene)
    {
        auto tracer = make_vulkan_tracer(scene, true, true);
        EXPECT_TRUE(tracer.ok()) << tracer.error().where << ": " << tracer.error().detail;
        return tracer.ok() ? std::move(*tracer) : nullptr;
    }
    static Frame render(Tracer& tracer, const RenderOptions& options, RenderStats* stats = nullptr)
    {
        RenderStats own;
        Result<Frame> frame = tracer.render(options, stats ? *stats : own);
        EXPECT_TRUE(frame.ok()) << frame.error().where << ": " << frame.error().detail;
        return frame.ok() ? std::move(*frame) : Frame{};
    }

    static void expect_agreement(Tracer& vulkan, const std::shared_ptr<const Scene>& scene,
                                 const RenderOptions& options, int least_hits)
    {
        auto cpu = make_cpu_tracer(scene);
        ASSERT_TRUE(cpu.ok()) << cpu.error().detail;
        const Frame expected = render(**cpu, options);
        const Frame actual = render(vulkan, options);
        ASSERT_EQ(expected.face.size(), actual.face.size());
        const Disagreement d = compare(expected, actual, options);
        EXPECT_GE(d.hits, least_hits);
        expect_small(d, int(options.width * options.height));
    }

private:
    uint64_t messages_before_ = 0;
};

// Trims only: drivers compile fewer kinds sooner.
TracedScene trimmed_planes()
{
    TracedScene scene;
    scene.add(kKindPlane, 1, {0, 0, -0.2}, {0.9, 0.6});
    scene.add(kKindPlane, 1, {0, 0, 0.2}, {0.9, 0.6});
    scene.trim(0, {shapes::polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}}), shapes::circle(0.7, 0.4, 0.12, 0.2),
                   shapes::star(0.25, 0.3, 0.15, 0.06, 5)});
    scene.trim(1, {shapes::gear(0.5, 0.5, 0.49, 0.4, 12), shapes::circle(0.5, 0.5, 0.3, 0.2)});
    return scene;
}

TEST_F(vk_tracer, meets_a_sphere_where_it_is)
{
    TracedScene builder;
    builder.add(kKindSphere, 0.7, {0, 0, 0}, {std::numbers::pi, std::numbers::pi / 2});
    const auto tracer = make(builder.finish());
    ASSERT_TRUE(tracer);
    const RenderOptions options = small_picture({20, -30, 15});
    const Frame frame = render(*tracer, options);
    ASSERT_EQ(frame.width, options.width);
    const CameraRays rays = camera_rays(options.camera, options.width, options.height);
    const double radius = 10 * double(0.7f); // mm; the patch's scale is a float
    int hits = 0, wrong = 0;
    double worst = 0;
    for (uint32_t y = 0; y < options.height; ++y) {
        for (uint32_t x = 0; x < options.width; ++x) {
            // |e + t d| = r, |d| = 1
            double dd = 0, ed = 0, ee = 0;
            for (size_t i = 0; i < 3; ++i) {
                const double d = rays.corner[i] + (x + 0.5) * rays.step_x[i] + (y + 0.5) * rays.step_y[i];
                dd += d * d;
                ed += rays.eye[i] * d;
                ee += rays.eye[i] * rays.eye[i];
            }
            const double b = ed / std::sqrt(dd), quarter = b * b - (ee - radius * radius);
            const double got = double(frame.depth_mm[y * options.width + x]);
            wrong += (quarter >= 0) != std::isfinite(got);
            if (quarter < 0 || !std::isfinite(got))
                continue;
            ++hits;
            worst = std::max(worst, std::abs(got / (-b - std::sqrt(quarter)) - 1));
        }
    }
    EXPECT_GT(hits, 2000);
    EXPECT_EQ(wrong, 0);
    EXPECT_LT(worst, 1e-6);
}

TEST_F(vk_tracer, agrees_with_the_cpu_tracer_on_all_kinds_of_surfaces_and_trims)
{
    TracedScene builder = all_kinds();
    builder.place({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    builder.place({-1, 0, 0, 0, 0, 1, 0, 12, 0, 0, 1, 10});          // mirrored
    builder.place({0, -0.5, 0, -12, 0.5, 0, 0, -4, 0, 0, 0.75, -6}); // turned and unevenly scaled
    const auto scene = builder.finish();
    const auto tracer = make(scene);
    ASSERT_TRUE(tracer);
    expect_agreement(*tracer, scene, small_picture({20, -40, 25}), 2500);
    expect_agreement(*tracer, scene, small_picture({-3, 2, 18}), 2500);
    expect_agreement(*tracer, scene, small_picture({0.5, 0.5, 1}, {-5, 3, 0}), 2500); // from inside
    RenderOptions narrow = small_picture({2e5, -4e5, 3e5}); // far away, looking through a telescope
    narrow.camera.fov_deg = 0.003;
    expect_agreement(*tracer, scene, narrow, 2500);
}

TEST_F(vk_tracer, agrees_with_the_cpu_tracer_on_distance_textures)
{
    const auto scene = trimmed_planes().finish();
    const auto tracer = make(scene);
    ASSERT_TRUE(tracer);
    RenderOptions options = small_picture({8, -16, 20});
    options.trim = TrimMode::Sdf;
    expect_agreement(*tracer, scene, options, 2500);
}

TEST_F(vk_tracer, kd_trims_answer_as_exact_ones_and_as_the_cpu_tracers)
{
    const auto scene = trimmed_planes().finish();
    const auto tracer = make(scene);
    ASSERT_TRUE(tracer);
    RenderOptions options = small_picture({8, -16, 20});
    RenderStats exact_stats, kd_stats;
    const Frame exact = render(*tracer, options, &exact_stats);
    EXPECT_EQ(exact_stats.kd_bytes, 0u);
    options.trim = TrimMode::Kd;
    const Frame kd = render(*tracer, options, &kd_stats);
    EXPECT_EQ(exact.face, kd.face);
    EXPECT_EQ(exact.depth_mm, kd.depth_mm);
    EXPECT_EQ(kd_stats.trim, TrimMode::Kd);
    EXPECT_EQ(static_cast<double>(kd_stats.kd_bytes), kd_trim_bytes(scene->pack.image));
    EXPECT_GT(kd_stats.work.curve_tests, 0u);
    EXPECT_LT(kd_stats.work.curve_tests, exact_stats.work.curve_tests);
    expect_agreement(*tracer, scene, options, 2500);
}

TEST_F(vk_tracer, hybrid_trims_answer_as_exact_ones)
{
    const auto scene = trimmed_planes().finish();
    const auto tracer = make(scene);
    ASSERT_TRUE(tracer);
    RenderOptions options = small_picture({8, -16, 20});
    RenderStats exact_stats, hybrid_stats;
    const Frame exact = render(*tracer, options, &exact_stats);
    options.trim = TrimMode::Hybrid;
    const Frame hybrid = render(*tracer, options, &hybrid_stats);
    EXPECT_EQ(exact.face, hybrid.face);
    EXPECT_EQ(exact.depth_mm, hybrid.depth_mm);
    EXPECT_EQ(exact_stats.trim, TrimMode::Exact);
    EXPECT_EQ(hybrid_stats.trim, TrimMode::Hybrid);
    // the texture decides most of what the cells leave open
    EXPECT_GT(hybrid_stats.work.curve_tests, 0u);
    EXPECT_LT(hybrid_stats.work.curve_tests, exact_stats.work.curve_tests);
}

TEST_F(vk_tracer, lines_are_the_same_in_every_mode_that_asks_the_pieces)
{
    const auto scene = trimmed_planes().finish();
    const auto tracer = make(scene);
    ASSERT_TRUE(tracer);
    RenderOptions options = small_picture({8, -16, 20});
    const Frame plain = render(*tracer, options);
    options.edges = EdgeLines::Sharp;
    RenderStats exact_stats;
    const Frame exact = render(*tracer, options, &exact_stats);
    EXPECT_EQ(exact_stats.trim, TrimMode::Exact);
    EXPECT_GT(exact_stats.work.edge_tests, 0u);
    EXPECT_NE(exact.rgba, plain.rgba);
    for (const TrimMode mode : {TrimMode::Kd, TrimMode::Hybrid}) {
        options.trim = mode;
        RenderStats stats;
        const Frame drawn = render(*tracer, options, &stats);
        EXPECT_EQ(stats.trim, mode);
        EXPECT_EQ(stats.work.edge_tests, exact_stats.work.edge_tests);
        ASSERT_EQ(drawn.face, exact.face);
        float most = 0;
        for (size_t i = 0; i < exact.rgba.size(); ++i)
            most = std::max(most, std::abs(drawn.rgba[i] - exact.rgba[i]));
        EXPECT_LE(most, 0.02f) << "steps of 1/256 pixel, and what they do to a colour";
    }
}

TEST_F(vk_tracer, draws_what_the_cpu_tracer_draws)
{
    TracedScene builder = all_kinds();
    builder.place({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    builder.place({0, -0.5, 0, -12, 0.5, 0, 0, -4, 0, 0, 0.75, -6}); // turned and unevenly scaled
    const auto scene = builder.finish();
    const auto tracer = make(scene);
    ASSERT_TRUE(tracer);
    const auto cpu = make_cpu_tracer(scene);
    ASSERT_TRUE(cpu.ok());
    RenderOptions options = small_picture({20, -40, 25});
    options.edges = EdgeLines::All;
    for (const bool all : {false, true}) {
        options.silhouettes = options.antialias_trims = all;
        options.fill = !all;
        RenderStats stats;
        const Frame expected = render(**cpu, options);
        const Frame actual = render(*tracer, options, &stats);
        EXPECT_GT(stats.work.edge_tests, 0u);
        size_t drawn = 0, differ = 0;
        for (size_t i = 0; i < expected.face.size(); ++i) {
            double most = 0;
            for (size_t c = 0; c < 4; ++c)
                most = std::max(most, std::abs(double(expected.rgba[4 * i + c]) - double(actual.rgba[4 * i + c])));
            differ += most > 0.02; // steps of 1/256 pixel, and what they do to a colour
            drawn += expected.rgba[4 * i + 3] > 0;
        }
        EXPECT_GT(drawn, all ? 800u : 2500u);
        EXPECT_LE(differ, expected.face.size() / 500) << "where a hit is another, so is what is drawn on it";
    }
}

TEST_F(vk_tracer, traces_pictures_of_several_bands)
{
    TracedScene builder;
    builder.add(kKindSphere, 0.7, {0, 0, 0}, {std::numbers::pi, std::numbers::pi / 2});
    const auto scene = builder.finish();
    const auto tracer = make(scene);
    ASSERT_TRUE(tracer);
    RenderOptions options = small_picture({20, -30, 15});
    options.width = 800;
    options.height = 900; // 720,000 pixels; a band holds 645,277
    expect_agreement(*tracer, scene, options, 100000);
}

TEST_F(vk_tracer, gives_the_same_frame_and_counts_each_time)
{
    const auto scene = trimmed_planes().finish();
    const auto tracer = make(scene);
    ASSERT_TRUE(tracer);
    RenderOptions options = small_picture({20, -40, 25});
    RenderStats once, again;
    const Frame first = render(*tracer, options, &once);
    options.frames = 2;
    const Frame second = render(*tracer, options, &again);
    EXPECT_EQ(first.rgba, second.rgba);
    EXPECT_EQ(first.depth_mm, second.depth_mm);
    EXPECT_EQ(once.frame_ms.size(), 1u);
    EXPECT_EQ(again.frame_ms.size(), 2u);
    EXPECT_GT(once.frame_ms[0], 0.0);
    EXPECT_EQ(once.work.rays, 160u * 90u);
    EXPECT_EQ(once.work.node_visits, again.work.node_visits);
    EXPECT_EQ(once.work.leaf_visits, again.work.leaf_visits);
    EXPECT_EQ(once.work.curve_tests, again.work.curve_tests);
    EXPECT_GT(once.work.curve_tests, 0u);
}

TEST_F(vk_tracer, traces_nets_of_high_degree_until_the_driver_would_cut_its_loops)
{
    TracedScene builder;
    builder.add_wave(20, {-0.5, 0, 0}, 0.3f, 0.4); // 21 x 21 points: too large for a local copy
    for (int i = 0; i < 80; ++i) {                 // one behind the other, all but a corner trimmed away
        builder.add_wave(25, {0.5, 0, 0.5 - 0.01 * i}, 0.01f, 0.4);
        builder.trim(builder.image.faces.size() - 1, {shapes::circle(0.02, 0.02, 0.01, 0.01)});
    }
    const auto scene = builder.finish();
    const auto tracer = make(scene);
    ASSERT_TRUE(tracer);
    RenderOptions options = small_picture({-5, -6, 12}, {-5, 0, 0});
    options.camera.fov_deg = 20;
    expect_agreement(*tracer, scene, options, 5000);

    options.camera.eye[0] = options.camera.target[0] = 5;
    if (tracer->device_name().find("llvmpipe") == std::string::npos)
        GTEST_SKIP() << "SKIPPED: " << tracer->device_name() << " does not cut loops";
    options.width = 8; // each pixel runs into the limit
    options.height = 8;
    RenderStats stats;
    const Result<Frame> frame = tracer->render(options, stats);
    ASSERT_FALSE(frame.ok());
    EXPECT_EQ(frame.error().code, ErrorCode::DeviceFailed);
    EXPECT_NE(frame.error().detail.find("--device cpu"), std::string::npos) << frame.error().detail;
}

TEST_F(vk_tracer, refuses_what_the_pack_has_no_data_for)
{
    TracedScene builder = trimmed_planes();
    builder.with_textures = false;
    const auto tracer = make(builder.finish());
    ASSERT_TRUE(tracer);
    RenderOptions options = small_picture({20, -40, 25});
    RenderStats stats;
    for (const TrimMode mode : {TrimMode::Sdf, TrimMode::Hybrid, TrimMode::Reference}) {
        options.trim = mode;
        const Result<Frame> frame = tracer->render(options, stats);
        ASSERT_FALSE(frame.ok());
        EXPECT_EQ(frame.error().code, ErrorCode::UnsupportedPackFeature);
    }
    options.trim = TrimMode::Auto;
    options.width = 0;
    const Result<Frame> frame = tracer->render(options, stats);
    ASSERT_FALSE(frame.ok());
    EXPECT_EQ(frame.error().code, ErrorCode::Usage);
}

TEST_F(vk_tracer, traces_a_scene_that_holds_nothing)
{
    TracedScene builder;
    const auto tracer = make(builder.finish());
    ASSERT_TRUE(tracer);
    const Frame frame = render(*tracer, small_picture({20, -40, 25}));
    EXPECT_EQ(std::count(frame.face.begin(), frame.face.end(), -1), 160 * 90);
}

TEST_F(vk_tracer, takes_a_software_driver_only_with_leave)
{
    const auto with_leave = VulkanDevice::create(true, false);
    ASSERT_TRUE(with_leave.ok());
    if (!(*with_leave)->is_software())
        GTEST_SKIP() << "SKIPPED: " << (*with_leave)->name() << " is hardware";
    const auto tracer = make_vulkan_tracer(TracedScene().finish(), false, false);
    ASSERT_FALSE(tracer.ok());
    EXPECT_EQ(tracer.error().code, ErrorCode::NoDevice);
    EXPECT_NE(tracer.error().detail.find("software"), std::string::npos) << tracer.error().detail;
    EXPECT_NE(tracer.error().detail.find("--device cpu"), std::string::npos) << tracer.error().detail;
}

TEST_F(vk_tracer, names_the_array_that_is_too_large_for_the_device)
{
    const auto device = VulkanDevice::create(true, false);
    ASSERT_TRUE(device.ok());
    const size_t limit_bytes = (*device)->properties().limits.maxStorageBufferRange;
    const auto buffer = VulkanBuffer::create(**device, BufferUse::Storage, limit_bytes + 1, "the leaves");
    ASSERT_FALSE(buffer.ok());
    EXPECT_EQ(buffer.error().code, ErrorCode::DeviceFailed);
    EXPECT_EQ(buffer.error().where, "the leaves");
    EXPECT_NE(buffer.error().detail.find(std::to_string(limit_bytes + 1)), std::string::npos);
    EXPECT_NE(buffer.error().detail.find("--device cpu"), std::string::npos);
}

TEST_F(vk_tracer, lets_two_devices_live_side_by_side)
{
    TracedScene builder;
    builder.add(kKindPlane, 1, {0, 0, 0}, {1, 1});
    const auto scene = builder.finish();
    const auto first = make(scene);
    ASSERT_TRUE(first);
    {
        const auto second = make(scene);
        ASSERT_TRUE(second);
        EXPECT_EQ(render(*second, small_picture({8, -16, 20})).depth_mm,
                  render(*first, small_picture({8, -16, 20})).depth_mm);
    }
    expect_agreement(*first, scene, small_picture({8, -16, 20}), 2000);
}

// No driver is needed for these.
TEST(vk_device, says_what_to_do_without_a_driver)
{
    setenv("VK_DRIVER_FILES", "/nonexistent/driver.json", 1);
    setenv("VK_ICD_FILENAMES", "/nonexistent/driver.json", 1); // older loaders' name for it
    const auto tracer = make_vulkan_tracer(TracedScene().finish(), true, false);
    unsetenv("VK_DRIVER_FILES");
    unsetenv("VK_ICD_FILENAMES");
    ASSERT_FALSE(tracer.ok());
    EXPECT_EQ(tracer.error().code, ErrorCode::NoDevice);
    EXPECT_EQ(exit_code(tracer.error()), kExitUnsupported);
    EXPECT_NE(tracer.error().detail.find("--device cpu"), std::string::npos) << tracer.error().detail;
}

TEST(vk_device, names_results_as_the_api_does)
{
    EXPECT_EQ(vk_result_name(VK_ERROR_DEVICE_LOST), "VK_ERROR_DEVICE_LOST");
    const Error lost = vk_failure("vkQueueSubmit", VK_ERROR_DEVICE_LOST);
    EXPECT_EQ(lost.code, ErrorCode::DeviceFailed);
    EXPECT_EQ(lost.where, "vkQueueSubmit");
    EXPECT_EQ(lost.detail.rfind("VK_ERROR_DEVICE_LOST", 0), 0u);
}

} // namespace
} // namespace trimray
