// Seams: where a closed surface is cut open must not show.
#include "format/pack_reader.h"
#include "preprocess/build_pack.h"
#include "preprocess/cad_import.h"
#include "runtime/tracer.h"
#include "tests/keep_vulkan_loaded.h"
#include "tests/occt_solids.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <iostream>
#include <numbers>
#include <unistd.h>

namespace trimray::hard {
namespace {

constexpr uint32_t kPixels = 128;

std::shared_ptr<const Scene> drilled_cylinder(double turn)
{
    const auto path = std::filesystem::temp_directory_path() / fmt::format("trimray_seam_{}.brep", getpid());
    if (!oracle::write_drilled_seam(turn, path.string()))
        return nullptr;
    ImportOptions options;
    options.proxy_deflection = 0;
    const Result<CadModel> model = import_cad(path.string(), options, {});
    std::filesystem::remove(path);
    if (!model.ok())
        return nullptr;
    auto scene = std::make_shared<Scene>();
    BuildReport report;
    scene->pack.image = build_pack(*model, {}, report);
    return scene;
}

TEST(case_21, a_hole_across_the_seam_looks_the_same_at_sixteen_turns)
{
    keep_vulkan_loaded();
    for (const TrimMode mode : {TrimMode::Exact, TrimMode::Hybrid})
        for (const bool vulkan : {false, true}) {
            std::vector<float> first;
            int most = 0;
            for (int i = 0; i < 16; ++i) {
                const auto scene = drilled_cylinder(2 * std::numbers::pi * i / 16);
                ASSERT_TRUE(scene) << i;
                auto tracer = vulkan ? make_vulkan_tracer(scene, true, false) : make_cpu_tracer(scene);
                if (!tracer.ok() && vulkan) {
                    std::cout << "skipped vulkan: " << tracer.error().detail << "\n";
                    break;
                }
                ASSERT_TRUE(tracer.ok());
                RenderOptions options;
                options.width = options.height = vulkan ? kPixels / 2 : kPixels;
                options.camera = {{150, 40, 90}, {5, 0, 30}, {0, 0, 1}, 28};
                options.trim = mode;
                options.shade = false;
                options.error_px = 1e-4f;
                RenderStats stats;
                const Result<Frame> frame = (*tracer)->render(options, stats);
                ASSERT_TRUE(frame.ok()) << frame.error().detail;
                if (first.empty())
                    first = frame->depth_mm;
                int off = 0;
                for (size_t p = 0; p < first.size(); ++p) {
                    const bool hit = std::isfinite(first[p]), now = std::isfinite(frame->depth_mm[p]);
                    off += hit != now || (hit && std::abs(first[p] - frame->depth_mm[p]) > 1e-3f);
                }
                most = std::max(most, off);
            }
            std::cout << (vulkan ? "vulkan" : "cpu") << (mode == TrimMode::Exact ? " exact" : " hybrid") << ": at most "
                      << most << " pixels differ from those of the first turn\n";
            EXPECT_LE(most, 2); // rounding at a border: 1e-6 of the size beside pixels of 1e-2
        }
}

} // namespace
} // namespace trimray::hard
