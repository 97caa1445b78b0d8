// Pictures of models under lights, cut open, seen through and mirroring, kept and looked at.
#include "tests/closed_forms.h"
#include "tests/golden_pictures.h"
#include "tests/traced_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>

namespace trimray {
namespace {

/// The model's middle from where the view iso is, through another lens.
RenderOptions framed(const Scene& scene, double fov_deg)
{
    RenderOptions options = from_iso(scene.pack.image, 240, 150);
    options.camera.fov_deg = fov_deg;
    return options;
}

/// Section planes pass through the model's middle. `change`: what else is asked for.
void expect_drawn(
    const char* model, double fov_deg, const SceneLook& look, const std::string& name,
    const std::function<void(RenderOptions&)>& change = [](RenderOptions&) {})
{
    const auto scene = scene_of_file(std::string(TRIMRAY_TESTS_DIR) + "/models/" + model);
    ASSERT_TRUE(scene);
    const auto tracer = tracer_of(scene, false);
    ASSERT_TRUE(tracer);
    RenderOptions options = framed(*scene, fov_deg);
    options.look = look;
    for (SectionPlane& plane : options.look.section.planes)
        plane.point_mm = options.camera.target;
    change(options);
    expect_golden(picture(*tracer, options), name);
}

TEST(golden_effects, shadows_and_occlusion_are_drawn_as_they_were)
{
    SceneLook look;
    look.lights = {{.direction = {-1, 0.6, -1}, .half_angle_deg = 2, .shadows = true}};
    look.light_samples = 32;
    look.occlusion.samples = 64;
    expect_drawn("sg1-c5-214.stp", 27, look, "shadows_and_occlusion.png");
}

TEST(golden_effects, a_hatched_section_is_drawn_as_it_was)
{
    SceneLook look;
    look.section.planes = {{.normal = {0.3, -1, 0.5}}};
    look.section.caps = CapStyle::Hatched;
    expect_drawn("io1-cm-214.stp", 20, look, "hatched_section.png");
}

/// A sky that darkens upwards over a floor of squares, with a bright window in it.
std::shared_ptr<const Environment> room()
{
    Environment room{128, 64, {}, "room"};
    for (uint32_t y = 0; y < room.height; ++y)
        for (uint32_t x = 0; x < room.width; ++x) {
            const bool floor = y >= room.height / 2, window = x >= 20 && x < 30 && y >= 12 && y < 24;
            const float up = 1 - float(y) / float(room.height / 2);
            const float square = ((x / 8 + y / 4) % 2 == 0) ? 0.7f : 0.1f;
            const std::array<float, 3> sky{0.7f - 0.5f * up, 0.8f - 0.4f * up, 1.0f - 0.2f * up};
            for (size_t c = 0; c < 3; ++c)
                room.rgb.push_back(window ? 6.0f : floor ? square : sky[c]);
        }
    return std::make_shared<Environment>(std::move(room));
}

TEST(golden_effects, a_model_seen_through_is_drawn_as_it_was)
{
    SceneLook look;
    look.xray = 0.25f;
    expect_drawn("io1-cm-214.stp", 30, look, "xray.png", [](RenderOptions& options) {
        options.edges = EdgeLines::Sharp; // of the nearest faces
    });
}

TEST(golden_effects, mirrors_in_an_environment_are_drawn_as_they_were)
{
    SceneLook look;
    look.environment = room();
    MaterialRule dark_mirrors; // of all faces
    dark_mirrors.material.color = {0.02f, 0.02f, 0.02f};
    dark_mirrors.material.mirror = 0.8f;
    look.materials = {dark_mirrors};
    look.mirror_depth = 3;
    expect_drawn("sg1-c5-214.stp", 27, look, "mirrors.png",
                 [](RenderOptions& options) { options.edges = EdgeLines::Sharp; });
}

TEST(golden_effects, parallel_rays_through_a_section_are_drawn_as_they_were)
{
    SceneLook look;
    look.section.planes = {{.normal = {0.1, -1, 0}}};
    look.section.caps = CapStyle::Filled;
    look.lights = {{.direction = {-1, 0.8, -1}, .shadows = true}};
    expect_drawn("io1-cm-214.stp", 30, look, "parallel_section.png", [](RenderOptions& options) {
        const Vec3 back = reference::operator-(options.camera.eye, options.camera.target);
        options.camera.orthographic_mm = 2 * std::tan(options.camera.fov_deg * kPi / 360) * reference::length(back);
        options.edges = EdgeLines::Sharp;
    });
}

} // namespace
} // namespace trimray
