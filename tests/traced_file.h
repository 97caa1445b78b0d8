// A CAD file through the whole chain: file, model, pack bytes, tracers, pictures, and these held against the reference.
#pragma once

#include "format/pack_reader.h"
#include "format/pack_writer.h"
#include "preprocess/build_pack.h"
#include "preprocess/import/cad_import.h"
#include "runtime/camera.h"
#include "tests/against_reference.h"
#include "tests/compare_frames.h"
#include "tests/keep_vulkan_loaded.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <numeric>
#include <string>
#include <unistd.h>

namespace trimray {

/// A file of this process in the temporary folder, gone when the test ends.
struct TemporaryFile {
    std::string path;
    explicit TemporaryFile(const std::string& name)
        : path((std::filesystem::temp_directory_path() / fmt::format("trimray_{}_{}", getpid(), name)).string())
    {
    }
    ~TemporaryFile() { std::filesystem::remove(path); }
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;
};

/// As a pack's bytes say. Null where they cannot be read, which fails the test.
inline std::shared_ptr<const Scene> scene_of_image(const PackImage& image)
{
    Result<LoadedPack> pack = decode_pack(encode_pack(image, {}), {});
    if (!pack.ok()) {
        ADD_FAILURE() << pack.error().where << ": " << pack.error().detail;
        return nullptr;
    }
    auto scene = std::make_shared<Scene>();
    scene->pack = std::move(pack).value();
    return scene;
}

/// Null where some step fails, which fails the test. A face that is dropped does too.
inline std::shared_ptr<const Scene> scene_of_model(const CadModel& model)
{
    BuildReport report;
    const PackImage image = build_pack(model, {}, report);
    for (const DroppedFace& face : image.dropped)
        ADD_FAILURE() << "face " << face.face_in_part << ": " << image.strings.strings[face.reason];
    return scene_of_image(image);
}

/// A picture of the model's bounds, whole, from iso at 35 degrees.
inline RenderOptions from_iso(const PackImage& image, uint32_t width, uint32_t height)
{
    RenderOptions options;
    options.width = width;
    options.height = height;
    const auto reach = [&](const std::array<double, 3>& direction) {
        double sum = 0;
        for (size_t i = 0; i < 3; ++i)
            sum += std::max(direction[i] * image.bounds_lo_mm[i], direction[i] * image.bounds_hi_mm[i]);
        return sum;
    };
    EXPECT_TRUE(standard_view("iso", reach, double(width) / height, 35, options.camera));
    return options;
}

inline std::shared_ptr<const Scene> scene_of_file(const std::string& path)
{
    ImportOptions options;
    options.proxy_deflection = 0;
    const Result<CadModel> model = import_cad(path, options, {});
    if (model.ok())
        return scene_of_model(*model);
    ADD_FAILURE() << model.error().where << ": " << model.error().detail;
    return nullptr;
}

/// Null where there is no Vulkan driver, which it prints.
inline std::unique_ptr<Tracer> tracer_of(const std::shared_ptr<const Scene>& scene, bool vulkan)
{
    keep_vulkan_loaded();
    auto tracer = vulkan ? make_vulkan_tracer(scene, true, false) : make_cpu_tracer(scene);
    if (tracer.ok())
        return std::move(*tracer);
    if (vulkan && tracer.error().code == ErrorCode::NoDevice)
        std::cout << "skipped vulkan: " << tracer.error().detail << "\n";
    else
        ADD_FAILURE() << tracer.error().where << ": " << tracer.error().detail;
    return nullptr;
}

/// No pixels where the tracer fails, which is a failure of the test.
inline Frame picture(Tracer& tracer, const RenderOptions& options)
{
    RenderStats stats;
    Result<Frame> frame = tracer.render(options, stats);
    if (frame.ok())
        return std::move(*frame);
    ADD_FAILURE() << frame.error().where << ": " << frame.error().detail;
    return {};
}

/// Largest errors of depth and normal that rounding to single precision may leave where the right face is hit.
inline constexpr double kDepth_px = 1e-3, kNormal_deg = 0.02;

/// The picture, which is expected to be the reference's; prints what it is off by. No pixels where there is no tracer.
/// `most_beside`: false hits that are let pass, of rays that pass a silhouette within 0.01 pixels.
inline Frame right_picture(const std::shared_ptr<const Scene>& scene, const RenderOptions& options, bool vulkan,
                           const std::string& name, uint64_t most_beside = 0)
{
    const auto tracer = tracer_of(scene, vulkan);
    if (!tracer)
        return {};
    Frame frame = picture(*tracer, options);
    const AgainstReference found = compare_with_reference(frame, options.camera, ClosestReference(scene->pack.image));
    const auto sum = [](const auto& counts) { return std::accumulate(counts.begin(), counts.end(), uint64_t(0)); };
    std::cout << fmt::format("{}, {}: {} of {} rays hit, {} wrong and {} doubtful; off by at most {:.2g} px and {:.2g} "
                             "degrees\n",
                             name, vulkan ? "vulkan" : "cpu", found.both_hit, found.rays, sum(found.faults),
                             sum(found.doubtful), found.largest_depth_px, found.largest_normal_deg);
    EXPECT_GT(found.both_hit, found.rays / 30) << name << ": the view shows nothing";
    uint64_t beside = 0;
    for (const FaultyPixel& p : found.pixels) {
        beside += p.fault == Fault::FalseHit && p.doubt != Doubt::Tangent && p.hair_px <= 0.01;
        std::cout << fmt::format("  {}{} at {}, {}: {} mm, face {}, instead of {} mm, face {}; {} px from a rim\n",
                                 p.certified ? "certified " : "", kFaultNames[size_t(p.fault)], p.x, p.y, p.tracer_mm,
                                 p.tracer_face, p.reference_mm, p.reference_face, p.hair_px);
    }
    EXPECT_EQ(sum(found.faults) - beside, 0u) << name;
    EXPECT_LE(beside, most_beside) << name;
    EXPECT_EQ(found.not_finite, 0u) << name;
    EXPECT_LE(found.largest_depth_px, kDepth_px) << name;
    EXPECT_LE(found.largest_normal_deg, kNormal_deg) << name;
    return frame;
}

/// `other` shows what `frame` shows, by the bounds of two tracers' frames. Either may have no pixels.
inline void expect_same(const Frame& frame, const Frame& other, const RenderOptions& options, const std::string& name)
{
    if (frame.face.empty() || other.face.empty())
        return;
    SCOPED_TRACE(name);
    const Disagreement d = compare(frame, other, options);
    std::cout << fmt::format("  differs in {} pixels at borders and {} elsewhere, by {:.2g} of the depth\n", d.borders,
                             d.strangers, d.depth);
    expect_small(d, int(frame.face.size()));
}

} // namespace trimray
