// The effect plan says what a pack calls for, neither less nor more.
#include "runtime/effect_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>

namespace trimray {
namespace {

EffectPlan plan_of(const PackImage& image, const RenderOptions& options = {}, DeviceKind device = DeviceKind::Cpu)
{
    return effect_plan(pack_facts(image), options, device);
}

std::vector<std::string> names(const PackImage& image, const RenderOptions& options = {},
                               DeviceKind device = DeviceKind::Cpu)
{
    std::vector<std::string> out;
    for (const EffectItem& item : plan_of(image, options, device).items) {
        EXPECT_FALSE(item.why.empty()) << item.name;
        out.push_back(item.name);
    }
    return out;
}

/// One plane with its natural border, placed once, without colours.
PackImage bare_plane()
{
    PackImage image;
    PatchRecord patch{};
    patch.shape = kKindPlane;
    image.patches = {patch};
    FaceRecord face{};
    face.flags = kFaceNaturalBorder;
    face.surface_kind = kKindPlane;
    image.faces = {face};
    image.parts.resize(1);
    InstanceRecord placed{};
    placed.transform[0] = placed.transform[5] = placed.transform[10] = 1;
    image.instances = {placed};
    image.leaves.resize(1);
    return image;
}

TEST(effect_plan, of_a_bare_plane_is_the_plane)
{
    RenderOptions hits_only;
    hits_only.shade = false;
    EXPECT_THAT(names(bare_plane(), hits_only), testing::ElementsAre("plane"));
    EXPECT_THAT(names(bare_plane()), testing::ElementsAre("plane", "shading"));
    EXPECT_TRUE(plan_of({}, hits_only).items.empty()) << "an empty pack calls for nothing";
}

TEST(effect_plan, grows_by_what_is_added_and_by_nothing_else)
{
    PackImage image = bare_plane();
    image.patches.push_back(image.patches[0]);
    image.patches[1].shape = kKindBezier | 3u << 8 | 5u << 16;
    EXPECT_THAT(names(image), testing::ElementsAre("plane", "bezier", "shading"));
    image.patches[1].shape |= kShapeRational;
    EXPECT_THAT(names(image), testing::ElementsAre("plane", "bezier-rational", "shading"));
    EXPECT_THAT(plan_of(image).items[1].why, testing::HasSubstr("degree up to 5"));
    image.faces[0].flags = 0;
    EXPECT_THAT(names(image), testing::ElementsAre("plane", "bezier-rational", "trim-exact", "shading"));
    image.instances.push_back(image.instances[0]);
    image.instances[1].transform[5] = -1;
    image.instances[1].color_rgba = 0xff0000ff;
    image.faces[0].flags = kFaceHasColor;
    image.leaves.resize(2);
    image.leaves[1].patch = 1;
    image.leaves[1].quat_z_bend = 152u << 16; // along = 1/2
    EXPECT_THAT(names(image),
                testing::ElementsAre("plane", "bezier-rational", "trim-exact", "instances", "mirrored-instances",
                                     "face-colors", "instance-colors", "leaf-parts", "shading"));
}

TEST(effect_plan, names_what_is_drawn_and_only_that)
{
    const PackImage image = bare_plane();
    RenderOptions options;
    options.edges = EdgeLines::Sharp;
    EXPECT_THAT(names(image, options), testing::ElementsAre("plane", "shading", "edges"));
    options.edges = EdgeLines::All;
    options.silhouettes = true;
    options.antialias_trims = true;
    options.fill = false;
    EXPECT_THAT(names(image, options), testing::ElementsAre("plane", "shading", "edges", "edges-smooth", "silhouettes",
                                                            "trim-antialiasing", "unfilled-faces"));
    options.shade = false;
    EXPECT_THAT(names(image, options), testing::ElementsAre("plane"));
}

TEST(effect_plan, names_a_map_where_it_is_drawn_or_measures)
{
    RenderOptions options;
    for (const auto& [map, name] :
         {std::pair{SurfaceMap::Zebra, "zebra"}, std::pair{SurfaceMap::Isophotes, "isophotes"},
          std::pair{SurfaceMap::CurvatureGaussian, "curvature-gaussian"}, std::pair{SurfaceMap::Draft, "draft"}}) {
        options.look.map.map = map;
        options.shade = true;
        EXPECT_THAT(names(bare_plane(), options), testing::ElementsAre("plane", name, "shading"));
        options.shade = false;
        if (map == SurfaceMap::Zebra || map == SurfaceMap::Isophotes)
            EXPECT_THAT(names(bare_plane(), options), testing::ElementsAre("plane"));
        else
            EXPECT_THAT(names(bare_plane(), options), testing::ElementsAre("plane", name));
    }
}

TEST(effect_plan, names_the_trims_as_they_are_asked_for)
{
    PackImage image = bare_plane();
    image.faces[0].flags = 0;
    RenderOptions options;
    for (const auto& [mode, name] : {std::pair{TrimMode::Auto, "trim-exact"}, std::pair{TrimMode::Sdf, "trim-sdf"},
                                     std::pair{TrimMode::Hybrid, "trim-hybrid"}, std::pair{TrimMode::Kd, "trim-kd"}}) {
        options.trim = mode;
        EXPECT_THAT(names(image, options), testing::Contains(name));
    }
}

TEST(effect_plan, names_reused_hits_where_they_are_asked_for_and_can_be)
{
    RenderOptions options;
    options.reuse_last = true;
    EXPECT_THAT(names(bare_plane(), options, DeviceKind::Vulkan),
                testing::ElementsAre("plane", "reused-hits", "shading"));
    EXPECT_THAT(names(bare_plane(), options, DeviceKind::Cpu), testing::ElementsAre("plane", "shading"));
    options.closest = ClosestPolicy::Stochastic;
    EXPECT_THAT(names(bare_plane(), options, DeviceKind::Vulkan),
                testing::ElementsAre("plane", "stochastic-starts", "shading"));
}

TEST(effect_plan, says_what_tracers_specialise_themselves_from)
{
    PackImage image = bare_plane();
    EffectPlan plan = plan_of(image);
    EXPECT_EQ(plan.kinds, 1u << kKindPlane);
    EXPECT_FALSE(plan.rational || plan.trims || plan.rims || plan.edges || plan.stochastic || plan.reuses_hits);
    EXPECT_TRUE(plan.shade);
    EXPECT_EQ(plan.trim, TrimMode::Exact);
    EXPECT_EQ(plan.stack_size, 8u) << "two trees of one node: 3 (1 + 1) + 2";
    EXPECT_EQ(plan.local_floats, 0u);
    EXPECT_EQ(plan.iteration_limit, 0u);
    image.patches.push_back(image.patches[0]);
    image.patches[1].shape = kKindBezier | 3u << 8 | 5u << 16 | kShapeRational;
    image.faces[0].flags = 1u << kFaceRimBit;
    RenderOptions options;
    options.edges = EdgeLines::Sharp;
    options.trim = TrimMode::Sdf;
    options.shade = false;
    plan = plan_of(image, options, DeviceKind::SoftwareVulkan);
    EXPECT_EQ(plan.kinds, 1u << kKindPlane | 1u << kKindBezier);
    EXPECT_TRUE(plan.rational && plan.trims && plan.rims);
    EXPECT_FALSE(plan.edges) << "lines are colours";
    EXPECT_EQ(plan.trim, TrimMode::Sdf);
    EXPECT_EQ(plan.local_floats, 4u * 6 * 4);
    const uint32_t without_edges = plan.iteration_limit;
    EXPECT_GT(without_edges, 0u);
    options.shade = true;
    plan = plan_of(image, options, DeviceKind::SoftwareVulkan);
    EXPECT_TRUE(plan.edges);
    EXPECT_LT(plan.iteration_limit, without_edges);
    image.patches[1].shape = kKindBezier | 25u << 8 | 25u << 16;
    EXPECT_EQ(plan_of(image, options, DeviceKind::SoftwareVulkan).local_floats, 0u) << "too large a net to copy";
    EXPECT_EQ(plan_of(image, options, DeviceKind::Vulkan).iteration_limit, 0u);
}

TEST(effect_plan, knows_the_degrees_that_all_bezier_patches_share_through_vulkan)
{
    PackImage image = bare_plane();
    const auto add = [&](uint32_t degree_u, uint32_t degree_v, uint32_t flags) {
        image.patches.push_back(image.patches[0]);
        image.patches.back().shape = kKindBezier | degree_u << 8 | degree_v << 16 | flags;
    };
    const auto degrees = [&](DeviceKind device) {
        const EffectPlan plan = plan_of(image, {}, device);
        return std::array{plan.degree_u, plan.degree_v, plan.largest_degree};
    };
    EXPECT_EQ(degrees(DeviceKind::Vulkan), (std::array{0u, 0u, 0u})) << "no such patches";
    add(1, 3, 0);
    add(1, 3, kShapeRational);
    EXPECT_EQ(degrees(DeviceKind::Vulkan), (std::array{1u, 3u, 3u}));
    EXPECT_THAT(plan_of(image, {}, DeviceKind::Vulkan).items,
                testing::Contains(
                    testing::AllOf(testing::Field(&EffectItem::name, "known-degrees"),
                                   testing::Field(&EffectItem::why, testing::HasSubstr("degree 1 in u, 3 in v")))));
    add(4, 3, 0);
    EXPECT_EQ(degrees(DeviceKind::SoftwareVulkan), (std::array{0u, 3u, 4u}));
    EXPECT_EQ(degrees(DeviceKind::Cpu), (std::array{0u, 0u, kMaxDegree})) << "the CPU tracer has its own functions";
    RenderOptions options;
    options.specialise = false;
    EXPECT_EQ(plan_of(image, options, DeviceKind::Vulkan).largest_degree, kMaxDegree);
}

TEST(effect_plan, has_every_scenes_sizes_where_tracers_are_not_to_specialise_themselves)
{
    RenderOptions options;
    const EffectPlan own = plan_of(bare_plane(), options, DeviceKind::SoftwareVulkan);
    options.specialise = false;
    const EffectPlan plan = plan_of(bare_plane(), options, DeviceKind::SoftwareVulkan);
    EXPECT_TRUE(own.specialised);
    EXPECT_FALSE(plan.specialised);
    EXPECT_GT(plan.stack_size, own.stack_size);
    EXPECT_GT(plan.local_floats, own.local_floats);
    EXPECT_LT(plan.iteration_limit, own.iteration_limit);
}

/// Asks for one thing.
struct LookCase {
    const char* name;
    std::vector<std::string> items; // after "plane" and "shading", but for what stands before shading
    uint32_t bits;
    std::function<void(RenderOptions&)> ask;
};

TEST(effect_plan, names_each_thing_a_scene_asks_for_and_only_that)
{
    const auto rule = [](auto set) {
        return [set](RenderOptions& o) { set(o.look.materials.emplace_back().material); };
    };
    static const Light directional{.kind = LightKind::Directional};
    const LookCase cases[] = {
        {"nothing", {"plane", "shading"}, 0, [](RenderOptions&) {}},
        {"parallel rays",
         {"plane", "orthographic", "shading"},
         kLookOrthographic,
         [](RenderOptions& o) { o.camera.orthographic_mm = 1; }},
        {"a plane",
         {"plane", "section", "caps", "shading"},
         kLookSection | kLookCaps,
         [](RenderOptions& o) { o.look.section.planes.resize(1); }},
        {"a plane without caps",
         {"plane", "section", "shading"},
         kLookSection,
         [](RenderOptions& o) {
             o.look.section.planes.resize(1);
             o.look.section.caps = CapStyle::None;
         }},
        {"a light",
         {"plane", "shading", "lights"},
         kLookLights,
         [](RenderOptions& o) { o.look.lights.resize(1, directional); }},
        {"shadows",
         {"plane", "shading", "lights", "shadows"},
         kLookLights | kLookShadows,
         [](RenderOptions& o) { o.look.lights.resize(1, directional), o.look.lights[0].shadows = true; }},
        {"a large light without shadows",
         {"plane", "shading", "lights"},
         kLookLights,
         [](RenderOptions& o) { o.look.lights.resize(1, directional), o.look.lights[0].half_angle_deg = 1; }},
        {"soft shadows",
         {"plane", "shading", "lights", "shadows", "soft-shadows"},
         kLookLights | kLookShadows | kLookSoftShadows,
         [](RenderOptions& o) {
             o.look.lights.resize(1, directional);
             o.look.lights[0].shadows = true;
             o.look.lights[0].half_angle_deg = 1;
         }},
        {"occlusion",
         {"plane", "shading", "occlusion"},
         kLookOcclusion,
         [](RenderOptions& o) { o.look.occlusion.samples = 4; }},
        {"a colour", {"plane", "shading", "materials"}, kLookMaterials, rule([](Material& m) {
             m.color = {1, 0, 0};
         })},
        {"an opacity of 1", {"plane", "shading"}, 0, rule([](Material& m) { m.opacity = 1; })},
        {"an opacity", {"plane", "shading", "transparency"}, kLookTransparency, rule([](Material& m) {
             m.opacity = 0.5f;
         })},
        {"x-ray",
         {"plane", "shading", "transparency"},
         kLookTransparency,
         [](RenderOptions& o) { o.look.xray = 0.5f; }},
        {"a mirror", {"plane", "shading", "mirrors"}, kLookMirrors, rule([](Material& m) { m.mirror = 0.5f; })},
        {"an environment",
         {"plane", "shading", "environment"},
         kLookEnvironment,
         [](RenderOptions& o) { o.look.environment = std::make_shared<Environment>(); }},
        {"a map",
         {"plane", "zebra", "shading"},
         kLookMap,
         [](RenderOptions& o) { o.look.map.map = SurfaceMap::Zebra; }},
        {"a placement hidden",
         {"plane", "arrangement", "shading"},
         kLookArrangement,
         [](RenderOptions& o) { o.look.arrangement.hide = {"a"}; }},
        {"placements moved apart",
         {"plane", "arrangement", "shading"},
         kLookArrangement,
         [](RenderOptions& o) { o.look.arrangement.explode = 0.5; }},
        {"a background",
         {"plane", "shading"},
         0,
         [](RenderOptions& o) {
             o.look.background = {1, 1, 1};
         }},
    };
    for (const LookCase& asked : cases) {
        RenderOptions options;
        asked.ask(options);
        EXPECT_EQ(names(bare_plane(), options), asked.items) << asked.name;
        EXPECT_EQ(look_bits(options), asked.bits) << asked.name;
        EXPECT_EQ(plan_of(bare_plane(), options).look, asked.bits) << asked.name;
        EXPECT_TRUE(check_look(options, asked.bits, "it").ok()) << asked.name;
        for (uint32_t bit = 0; bit < kLookBits; ++bit) {
            const bool needed = (asked.bits >> bit & 1) != 0;
            EXPECT_EQ(check_look(options, ~(1u << bit), "it").ok(), !needed) << asked.name;
        }
        options.shade = false;
        EXPECT_EQ(look_bits(options), asked.bits & (kLookArrangement | kLookOrthographic | kLookSection | kLookCaps))
            << asked.name;
    }
}

TEST(pack_facts, count_degrees_the_most_frequent_first)
{
    PackImage image = bare_plane();
    const auto add = [&image](uint degree_u, uint degree_v, uint rational, int count) {
        PatchRecord patch{};
        patch.shape = kKindBezier | degree_u << 8 | degree_v << 16 | rational;
        image.patches.insert(image.patches.end(), size_t(count), patch);
    };
    add(3, 3, 0, 2);
    add(2, 1, kShapeRational, 5);
    add(3, 3, kShapeRational, 1);
    const PackFacts facts = pack_facts(image);
    ASSERT_EQ(facts.degrees.size(), 3u);
    EXPECT_EQ(facts.degrees[0].patches, 5u);
    EXPECT_TRUE(facts.degrees[0].rational && facts.degrees[0].degree_u == 2 && facts.degrees[0].degree_v == 1);
    EXPECT_EQ(facts.degrees[1].patches, 2u);
    EXPECT_EQ(facts.rational_patches(), 6u);
    EXPECT_EQ(facts.bezier_patches(), 8u);
    EXPECT_EQ(facts.largest_degree(), 3u);
    EXPECT_EQ(facts.largest_net_floats, 4u * 4 * 4);
    EXPECT_THAT(plan_of(image).items[1].why, testing::HasSubstr("3 x 3: 2"));
}

TEST(faces_by_kind, counts_each_face_once)
{
    PackImage image = bare_plane();
    image.faces.resize(5, image.faces[0]);
    image.faces[3].surface_kind = kKindTorus;
    image.faces[4].surface_kind = kKindBezier;
    EXPECT_THAT(faces_by_kind(image), testing::ElementsAre(3, 0, 0, 0, 1, 1));
    EXPECT_STREQ(surface_kind_name(kKindTorus), "torus");
}

} // namespace
} // namespace trimray
