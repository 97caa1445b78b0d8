// What a time budget gives up and in which order, and the search for what fits, with times made up.
#include "runtime/time_budget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>

namespace trimray {
namespace {

using testing::ElementsAre;
using testing::Field;

RenderOptions everything()
{
    RenderOptions options;
    options.width = 640;
    options.height = 360;
    options.antialias_trims = true;
    options.edges = EdgeLines::Sharp;
    Light sun;
    sun.shadows = true;
    sun.half_angle_deg = 2;
    options.look.lights = {sun};
    options.look.occlusion.samples = 20;
    options.look.mirror_depth = 3;
    options.look.materials = {MaterialRule{}};
    options.look.materials[0].material.mirror = 0.5f;
    return options;
}

TEST(time_budget, nothing_but_size_is_given_up_of_a_plain_picture)
{
    RenderOptions options;
    options.width = 640;
    options.height = 360;
    EXPECT_THAT(effort_ladder(options, 1), ElementsAre(Effort{}, Effort{.shrink = 2}, Effort{.shrink = 3},
                                                       Effort{.shrink = 4}, Effort{.shrink = 6}, Effort{.shrink = 8}));
    options.height = 47; // a third would have 16
    EXPECT_THAT(effort_ladder(options, 1), ElementsAre(Effort{}, Effort{.shrink = 2}));
    options.height = 8;
    EXPECT_THAT(effort_ladder(options, 1), ElementsAre(Effort{}));
    options.look.map.map = SurfaceMap::Zebra; // hides what light there is
    options.look.occlusion.samples = 16;
    EXPECT_THAT(effort_ladder(options, 1), ElementsAre(Effort{}));
}

TEST(time_budget, a_light_without_a_size_throws_no_soft_shadows_to_give_up)
{
    RenderOptions options = everything();
    options.look.lights[0].half_angle_deg = 0;
    EXPECT_EQ(effort_of(options, 1).light_samples, 0u);
    options.look.lights[0].half_angle_deg = 1;
    EXPECT_EQ(effort_of(options, 1).light_samples, 16u);
    options.look.lights[0].shadows = false;
    EXPECT_EQ(effort_of(options, 1).light_samples, 0u);
}

TEST(time_budget, the_ladder_gives_up_one_thing_after_the_other)
{
    const std::vector<Effort> ladder = effort_ladder(everything(), 5);
    Effort now{.samples = 5, .occlusion = 20, .light_samples = 16, .mirror_depth = 3, .smoothed = true};
    std::vector<Effort> expected{now};
    const auto then = [&](auto member, auto value) {
        now.*member = value;
        expected.push_back(now);
    };
    for (const uint32_t samples : {3u, 2u, 1u})
        then(&Effort::samples, samples);
    then(&Effort::occlusion, 10u);
    then(&Effort::occlusion, 5u);
    then(&Effort::occlusion, 4u);
    then(&Effort::light_samples, 8u);
    then(&Effort::light_samples, 4u);
    then(&Effort::light_samples, 0u);
    then(&Effort::mirror_depth, 1u);
    then(&Effort::smoothed, false);
    then(&Effort::occlusion, 0u);
    for (const uint32_t shrink : {2u, 3u, 4u, 6u, 8u})
        then(&Effort::shrink, shrink);
    EXPECT_EQ(ladder, expected);
}

TEST(time_budget, an_effort_is_what_is_traced)
{
    const RenderOptions asked = everything();
    for (const Effort& effort : effort_ladder(asked, 3)) {
        const RenderOptions traced = with_effort(asked, effort);
        Effort made = effort_of(traced, effort.samples);
        made.shrink = effort.shrink; // sizes are another's to set
        EXPECT_EQ(made, effort);
        EXPECT_EQ(traced.edges, EdgeLines::Sharp) << "content stays";
        EXPECT_TRUE(traced.look.lights[0].shadows);
    }
}

TEST(time_budget, what_is_given_up_is_named_once_with_both_ends)
{
    const std::vector<Effort> ladder = effort_ladder(everything(), 4);
    EXPECT_TRUE(given_up(ladder.front(), ladder.front()).empty());
    const std::vector<GivenUp> all = given_up(ladder.front(), ladder.back());
    const auto is = [](const char* what, const char* from, const char* to) {
        return testing::AllOf(Field(&GivenUp::what, what), Field(&GivenUp::from, from), Field(&GivenUp::to, to));
    };
    EXPECT_THAT(all, ElementsAre(is("samples a pixel", "4 x 4", "1 x 1"), is("rays of occlusion", "20", "0"),
                                 is("shadows", "soft, 16 rays a light", "hard"), is("mirror depth", "3", "1"),
                                 is("smoothed trims", "yes", "no"), is("size traced", "full", "1/8")));
}

/// A machine on which rung i takes really[i] ms and a probe says probed[i].
struct Machine {
    std::vector<double> really, probed;
    std::vector<size_t> probes{}, pictures{};

    /// Makes a picture; the rung that is shown.
    size_t make(BudgetSearch& search)
    {
        search.begin_picture();
        size_t shown = really.size();
        while (true) {
            const Result<std::optional<size_t>> next = search.next([this](size_t i) -> Result<double> {
                probes.push_back(i);
                return probed[i];
            });
            if (!next.ok() || !*next)
                return shown;
            pictures.push_back(**next);
            if (search.measured(**next, really[**next]))
                shown = **next;
        }
    }
};

TEST(time_budget, what_fits_whole_is_made_once_and_nothing_else_is_probed)
{
    Machine machine{{100, 50, 25}, {90, 50, 25}};
    BudgetSearch search(3, 95);
    EXPECT_EQ(machine.make(search), 0u);
    EXPECT_TRUE(search.best_fits()) << "a tenth over";
    EXPECT_EQ(search.best_ms(), 100);
    EXPECT_THAT(machine.probes, ElementsAre(0));
    EXPECT_THAT(machine.pictures, ElementsAre(0));
}

TEST(time_budget, the_first_rung_that_fits_is_made)
{
    Machine machine{{100, 50, 25, 10}, {100, 50, 25, 10}};
    BudgetSearch search(4, 30);
    EXPECT_EQ(machine.make(search), 2u);
    EXPECT_THAT(machine.pictures, ElementsAre(2));
    EXPECT_THAT(machine.probes, ElementsAre(0, 1, 2));
}

TEST(time_budget, a_picture_over_the_budget_is_made_again_with_less)
{
    Machine machine{{200, 100, 60, 40, 20}, {100, 50, 30, 20, 10}}; // twice as slow as the probes said
    BudgetSearch search(5, 50);
    EXPECT_EQ(machine.make(search), 3u);
    EXPECT_THAT(machine.pictures, ElementsAre(1, 3)) << "what the first took says that the second will not do either";
    EXPECT_TRUE(search.best_fits());
}

TEST(time_budget, a_picture_well_below_the_budget_is_made_again_with_more)
{
    Machine machine{{100, 50, 25, 10}, {400, 200, 100, 40}}; // four times as fast as the probes said
    BudgetSearch search(4, 60);
    EXPECT_EQ(machine.make(search), 1u);
    EXPECT_THAT(machine.pictures, ElementsAre(3, 1));
    EXPECT_EQ(search.best_ms(), 50);
}

TEST(time_budget, an_upgrade_that_does_not_fit_leaves_the_picture_that_did)
{
    Machine machine{{100, 90, 80, 10}, {400, 200, 100, 40}};
    BudgetSearch search(4, 60);
    EXPECT_EQ(machine.make(search), 3u);
    EXPECT_THAT(machine.pictures, ElementsAre(3, 1, 2)) << "two upgrades, of which none fits";
    EXPECT_EQ(search.best_ms(), 10);
    EXPECT_TRUE(search.best_fits());
}

TEST(time_budget, nothing_fits_and_the_cheapest_is_made)
{
    Machine machine{{100, 50, 25}, {100, 50, 25}};
    BudgetSearch search(3, 1e-6);
    EXPECT_EQ(machine.make(search), 2u);
    EXPECT_FALSE(search.best_fits());
    EXPECT_THAT(machine.pictures, ElementsAre(2));
}

TEST(time_budget, a_picture_of_which_nothing_can_be_given_up_is_made_at_once)
{
    Machine machine{{100}, {100}};
    BudgetSearch search(1, 50);
    EXPECT_EQ(machine.make(search), 0u);
    EXPECT_FALSE(search.best_fits());
    EXPECT_TRUE(machine.probes.empty());
}

TEST(time_budget, later_pictures_begin_where_the_last_one_ended_and_are_not_probed)
{
    Machine machine{{200, 100, 60, 40, 20}, {100, 50, 30, 20, 10}};
    BudgetSearch search(5, 50);
    machine.make(search);
    machine.probes.clear();
    machine.pictures.clear();
    EXPECT_EQ(machine.make(search), 3u);
    EXPECT_THAT(machine.pictures, ElementsAre(3));
    for (double& ms : machine.really) // a view that is easier
        ms /= 2;
    EXPECT_EQ(machine.make(search), 1u);
    EXPECT_THAT(machine.pictures, ElementsAre(3, 3, 1));
    for (double& ms : machine.really) // and a harder one
        ms *= 4;
    EXPECT_EQ(machine.make(search), 4u);
    EXPECT_THAT(machine.probes, ElementsAre(4)) << "no picture before came so far down";
}

TEST(time_budget, a_probe_that_fails_ends_the_search)
{
    BudgetSearch search(2, 1);
    search.begin_picture();
    const auto next = search.next([](size_t) -> Result<double> { return Error{ErrorCode::DeviceFailed, "a", "b"}; });
    ASSERT_FALSE(next.ok());
    EXPECT_EQ(next.error().code, ErrorCode::DeviceFailed);
}

} // namespace
} // namespace trimray
