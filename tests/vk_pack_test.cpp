// Real CAD files through the whole chain (file, model, pack, Vulkan) against the CPU tracer.
#include "preprocess/build_pack.h"
#include "preprocess/import/cad_import.h"
#include "runtime/tracer.h"
#include "runtime/vk_device.h"
#include "tests/compare_frames.h"
#include "tests/keep_vulkan_loaded.h"

#include <gtest/gtest.h>

#include <string>

namespace trimray {
namespace {

std::shared_ptr<const Scene> scene_of(const std::string& name)
{
    const Result<CadModel> model = import_cad(std::string(TRIMRAY_TESTS_DIR) + "/models/" + name, {}, {});
    if (!model.ok()) {
        ADD_FAILURE() << name << ": " << model.error().detail;
        return nullptr;
    }
    BuildReport report;
    auto scene = std::make_shared<Scene>();
    scene->pack.image = build_pack(*model, {}, report);
    return scene;
}

class vk_pack : public testing::TestWithParam<const char*> {};

TEST_P(vk_pack, looks_on_the_device_as_on_the_cpu)
{
    keep_vulkan_loaded();
    const uint64_t messages_before = vk_validation_message_count();
    const auto scene = scene_of(GetParam());
    ASSERT_TRUE(scene);
    const auto vulkan = make_vulkan_tracer(scene, true, true);
    if (!vulkan.ok() && vulkan.error().code == ErrorCode::NoDevice)
        GTEST_SKIP() << "SKIPPED: " << vulkan.error().detail;
    ASSERT_TRUE(vulkan.ok()) << vulkan.error().where << ": " << vulkan.error().detail;
    const auto cpu = make_cpu_tracer(scene);
    ASSERT_TRUE(cpu.ok());
    const PackImage& image = scene->pack.image;
    for (const std::array<double, 3>& towards : {std::array{0.9, -1.3, 0.8}, std::array{-1.1, 0.7, -0.6}}) {
        RenderOptions options;
        options.width = 200;
        options.height = 150;
        options.error_px = 1e-4f; // to rounding: what Newton may leave is no disagreement
        double size = 0;
        for (size_t i = 0; i < 3; ++i)
            size = std::max(size, image.bounds_hi_mm[i] - image.bounds_lo_mm[i]);
        for (size_t i = 0; i < 3; ++i) {
            options.camera.target[i] = 0.5 * (image.bounds_lo_mm[i] + image.bounds_hi_mm[i]);
            options.camera.eye[i] = options.camera.target[i] + size * towards[i];
        }
        RenderStats cpu_stats, vulkan_stats;
        const Result<Frame> expected = (*cpu)->render(options, cpu_stats);
        const Result<Frame> actual = (*vulkan)->render(options, vulkan_stats);
        ASSERT_TRUE(expected.ok());
        ASSERT_TRUE(actual.ok()) << actual.error().where << ": " << actual.error().detail;
        const Disagreement d = compare(*expected, *actual, options);
        EXPECT_GT(d.hits, 3000);
        expect_small(d, int(options.width * options.height));
    }
    EXPECT_EQ(vk_validation_message_count(), messages_before);
}

// splines with trims; native faces in an assembly of three instances; native faces only
INSTANTIATE_TEST_SUITE_P(models, vk_pack, testing::Values("nozzle.stp", "abc_00000050.step", "io1-cm-214.stp"),
                         [](const testing::TestParamInfo<const char*>& info) {
                             std::string name = info.param;
                             for (char& c : name)
                                 c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
                             return name;
                         });

} // namespace
} // namespace trimray
