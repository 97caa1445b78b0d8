// The effect plan says what a pack calls for, neither less nor more.
#include "runtime/effect_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trimray {
namespace {

std::vector<std::string> names(const PackImage& image, const RenderOptions& options = {})
{
    std::vector<std::string> out;
    for (const EffectItem& item : effect_plan(image, options)) {
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
    EXPECT_TRUE(effect_plan({}, hits_only).empty()) << "an empty pack calls for nothing";
}

TEST(effect_plan, grows_by_what_is_added_and_by_nothing_else)
{
    PackImage image = bare_plane();
    image.patches.push_back(image.patches[0]);
    image.patches[1].shape = kKindBezier | 3u << 8 | 5u << 16;
    EXPECT_THAT(names(image), testing::ElementsAre("plane", "bezier", "shading"));
    image.patches[1].shape |= kShapeRational;
    EXPECT_THAT(names(image), testing::ElementsAre("plane", "bezier-rational", "shading"));
    EXPECT_THAT(effect_plan(image, {})[1].why, testing::HasSubstr("degree up to 5"));
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
    EXPECT_THAT(names(bare_plane(), options), testing::ElementsAre("plane", "reused-hits", "shading"));
    options.closest = ClosestPolicy::Stochastic;
    EXPECT_THAT(names(bare_plane(), options), testing::ElementsAre("plane", "stochastic-starts", "shading"));
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
