// The one-ray tracer, the peer that stands for the paper's shape of tracer: its pictures are the CPU tracer's own.
#include "preprocess/build_pack.h"
#include "preprocess/import/cad_import.h"
#include "runtime/derived_scene.h"
#include "runtime/measure/one_ray_tracer.h"
#include "tests/compare_frames.h"
#include "tests/traced_scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace trimray {
namespace {

/// What both tracers are asked for.
RenderOptions plain(RenderOptions options)
{
    options.closest = ClosestPolicy::Stochastic;
    options.trim = TrimMode::Kd;
    return options;
}

Drawn draw_one_ray(const std::shared_ptr<const Scene>& scene, const RenderOptions& options)
{
    Drawn drawn;
    Result<Frame> frame = make_one_ray_tracer(scene)->render(options, drawn.stats);
    if (frame.ok())
        drawn.frame = std::move(*frame);
    else
        ADD_FAILURE() << frame.error().where << ": " << frame.error().detail;
    return drawn;
}

/// Holds the picture against the CPU tracer's: face, instance and hit of all pixels but `most_others`, and of the rest
/// depth, normal, parameters and colour within a few roundings.
void expect_same_picture(const std::shared_ptr<const Scene>& scene, const RenderOptions& options, size_t least_hits,
                         size_t most_others)
{
    const Frame wide = draw(scene, options).frame, one = draw_one_ray(scene, options).frame;
    ASSERT_EQ(one.face.size(), wide.face.size());
    ASSERT_FALSE(one.face.empty());
    size_t hits = 0, others = 0;
    double depth = 0, normal = 0, color = 0, uv = 0;
    const auto off = [](const std::vector<float>& a, const std::vector<float>& b, size_t i) {
        return std::abs(double{a[i]} - double{b[i]});
    };
    for (size_t i = 0; i < one.face.size(); ++i) {
        if (one.face[i] != wide.face[i] || one.instance[i] != wide.instance[i]) {
            ++others;
            continue;
        }
        for (size_t c = 0; c < 4; ++c)
            color = std::max(color, off(one.rgba, wide.rgba, 4 * i + c));
        ASSERT_EQ(std::isinf(one.depth_mm[i]), one.face[i] < 0);
        if (one.face[i] < 0)
            continue;
        ++hits;
        depth = std::max(depth, off(one.depth_mm, wide.depth_mm, i) / double{wide.depth_mm[i]});
        for (size_t c = 0; c < 3; ++c)
            normal = std::max(normal, off(one.normal, wide.normal, 3 * i + c));
        for (size_t c = 0; c < 2; ++c)
            uv = std::max(uv, off(one.uv, wide.uv, 2 * i + c) / (1 + std::abs(double{wide.uv[2 * i + c]})));
    }
    EXPECT_GT(hits, least_hits);
    EXPECT_LE(others, most_others);
    EXPECT_LT(depth, 1e-6);
    EXPECT_LT(normal, 1e-5);
    EXPECT_LT(uv, 1e-5);
    EXPECT_LT(color, 1e-5);
    EXPECT_EQ(std::count(one.certified.begin(), one.certified.end(), 1), 0);
}

/// A model of tests/models as the paper has it: all Bezier patches, one leaf each.
std::shared_ptr<const Scene> papers_scene(const std::string& model)
{
    ImportOptions import;
    import.native_surfaces = false;
    import.proxy_deflection = 0;
    const Result<CadModel> cad = import_cad(std::string(TRIMRAY_TESTS_DIR) + "/models/" + model, import, {});
    if (!cad.ok()) {
        ADD_FAILURE() << cad.error().where << ": " << cad.error().detail;
        return nullptr;
    }
    BuildOptions build;
    build.leaves.max_leaves_per_patch = 1;
    BuildReport report;
    auto scene = std::make_shared<Scene>();
    scene->pack.image = build_pack(*cad, build, report);
    return scene;
}

TEST(one_ray_tracer, draws_every_kind_of_surface_as_the_packets_do)
{
    expect_same_picture(all_kinds().finish(), plain(overview(188, 122)), 4000, 4);
}

TEST(one_ray_tracer, draws_instances_as_the_packets_do)
{
    TracedScene scene = all_kinds();
    scene.place({1, 0, 0, -9, 0, 1, 0, 0, 0, 0, 1, 0});
    scene.place({0, -0.5, 0, 9, 0.5, 0, 0, 0, 0, 0, 0.5, 3}); // turned and half as large
    scene.place({-1, 0, 0, 2, 0, 1, 0, 12, 0, 0, 1, -4});     // a mirror image
    const auto placed = scene.finish();
    expect_same_picture(placed, plain(overview(188, 122)), 4000, 4);
}

TEST(one_ray_tracer, draws_the_papers_setting_as_the_packets_do)
{
    for (const char* model : {"nozzle.stp", "sg1-c5-214.stp"}) {
        SCOPED_TRACE(model);
        const auto scene = papers_scene(model);
        ASSERT_NE(scene, nullptr);
        const PackImage& image = scene->pack.image;
        ASSERT_EQ(image.leaves.size(), image.patches.size());
        RenderOptions options;
        options.width = 192;
        options.height = 128;
        const auto& lo = image.bounds_lo_mm;
        const auto& hi = image.bounds_hi_mm;
        const auto reach = [&](const std::array<double, 3>& d) {
            double most = 0;
            for (size_t i = 0; i < 3; ++i)
                most += std::max(d[i] * lo[i], d[i] * hi[i]);
            return most;
        };
        for (const char* view : {"iso", "front"}) {
            ASSERT_TRUE(standard_view(view, reach, 1.5, 35, options.camera));
            expect_same_picture(scene, plain(options), 1000, 4);
        }
    }
}

TEST(one_ray_tracer, cuts_rims_and_draws_parallel_rays_as_the_packets_do)
{
    const uint rims = 9u << kFaceRimBit | 9u << (kFaceRimBit + kFaceRimBits);
    RenderOptions options = plain(overview(94, 61));
    options.camera.eye = {26, 3, 2};
    expect_same_picture(slab(rims), options, 500, 1);
    options = plain(overview(94, 61));
    options.camera.orthographic_mm = 24;
    expect_same_picture(all_kinds().finish(), options, 1000, 1);
}

TEST(one_ray_tracer, keeps_the_nearest_hits_of_all_frames_as_the_packets_do)
{
    const auto scene = with_leaf_budget(*all_kinds().finish(), 1);
    RenderOptions options = plain(overview(94, 61));
    options.frames = 5;
    expect_same_picture(scene, options, 1000, 1);
}

TEST(one_ray_tracer, counts_the_same_work_and_draws_the_same_bits_on_any_number_of_threads)
{
    const auto scene = all_kinds().finish();
    RenderOptions options = plain(overview(94, 61));
    options.threads = 1;
    const Drawn first = draw_one_ray(scene, options);
    EXPECT_EQ(first.stats.frame_cpu_ms.size(), 1u);
    EXPECT_EQ(first.stats.trim, TrimMode::Kd);
    EXPECT_EQ(first.stats.work.rays, 94u * 61u);
    EXPECT_EQ(first.stats.work.uncertified_pixels, 94u * 61u);
    EXPECT_GT(first.stats.work.node_visits, 0u);
    EXPECT_GT(first.stats.work.newton_steps, 0u);
    EXPECT_GT(first.stats.work.curve_tests, 0u);
    for (const uint32_t threads : {2u, 5u}) {
        options.threads = threads;
        const Drawn other = draw_one_ray(scene, options);
        EXPECT_TRUE(same_bits(first.frame.depth_mm, other.frame.depth_mm));
        EXPECT_TRUE(same_bits(first.frame.rgba, other.frame.rgba));
        EXPECT_TRUE(same_bits(first.frame.face, other.frame.face));
        EXPECT_EQ(first.stats.work.leaf_visits, other.stats.work.leaf_visits);
        EXPECT_EQ(first.stats.work.newton_steps, other.stats.work.newton_steps);
    }
}

TEST(one_ray_tracer, meets_fewer_leaves_than_the_packets)
{
    const auto scene = all_kinds().finish();
    const RenderOptions options = plain(overview(94, 61));
    const WorkCounts one = draw_one_ray(scene, options).stats.work, wide = draw(scene, options).stats.work;
    EXPECT_LT(one.leaf_visits, wide.leaf_visits);
    EXPECT_LT(one.newton_steps, 2 * wide.newton_steps);
}

TEST(one_ray_tracer, refuses_what_it_does_not_do)
{
    const auto scene = all_kinds().finish();
    const auto refusal = [&](const std::function<void(RenderOptions&)>& change) -> std::optional<ErrorCode> {
        RenderOptions options = plain(overview(16, 16));
        change(options);
        RenderStats stats;
        const Result<Frame> frame = make_one_ray_tracer(scene)->render(options, stats);
        return frame.ok() ? std::nullopt : std::optional(frame.error().code);
    };
    EXPECT_EQ(refusal([](RenderOptions& o) { o.closest = ClosestPolicy::Certified; }), ErrorCode::Usage);
    EXPECT_EQ(refusal([](RenderOptions& o) { o.trim = TrimMode::Exact; }), ErrorCode::Usage);
    EXPECT_EQ(refusal([](RenderOptions& o) { o.edges = EdgeLines::All; }), ErrorCode::Usage);
    EXPECT_EQ(refusal([](RenderOptions& o) { o.antialias_trims = true; }), ErrorCode::Usage);
    EXPECT_EQ(refusal([](RenderOptions& o) { o.width = 0; }), ErrorCode::Usage);
    EXPECT_EQ(refusal([](RenderOptions& o) { o.look.lights.emplace_back(); }), ErrorCode::UnsupportedFormat);
    EXPECT_EQ(refusal([](RenderOptions& o) { o.look.occlusion.samples = 4; }), ErrorCode::UnsupportedFormat);
    EXPECT_EQ(refusal([](RenderOptions& o) { o.look.map.map = SurfaceMap::Zebra; }), ErrorCode::UnsupportedFormat);
    EXPECT_EQ(refusal([](RenderOptions& o) { o.look.section.planes.emplace_back(); }), ErrorCode::UnsupportedFormat);
    EXPECT_EQ(refusal([](RenderOptions& o) { o.trim = TrimMode::Auto; }), std::nullopt) << "auto is kd";
}

} // namespace
} // namespace trimray
