// What effects cost: what is left where one is turned off, the sums on pictures whose times are known, and that real
// pictures take more rays and time with them.
#include "runtime/view/effect_costs.h"

#include "runtime/differing_pixels.h"
#include "runtime/effect_plan.h"
#include "tests/kit_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <string>
#include <vector>

namespace trimray {
namespace {

/// Everything at once that can be turned off, but for maps.
RenderOptions everything(uint32_t width, uint32_t height)
{
    RenderOptions options = kit_picture(width, height);
    options.threads = 1;
    add_effects(options);
    options.camera.orthographic_mm = 40;
    options.look.section.caps = CapStyle::Hatched;
    options.look.arrangement.hide = {"lid"};
    options.look.materials.push_back({});
    options.look.materials.back().material.color = {0.5f, 0.2f, 0.1f};
    options.look.environment =
        std::make_shared<Environment>(Environment{4, 2, std::vector<float>(24, 0.5f), "a grey room"});
    options.edges = EdgeLines::All;
    options.silhouettes = options.antialias_trims = true;
    options.fill = false;
    return options;
}

std::vector<std::string> item_names(const PackImage& image, const RenderOptions& options)
{
    std::vector<std::string> names;
    for (const EffectItem& item : effect_plan(pack_facts(image), options, DeviceKind::Cpu).items)
        names.push_back(item.name);
    return names;
}

std::vector<std::string> less(const std::vector<std::string>& all, const std::vector<std::string>& left)
{
    std::vector<std::string> gone;
    for (const std::string& name : all)
        if (std::find(left.begin(), left.end(), name) == left.end())
            gone.push_back(name);
    return gone;
}

TEST(effect_costs, without_an_effect_the_plan_has_it_no_more_and_all_that_does_not_need_it)
{
    const PackImage image = kit_of({0, 1, 2, 3})->pack.image;
    const RenderOptions options = everything(16, 12);
    const std::vector<std::string> all = item_names(image, options);
    std::vector<std::string> removed;
    for (const std::string& name : removable_effects()) {
        if (std::find(all.begin(), all.end(), name) == all.end())
            continue;
        removed.push_back(name);
        std::vector<std::string> expected{name};
        if (name == "section")
            expected = {"section", "caps"};
        if (name == "edges")
            expected = {"edges", "edges-smooth"};
        if (name == "shadows")
            expected = {"shadows", "soft-shadows"};
        if (name == "lights")
            expected = {"lights", "shadows", "soft-shadows"};
        EXPECT_EQ(less(all, item_names(image, without_effect(name, options))), expected);
        EXPECT_TRUE(less(item_names(image, without_effect(name, options)), all).empty()) << "nothing is added";
    }
    EXPECT_EQ(removed.size(), removable_effects().size() - 7) << "all but the maps were on";
}

TEST(effect_costs, a_map_is_turned_off_by_its_name)
{
    const PackImage image = kit_of({0, 1, 3})->pack.image;
    for (const SurfaceMap map :
         {SurfaceMap::Zebra, SurfaceMap::Isophotes, SurfaceMap::CurvatureGaussian, SurfaceMap::CurvatureMean,
          SurfaceMap::CurvatureMax, SurfaceMap::CurvatureMin, SurfaceMap::Draft}) {
        RenderOptions options = kit_picture(16, 12);
        const std::vector<std::string> plain = item_names(image, options);
        options.look.map.map = map;
        const std::vector<std::string> added = less(item_names(image, options), plain);
        ASSERT_EQ(added.size(), 1u);
        EXPECT_THAT(removable_effects(), testing::Contains(added[0]));
        EXPECT_EQ(item_names(image, without_effect(added[0], options)), plain);
    }
}

TEST(effect_costs, without_all_effects_the_picture_is_the_plain_one)
{
    const auto scene = kit_of({0, 1, 2, 3});
    RenderOptions options = everything(64, 48);
    for (const std::string& name : removable_effects())
        if (name != "orthographic")
            options = without_effect(name, options);
    RenderOptions plain = kit_picture(64, 48);
    plain.camera.orthographic_mm = 40;
    EXPECT_EQ(differing_pixels(draw(scene, options).frame, draw(scene, plain).frame), 0u);
    EXPECT_NE(differing_pixels(draw(scene, everything(64, 48)).frame, draw(scene, plain).frame), 0u);
}

/// Makes no pictures, but takes the time that is told: of each effect so much, and a disturbance that grows with every
/// picture.
class KnownTimes final : public Tracer {
public:
    DeviceKind device_kind() const override { return DeviceKind::Cpu; }
    std::string device_name() const override { return "known times"; }
    Result<Frame> render(const RenderOptions& options, RenderStats& stats) override
    {
        EXPECT_FALSE(options.reuse_last);
        ++pictures;
        double ms = 10 + growth_ms * pictures;
        ms += options.edges != EdgeLines::None ? 2.0 : 0.0;
        ms += options.look.occlusion.samples;
        ms -= options.look.arrangement.any() ? 4.0 : 0.0;
        if (options.edges == EdgeLines::None || options.look.occlusion.samples == 0)
            ms += jitter_ms * (pictures % 3);
        stats = {};
        stats.device = device_name();
        stats.frame_ms = {ms};
        stats.work.rays = uint64_t{options.width} * options.height;
        stats.work.free_rays = stats.work.rays * options.look.occlusion.samples;
        return Frame{};
    }
    int pictures = 0;
    double growth_ms = 0;
    double jitter_ms = 0; // of pictures without edges, or without occlusion
};

RenderOptions three_effects()
{
    RenderOptions options = kit_picture(8, 6);
    options.reuse_last = true;
    options.edges = EdgeLines::Sharp;
    options.look.occlusion.samples = 5;
    options.look.arrangement.hide = {"lid"};
    return options;
}

const EffectCost& cost_of(const EffectCosts& costs, const std::string& name)
{
    return *std::find_if(costs.effects.begin(), costs.effects.end(),
                         [&](const EffectCost& cost) { return cost.name == name; });
}

TEST(effect_costs, are_the_time_with_less_the_time_without)
{
    const PackImage image = kit_of({0, 1, 2, 3})->pack.image;
    const RenderOptions options = three_effects();
    for (const double growth_ms : {0.0, 0.01}) { // pictures there and back see the same disturbance
        KnownTimes tracer;
        tracer.growth_ms = growth_ms;
        const Result<EffectCosts> costs = measure_effect_costs(tracer, image, options, {.rounds = 6});
        ASSERT_TRUE(costs.ok());
        EXPECT_NEAR(*cost_of(*costs, "edges").ms, 2, 1e-9);
        EXPECT_NEAR(*cost_of(*costs, "occlusion").ms, 5, 1e-9);
        EXPECT_NEAR(*cost_of(*costs, "arrangement").ms, -4, 1e-9);
        EXPECT_EQ(cost_of(*costs, "occlusion").error_ms > 0, growth_ms > 0);
        EXPECT_EQ(costs->error_ms > 0, growth_ms > 0);
        EXPECT_EQ(costs->rounds, 6u);
        EXPECT_EQ(tracer.pictures, 4 * (1 + 2 * 6)); // once before, twice a round
        EXPECT_EQ(cost_of(*costs, "occlusion").work_without.free_rays, 0u);
        EXPECT_EQ(costs->work.free_rays, 5u * 48);
        EXPECT_EQ(costs->device, "known times");
    }
}

TEST(effect_costs, have_no_smaller_errors_than_most_others)
{
    const PackImage image = kit_of({0, 1, 2, 3})->pack.image;
    KnownTimes tracer;
    tracer.jitter_ms = 1;
    const Result<EffectCosts> costs = measure_effect_costs(tracer, image, three_effects(), {.rounds = 6});
    ASSERT_TRUE(costs.ok());
    EXPECT_EQ(costs->error_ms, 0);
    EXPECT_GT(cost_of(*costs, "edges").error_ms, 0);
    EXPECT_GT(cost_of(*costs, "occlusion").error_ms, 0);
    EXPECT_EQ(cost_of(*costs, "arrangement").error_ms,
              std::min(cost_of(*costs, "edges").error_ms, cost_of(*costs, "occlusion").error_ms))
        << "its own rounds agree, but those of most others do not";
}

TEST(effect_costs, name_every_item_of_the_plan_with_its_reason)
{
    const PackImage image = kit_of({0, 1, 2, 3})->pack.image;
    RenderOptions options = everything(8, 6);
    options.look.arrangement.hide = {"lid", "right"};
    KnownTimes tracer;
    const Result<EffectCosts> costs = measure_effect_costs(tracer, image, options, {.rounds = 2});
    ASSERT_TRUE(costs.ok());
    std::vector<std::string> names;
    for (const EffectCost& cost : costs->effects) {
        names.push_back(cost.name);
        EXPECT_FALSE(cost.why.empty());
        const std::vector<std::string> removable = removable_effects();
        EXPECT_EQ(cost.ms.has_value(), std::find(removable.begin(), removable.end(), cost.name) != removable.end());
    }
    EXPECT_EQ(names, item_names(image, options));
    EXPECT_THAT(cost_of(*costs, "arrangement").why, testing::HasSubstr("2 of 4 placements are shown"));
    EXPECT_EQ(cost_of(*costs, "section").takes_along, std::vector<std::string>{"caps"});
    EXPECT_FALSE(cost_of(*costs, "plane").ms);
}

TEST(effect_costs, of_real_pictures_are_rays_and_time)
{
    const auto scene = kit_of({0, 1, 2, 3});
    RenderOptions options = kit_picture(40, 30);
    options.threads = 1;
    options.look.occlusion.samples = 16;
    options.edges = EdgeLines::Sharp;
    const auto tracer = make_cpu_tracer(scene);
    ASSERT_TRUE(tracer.ok());
    double last_share = 0;
    TurnOptions turns;
    turns.rounds = 2;
    turns.samples = 2;
    turns.progress = [&](double share) {
        EXPECT_GT(share, last_share);
        last_share = share;
    };
    const Result<EffectCosts> costs = measure_effect_costs(**tracer, scene->pack.image, options, turns);
    ASSERT_TRUE(costs.ok());
    EXPECT_EQ(costs->work.rays, 4u * 40 * 30);
    const EffectCost &occlusion = cost_of(*costs, "occlusion"), &edges = cost_of(*costs, "edges");
    EXPECT_GE(costs->work.free_rays, occlusion.work_without.free_rays + 16 * 500);
    EXPECT_EQ(edges.work_without.edge_tests, 0u);
    EXPECT_GT(costs->work.edge_tests, 0u);
    // sixteen rays a hit against one a pixel
    EXPECT_GT(*occlusion.ms, 0.3 * costs->picture_ms);
    EXPECT_LT(*occlusion.ms, costs->picture_ms);
    EXPECT_NEAR(last_share, 1, 1e-9);
}

TEST(effect_costs, can_be_given_up)
{
    const auto scene = kit_of({0, 1, 2, 3});
    const auto tracer = make_cpu_tracer(scene);
    ASSERT_TRUE(tracer.ok());
    for (const int after : {0, 1, 40}) { // during the first picture, or a later one
        RenderOptions options = three_effects();
        options.width = 80;
        options.height = 60;
        std::atomic<int> asked{0};
        options.cancelled = [&] { return asked++ >= after; };
        const Result<EffectCosts> costs =
            measure_effect_costs(**tracer, scene->pack.image, options, {.rounds = 1000, .seconds = 1000});
        ASSERT_FALSE(costs.ok());
        EXPECT_EQ(costs.error().code, ErrorCode::Interrupted);
        EXPECT_LE(asked, after + 200) << "no picture is made any more, but the rest of its blocks say no";
    }
}

TEST(effect_costs, begin_no_picture_once_they_are_given_up)
{
    const PackImage image = kit_of({0, 1, 2, 3})->pack.image;
    RenderOptions options = three_effects();
    KnownTimes tracer;
    options.cancelled = [&] { return tracer.pictures >= 7; };
    EXPECT_EQ(measure_effect_costs(tracer, image, options, {}).error().code, ErrorCode::Interrupted);
    EXPECT_EQ(tracer.pictures, 7);
}

TEST(effect_costs, end_in_time_with_what_was_measured)
{
    const PackImage image = kit_of({0, 1, 2, 3})->pack.image;
    KnownTimes tracer;
    TurnOptions turns{.rounds = 1000, .seconds = 0};
    double last_share = 0;
    turns.progress = [&](double share) { last_share = share; };
    const Result<EffectCosts> costs = measure_effect_costs(tracer, image, three_effects(), turns);
    ASSERT_TRUE(costs.ok());
    EXPECT_EQ(last_share, 1);
    EXPECT_EQ(costs->rounds, 2u);
    EXPECT_NEAR(*cost_of(*costs, "occlusion").ms, 5, 1e-9);
}

TEST(effect_costs, fail_as_the_picture_does)
{
    const auto scene = kit_of({0, 1, 2, 3});
    const auto tracer = make_cpu_tracer(scene);
    ASSERT_TRUE(tracer.ok());
    RenderOptions options = three_effects();
    options.look.arrangement.hide = {"@17"};
    const Result<EffectCosts> costs = measure_effect_costs(**tracer, scene->pack.image, options, {});
    ASSERT_FALSE(costs.ok());
    EXPECT_EQ(costs.error().code, ErrorCode::InvalidScene);
}

} // namespace
} // namespace trimray
