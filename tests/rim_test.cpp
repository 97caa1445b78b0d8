// Rims of closed shells (shaders/shared/rim.h): their backs are seen from within, not from outside.
#include "tests/compare_frames.h"
#include "tests/hard/trim_modes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

namespace trimray::hard {
namespace {

constexpr uint kRimU = 4, kRimV = 5; // 1/16 and 1/32 of the domain
constexpr uint kRims = kRimU << kFaceRimBit | kRimV << (kFaceRimBit + kFaceRimBits);

/// `plane` with these flags of its face, too.
TrimmedPlane flagged(TrimmedPlane plane, uint flags)
{
    auto scene = std::make_shared<Scene>(*plane.scene);
    scene->pack.image.faces[0].flags |= flags;
    plane.scene = scene;
    return plane;
}

/// What is left of `plane` where its rim is no surface: a point beside which no corner is outside.
TrimmedPlane without_rim(TrimmedPlane plane)
{
    const TrimmedPlane whole = plane;
    plane.truth = [whole](double u, double v) {
        const double du = std::ldexp(1, -int(kRimU)), dv = std::ldexp(1, -int(kRimV));
        return whole.inside(u, v) && whole.inside(u - du, v - dv) && whole.inside(u + du, v - dv) &&
               whole.inside(u - du, v + dv) && whole.inside(u + du, v + dv);
    };
    return plane;
}

void expect_pictures(const TrimmedPlane& plane)
{
    const int tested =
        in_every_trim_mode(plane, {PlaneView{}}, [&](const TrimWay& way, size_t, const TrimErrors& errors) {
            EXPECT_GT(errors.inside, 3000) << way.name;
            EXPECT_LE(errors.wrong, way.exact() ? 0 : errors.inside / 50) << way.name;
        });
    EXPECT_GE(tested, 4);
}

TEST(rim, is_no_surface_for_a_ray_from_outside_that_meets_its_back)
{
    const std::vector<shapes::Loop> loops{shapes::gear(0.5, 0.5, 0.48, 0.3, 6), shapes::circle(0.5, 0.5, 0.12, 0.12)};
    expect_pictures(flagged(trimmed_plane(loops), kRims)); // a front
    for (const TrimmedPlane& plane : {trimmed_plane(loops), trimmed_plane({})})
        expect_pictures(without_rim(flagged(plane, kRims | kFaceReversed)));
}

TEST(rim, is_seen_from_within_the_shell_up_to_its_border)
{
    keep_vulkan_loaded();
    RenderOptions options;
    options.width = options.height = 120;
    options.camera.eye = {0.3, -0.2, 0.1};
    options.camera.target = {0, 0, 2};
    options.camera.up = {0, 1, 0};
    options.camera.fov_deg = 160;
    options.trim = TrimMode::Exact;
    const auto with = slab(kRims), without = slab(0);
    for (const bool vulkan : {false, true}) {
        auto tracer = vulkan ? make_vulkan_tracer(with, true, false) : make_cpu_tracer(with);
        auto plain = vulkan ? make_vulkan_tracer(without, true, false) : make_cpu_tracer(without);
        if (!tracer.ok() && tracer.error().code == ErrorCode::NoDevice) {
            std::cout << "skipped vulkan: " << tracer.error().detail << "\n";
            continue;
        }
        ASSERT_TRUE(tracer.ok() && plain.ok());
        RenderStats stats;
        const Result<Frame> actual = (*tracer)->render(options, stats), expected = (*plain)->render(options, stats);
        ASSERT_TRUE(actual.ok() && expected.ok());
        EXPECT_GT(std::count(expected->face.begin(), expected->face.end(), 0), 3000);
        EXPECT_EQ(actual->face, expected->face);
        EXPECT_EQ(actual->depth_mm, expected->depth_mm);
    }
}

} // namespace
} // namespace trimray::hard
