// Placements hidden, shown alone and moved apart: pictures are those of packs without what is hidden, and of packs with
// everything placed where it is moved to; names mean what they should.
#include "runtime/arrangement.h"
#include "tests/compare_frames.h"
#include "tests/kit_scene.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <string>

namespace trimray {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

using Numbers = std::vector<uint32_t>;

struct Case {
    Arrangement asked;
    Numbers left; // placements
};

std::vector<Case> cases()
{
    return {{{{}, {"lid"}, 0}, {0, 1, 3}},
            {{{"rings"}, {}, 0}, {1, 3}},
            {{{"#0", "@3"}, {"base"}, 0}, {2, 3}},
            {{{"left"}, {}, 0}, {1}},
            {{{}, {"#1", "lid"}, 0}, {0}}};
}

void expect_same(const Frame& a, const Frame& b, const std::string& what)
{
    EXPECT_TRUE(same_bits(a.rgba, b.rgba)) << what;
    EXPECT_TRUE(same_bits(a.depth_mm, b.depth_mm)) << what;
    EXPECT_TRUE(same_bits(a.normal, b.normal)) << what;
    EXPECT_TRUE(same_bits(a.uv, b.uv)) << what;
    EXPECT_TRUE(same_bits(a.face, b.face)) << what;
    EXPECT_TRUE(same_bits(a.instance, b.instance)) << what;
    EXPECT_TRUE(same_bits(a.certified, b.certified)) << what;
}

/// Where a placement is moved by sums in another order: bits differ, pictures hardly.
void expect_alike(const Frame& expected, const Frame& frame, const RenderOptions& options)
{
    ASSERT_EQ(expected.face.size(), frame.face.size());
    const Disagreement d = compare(expected, frame, options);
    EXPECT_GT(d.hits, 100);
    EXPECT_LE(d.strangers + d.borders, int(frame.face.size() / 500));
    EXPECT_LE(d.depth, 1e-6);
    EXPECT_LE(d.normal, 1e-4);
    int other_colors = 0;
    for (size_t i = 0; i < frame.rgba.size(); ++i)
        other_colors += std::abs(frame.rgba[i] - expected.rgba[i]) > 1e-2f;
    EXPECT_LE(other_colors, int(frame.rgba.size() / 500));
}

std::shared_ptr<const Scene> whole_kit()
{
    return kit_of({0, 1, 2, 3});
}

ArrangedPlacements arranged(const PackImage& image, const Arrangement& asked)
{
    Result<ArrangedPlacements> made = arrange(image, asked);
    EXPECT_TRUE(made.ok()) << made.error().where << ": " << made.error().detail;
    return made.ok() ? std::move(*made) : ArrangedPlacements{};
}

Numbers shown(const PackImage& image, const Arrangement& asked)
{
    const ArrangedPlacements made = arranged(image, asked);
    Numbers numbers;
    for (uint32_t i = 0; i < made.visible.size(); ++i)
        if (made.visible[i])
            numbers.push_back(i);
    return numbers;
}

TEST(arrangement, the_tree_over_all_placements_is_the_packs_own)
{
    const auto scene = whole_kit();
    const PackImage& image = scene->pack.image;
    const TopTree tree = derive_top_tree(image, image.instances);
    ASSERT_EQ(tree.nodes.size(), image.top_nodes.size());
    EXPECT_EQ(std::memcmp(tree.nodes.data(), image.top_nodes.data(), tree.nodes.size() * sizeof(BvhNode)), 0);
    EXPECT_EQ(tree.scale_mm, image.world_scale_mm);
    for (size_t c = 0; c < 3; ++c) {
        EXPECT_EQ(tree.origin_mm[c], image.world_origin_mm[c]);
        EXPECT_EQ(tree.bounds_lo_mm[c], image.bounds_lo_mm[c]);
        EXPECT_EQ(tree.bounds_hi_mm[c], image.bounds_hi_mm[c]);
    }
}

TEST(arrangement, names_and_numbers_mean_placements)
{
    const auto scene = whole_kit();
    const PackImage& image = scene->pack.image;
    for (const Case& one : cases())
        EXPECT_EQ(shown(image, one.asked), one.left);
    EXPECT_THAT(shown(image, {}), ElementsAre(0, 1, 2, 3));
    EXPECT_THAT(shown(image, {{}, {"plates", "rings"}, 0}), ElementsAre());
}

TEST(arrangement, names_that_are_nothings_are_told)
{
    const auto scene = whole_kit();
    const PackImage& image = scene->pack.image;
    const ArrangedPlacements made = arranged(image, {{"base", "bse"}, {"Lid", "lid"}, 0});
    EXPECT_THAT(made.unmatched, ElementsAre("bse", "Lid"));
    EXPECT_THAT(shown(image, {{"nobody"}, {}, 0}), ElementsAre());
}

TEST(arrangement, numbers_that_the_pack_has_not_are_faults)
{
    const auto scene = whole_kit();
    const PackImage& image = scene->pack.image;
    const std::pair<const char*, const char*> faults[] = {
        {"#2", "'#2': after # the number of a part is expected, below 2"},
        {"#", "'#': after # the number"},
        {"#1x", "'#1x': after # the number"},
        {"#-1", "'#-1': after # the number"},
        {"@4", "'@4': after @ the number of a placement is expected, below 4"},
        {"@99999999999", "'@99999999999': after @ the number"},
    };
    for (const auto& [name, says] : faults) {
        for (const Arrangement& asked : {Arrangement{{name}, {}, 0}, Arrangement{{}, {name}, 0}}) {
            const Result<ArrangedPlacements> made = arrange(image, asked);
            ASSERT_FALSE(made.ok()) << name;
            EXPECT_EQ(made.error().code, ErrorCode::InvalidScene);
            EXPECT_THAT(made.error().detail, HasSubstr(says));
        }
    }
    for (const double explode : {-0.1, double(INFINITY), double(NAN)}) {
        const Result<ArrangedPlacements> made = arrange(image, {{}, {}, explode});
        ASSERT_FALSE(made.ok()) << explode;
        EXPECT_EQ(made.error().code, ErrorCode::Usage);
    }
}

TEST(arrangement, a_name_that_begins_as_a_number_does_is_a_name)
{
    PackImage image = kit_image();
    image.instances[2].name = image.strings.add("#lid");
    const auto scene = kit_scene(std::move(image));
    EXPECT_THAT(shown(scene->pack.image, {{"#lid"}, {}, 0}), ElementsAre(2));
}

TEST(arrangement, what_is_hidden_is_as_if_it_were_not_there)
{
    const auto scene = whole_kit();
    const auto tracer = make_cpu_tracer(scene); // one for all: each picture must forget the last one's arrangement
    ASSERT_TRUE(tracer.ok());
    for (const bool effects : {false, true})
        for (const Case& one : cases()) {
            RenderOptions options = kit_picture(120, 80);
            if (effects)
                add_effects(options);
            else
                options.edges = EdgeLines::Sharp, options.silhouettes = true;
            const Drawn expected = draw(kit_of(one.left), options);
            options.look.arrangement = one.asked;
            RenderStats stats;
            const Result<Frame> frame = (*tracer)->render(options, stats);
            ASSERT_TRUE(frame.ok()) << frame.error().detail;
            const std::string what = fmt::format("{} left, effects: {}", one.left.size(), effects);
            EXPECT_GT(count_hits(*frame), 150) << what;
            expect_same(renumbered(expected.frame, one.left), *frame, what);
            EXPECT_EQ(stats.work.rays, expected.stats.work.rays) << what;
            EXPECT_EQ(stats.work.node_visits, expected.stats.work.node_visits) << what;
            EXPECT_EQ(stats.work.leaf_visits, expected.stats.work.leaf_visits) << what;
            EXPECT_EQ(stats.work.free_leaf_visits, expected.stats.work.free_leaf_visits) << what;
        }
}

TEST(arrangement, placements_apart_are_as_if_they_were_placed_there)
{
    const auto tracer = make_cpu_tracer(whole_kit());
    ASSERT_TRUE(tracer.ok());
    for (const double by : {0.5, 2.0})
        for (const Numbers& left : {Numbers{0, 1, 2, 3}, Numbers{1, 2, 3}}) {
            RenderOptions options = kit_picture(120, 80);
            options.camera.eye = {30, -80, 55};
            add_effects(options);
            options.look.section.planes[0].point_mm[2] = 24;
            const Drawn expected = draw(kit_apart(left, by), options);
            options.look.arrangement.explode = by;
            if (left.size() < 4)
                options.look.arrangement.hide = {"base"};
            RenderStats stats;
            const Result<Frame> frame = (*tracer)->render(options, stats);
            ASSERT_TRUE(frame.ok()) << frame.error().detail;
            expect_alike(renumbered(expected.frame, left), *frame, options);
        }
}

TEST(arrangement, a_placement_turned_askew_moves_by_its_own_middle)
{
    PackImage image = kit_image();
    const double c = std::sqrt(0.5);
    const std::array<double, 12> turned{c, -c, 0, 20, c, c, 0, 0, 0, 0, 1, 0};
    std::copy(turned.begin(), turned.end(), image.instances[3].transform);
    const auto scene = kit_scene(std::move(image));
    const PackImage& pack = scene->pack.image;
    const ArrangedPlacements made = arranged(pack, {{}, {}, 2});
    InstanceRecord plain{}; // its part as it is
    plain.part = pack.instances[3].part;
    plain.transform[0] = plain.transform[5] = plain.transform[10] = 1;
    const Point3 m = middle_of(pack, plain);
    const Point3 at{c * m[0] - c * m[1] + 20, c * m[0] + c * m[1], m[2]};
    for (size_t i = 0; i < 3; ++i) {
        const double middle = (pack.bounds_lo_mm[i] + pack.bounds_hi_mm[i]) / 2;
        EXPECT_NEAR(made.instances[3].transform[4 * i + 3] - turned[4 * i + 3], 2 * (at[i] - middle), 1e-9);
    }
}

TEST(arrangement, nothing_left_is_an_empty_picture)
{
    RenderOptions options = kit_picture(40, 30);
    add_effects(options);
    options.look.background = {1, 0, 0};
    options.look.arrangement.hide = {"plates", "rings"};
    for (const auto& scene : {whole_kit(), kit_of({0})}) { // a tree, and the only placement
        const Drawn drawn = draw(scene, options);
        EXPECT_EQ(count_hits(drawn.frame), 0);
        EXPECT_EQ(drawn.frame.rgba[3], 0);
        EXPECT_EQ(drawn.frame.depth_mm[0], std::numeric_limits<float>::infinity());
    }
}

TEST(arrangement, a_fault_leaves_the_tracer_as_it_was)
{
    const auto tracer = make_cpu_tracer(whole_kit());
    ASSERT_TRUE(tracer.ok());
    RenderOptions options = kit_picture(60, 40);
    RenderStats stats;
    options.look.arrangement.hide = {"lid"};
    const Result<Frame> before = (*tracer)->render(options, stats);
    options.look.arrangement.hide = {"#7"};
    const Result<Frame> faulty = (*tracer)->render(options, stats);
    ASSERT_FALSE(faulty.ok());
    EXPECT_EQ(faulty.error().code, ErrorCode::InvalidScene);
    options.look.arrangement.hide = {"lid"};
    const Result<Frame> after = (*tracer)->render(options, stats);
    ASSERT_TRUE(before.ok() && after.ok());
    expect_same(*before, *after, "after a fault");
}

TEST(arrangement, the_reference_has_it_too)
{
    const auto tracer = make_reference_tracer(whole_kit());
    for (const Case& one :
         {Case{{{"rings"}, {}, 0}, {1, 3}}, Case{{{}, {"lid"}, 1}, {0, 1, 3}}, Case{{}, {0, 1, 2, 3}}}) {
        RenderOptions options = kit_picture(60, 45);
        RenderStats stats;
        const auto alone =
            make_reference_tracer(one.asked.explode > 0 ? kit_apart(one.left, one.asked.explode) : kit_of(one.left));
        const Result<Frame> expected = alone->render(options, stats);
        options.look.arrangement = one.asked;
        const Result<Frame> frame = tracer->render(options, stats);
        ASSERT_TRUE(expected.ok() && frame.ok());
        expect_alike(renumbered(*expected, one.left), *frame, options);
    }
}

} // namespace
} // namespace trimray
