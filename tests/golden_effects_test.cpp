// Pictures of models under lights and cut open, kept and looked at.
#include "tests/golden_pictures.h"
#include "tests/traced_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>

namespace trimray {
namespace {

/// The model's middle from where the view iso is, through another lens.
RenderOptions framed(const Scene& scene, double fov_deg)
{
    const PackImage& image = scene.pack.image;
    RenderOptions options;
    options.width = 240;
    options.height = 150;
    const auto reach = [&](const std::array<double, 3>& direction) {
        double sum = 0;
        for (size_t i = 0; i < 3; ++i)
            sum += std::max(direction[i] * image.bounds_lo_mm[i], direction[i] * image.bounds_hi_mm[i]);
        return sum;
    };
    EXPECT_TRUE(standard_view("iso", reach, double(options.width) / options.height, 35, options.camera));
    options.camera.fov_deg = fov_deg;
    return options;
}

/// Section planes pass through the model's middle.
void expect_drawn(const char* model, double fov_deg, const SceneLook& look, const std::string& name)
{
    const auto scene = scene_of_file(std::string(TRIMRAY_TESTS_DIR) + "/models/" + model);
    ASSERT_TRUE(scene);
    const auto tracer = tracer_of(scene, false);
    ASSERT_TRUE(tracer);
    RenderOptions options = framed(*scene, fov_deg);
    options.look = look;
    for (SectionPlane& plane : options.look.section.planes)
        plane.point_mm = options.camera.target;
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

} // namespace
} // namespace trimray
