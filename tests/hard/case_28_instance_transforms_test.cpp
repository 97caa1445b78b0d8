// Hard case 28: mirrored, stretched and sheared instances, and their normals.
#include "tests/occt_models.h"
#include "tests/traced_file.h"
#include "tests/traced_scenes.h"

#include <array>
#include <string>

namespace trimray::hard {
namespace {

using reference::Vec3;

struct Placing {
    const char* name;
    std::array<double, 12> transform;
    std::array<double, 3> mirror_normal{}; // unit; of a plane through the origin, where it is a mirror image
    uint64_t beside_silhouettes = 0;       // false hits there
};
constexpr Placing kPlacings[] = {
    {"mirrored in x", {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, {1, 0, 0}},
    {"mirrored in a slanted plane",
     {0.28, -0.96, 0, 0, -0.96, -0.28, 0, 0, 0, 0, 1, 0}, // I - 2 n n^T
     {0.6, 0.8, 0}},
    {"stretched", {1.6, 0, 0, 0, 0, 0.4, 0, 0, 0, 0, 1, 0}},
    {"stretched 30 times", {1.5, 0, 0, 0, 0, 0.05, 0, 0, 0, 0, 1, 0}, {}, 1},
    {"sheared", {1, 0.7, 0, 2, 0, 1, -0.4, 1, 0.3, 0, 1, 0}},
    {"mirrored, stretched, sheared and moved", {-1.3, 0.3, 0.2, 3, 0, 0.8, 0.5, -2, 0.4, -0.1, 0.6, 1}},
    {"inverted in a point and shrunk", {-0.5, 0, 0, 0, 0, -0.5, 0, 0, 0, 0, -0.5, 0}},
};

RenderOptions options_of(bool vulkan)
{
    return vulkan ? overview(96, 72) : overview(200, 150);
}

std::shared_ptr<const Scene> placed(const std::array<double, 12>& transform)
{
    TracedScene scene = all_kinds();
    scene.place(transform);
    return scene.finish();
}

Vec3 mirrored(const Vec3& a, const Vec3& n)
{
    using namespace reference;
    return a + n * (-2 * dot(a, n));
}

TEST(case_28, normals_of_mirrored_and_stretched_instances_are_the_references)
{
    for (const Placing& placing : kPlacings) {
        const auto scene = placed(placing.transform);
        for (const bool vulkan : {false, true})
            right_picture(scene, options_of(vulkan), vulkan, placing.name, placing.beside_silhouettes);
    }
}

// no reference needed: the camera's mirror image sees the mirror image of what the camera sees, from right to left
TEST(case_28, a_mirrored_instance_is_the_mirror_image)
{
    const auto straight = placed({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    for (const Placing& placing : kPlacings) {
        const Vec3& n = placing.mirror_normal;
        if (reference::length(n) == 0)
            continue;
        const auto scene = placed(placing.transform);
        for (const bool vulkan : {false, true}) {
            const auto tracer = tracer_of(straight, vulkan), mirror = tracer_of(scene, vulkan);
            if (!tracer || !mirror)
                continue;
            RenderOptions options = options_of(vulkan);
            const Frame frame = picture(*tracer, options);
            Camera& camera = options.camera;
            camera.eye = mirrored(camera.eye, n);
            camera.target = mirrored(camera.target, n);
            camera.up = mirrored(camera.up, n);
            const Frame turned = picture(*mirror, options);
            Frame back = turned;
            for (uint32_t y = 0; y < frame.height; ++y)
                for (uint32_t x = 0; x < frame.width; ++x) {
                    const size_t to = size_t(y) * frame.width + x, from = size_t(y + 1) * frame.width - 1 - x;
                    back.face[to] = turned.face[from];
                    back.instance[to] = turned.instance[from];
                    back.certified[to] = turned.certified[from];
                    back.depth_mm[to] = turned.depth_mm[from];
                    const Vec3 normal = mirrored(
                        {turned.normal[3 * from], turned.normal[3 * from + 1], turned.normal[3 * from + 2]}, n);
                    for (size_t c = 0; c < 3; ++c)
                        back.normal[3 * to + c] = float(normal[c]);
                    for (size_t c = 0; c < 4; ++c)
                        back.rgba[4 * to + c] = turned.rgba[4 * from + c];
                }
            expect_same(frame, back, options_of(vulkan), std::string(placing.name) + (vulkan ? ", vulkan" : ", cpu"));
        }
    }
}

TEST(case_28, a_mirrored_solid_of_a_file_shows_its_outside)
{
    const TemporaryFile file("mirrored.brep");
    const std::string model = std::string(TRIMRAY_TESTS_DIR) + "/models/sg1-c5-214.stp";
    ASSERT_TRUE(oracle::write_placed_copies(model, file.path));
    const auto scene = scene_of_file(file.path);
    ASSERT_TRUE(scene);
    ASSERT_EQ(scene->pack.image.instances.size(), 3u);
    const PackImage& image = scene->pack.image;
    RenderOptions options;
    options.width = options.height = 128;
    const Reach box = [&image](const std::array<double, 3>& d) {
        double reach = 0;
        for (size_t i = 0; i < 3; ++i)
            reach += d[i] * (d[i] > 0 ? image.bounds_hi_mm : image.bounds_lo_mm)[i];
        return reach;
    };
    ASSERT_TRUE(standard_view("iso", box, 1, 30, options.camera));
    const Frame frame = right_picture(scene, options, false, "a file's copies");
    const CameraRays rays = camera_rays(options.camera, options.width, options.height);
    std::array<int, 3> fronts{}, backs{};
    for (uint32_t y = 0; y < frame.height; ++y)
        for (uint32_t x = 0; x < frame.width; ++x) {
            const size_t i = size_t(y) * frame.width + x;
            if (frame.face[i] < 0)
                continue;
            double facing = 0;
            for (size_t c = 0; c < 3; ++c)
                facing += double(frame.normal[3 * i + c]) *
                          (rays.corner[c] + (x + 0.5) * rays.step_x[c] + (y + 0.5) * rays.step_y[c]);
            ++(facing < 0 ? fronts : backs)[size_t(frame.instance[i])];
        }
    for (size_t instance = 0; instance < 3; ++instance) {
        EXPECT_GT(fronts[instance], 200) << instance;
        EXPECT_EQ(backs[instance], 0) << instance;
    }
}

} // namespace
} // namespace trimray::hard
