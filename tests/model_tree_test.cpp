// The assembly as a tree to show, on trees made by hand and on a large one.
#include "runtime/view/model_tree.h"

#include "format/pack_reader.h"
#include "tests/model_trees.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trimray {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(model_tree, nodes_have_labels_colours_children_and_placements)
{
    const Car car;
    const ModelTree tree(car.image);
    std::vector<std::string> labels;
    for (const ModelTreeNode& node : tree.nodes())
        labels.push_back(node.label);
    EXPECT_THAT(labels, ElementsAre("car", "Wheels", "Assembly 2", "Кузов", "wheel 1", "Part 2"));
    EXPECT_TRUE(tree.nodes()[1].named);
    EXPECT_FALSE(tree.nodes()[5].named);
    EXPECT_EQ(tree.nodes()[1].color_rgba, 0xff0000ffu);
    EXPECT_EQ(tree.nodes()[3].color_rgba, std::nullopt);
    EXPECT_THAT(tree.children(0), ElementsAre(1, 2, 3));
    EXPECT_THAT(tree.children(1), ElementsAre(4, 5));
    EXPECT_THAT(tree.children(4), IsEmpty());
    EXPECT_THAT(tree.placements(4), ElementsAre(0, 5));
    EXPECT_THAT(tree.placements(0), IsEmpty());
    EXPECT_EQ(tree.placement_label(0), "left");
    EXPECT_EQ(tree.placement_label(1), "Part 2");
    EXPECT_EQ(tree.placement_label(5), "Rim");
}

TEST(model_tree, counts_are_of_the_whole_subtree)
{
    const Car car;
    const ModelTree tree(car.image);
    EXPECT_EQ(tree.nodes()[0].placements, 6u);
    EXPECT_EQ(tree.nodes()[0].faces, 3u * 3 + 2 * 5 + 1);
    EXPECT_EQ(tree.nodes()[1].placements, 3u);
    EXPECT_EQ(tree.nodes()[1].faces, 2u * 3 + 5);
    EXPECT_EQ(tree.nodes()[3].faces, 3u);
    EXPECT_THAT(tree.placements_below(1), ElementsAre(0, 3, 5));
    EXPECT_THAT(tree.placements_below(0), ElementsAre(0, 1, 2, 3, 4, 5));
}

TEST(model_tree, finds_the_node_of_a_placement_and_the_way_to_it)
{
    const Car car;
    const ModelTree tree(car.image);
    EXPECT_EQ(tree.node_of(3), 5u);
    EXPECT_THAT(tree.path_to(5), ElementsAre(0, 1, 5));
    EXPECT_THAT(tree.path_to(0), ElementsAre(0));
    EXPECT_EQ(tree.nodes()[5].depth, 2u);
}

TEST(model_tree, names_and_colours_of_faces_and_placements)
{
    Car car;
    car.image.faces[3].name = car.image.strings.add("Lid");
    car.image.faces[4].surface_kind = kKindTorus;
    car.image.faces[4].flags = kFaceHasColor;
    car.image.faces[4].color_rgba = 0xff112233u;
    car.image.faces[8].flags = kFaceHasColor; // the bolt's only one
    car.image.faces[8].color_rgba = 0xff445566u;
    car.image.instances[1].color_rgba = 0xff778899u;
    const ModelTree tree(car.image);
    EXPECT_EQ(tree.face_label(3), "Lid");
    EXPECT_EQ(tree.face_color(3), std::nullopt);
    EXPECT_EQ(tree.face_label(4), "Face 4 (torus)");
    EXPECT_EQ(tree.face_color(4), 0xff112233u);
    for (uint i = 0; i < car.image.instances.size(); ++i) {
        const uint part = car.image.instances[i].part;
        EXPECT_EQ(tree.placement_color(i), part == 2 ? std::optional(0xff445566u) // one has a colour, and all have it
                                           : i == 1  ? std::optional(0xff778899u) // of five faces one has a colour
                                                     : std::nullopt);
    }
}

TEST(model_tree, search_finds_nodes_placements_and_parts_in_either_case)
{
    const Car car;
    const ModelTree tree(car.image);
    EXPECT_THAT(tree.search("WHEEL"), ElementsAre(1, 4));
    EXPECT_THAT(tree.search("rim"), ElementsAre(3, 4)); // the part, where it is placed
    EXPECT_THAT(tree.search("SCR"), ElementsAre(2));    // a placement's name
    EXPECT_THAT(tree.search("part 2"), ElementsAre(2, 5));
    EXPECT_THAT(tree.search("кУЗ"), ElementsAre(3));
    EXPECT_THAT(tree.search("bölt"), ElementsAre(2));
    EXPECT_THAT(tree.search("no such"), IsEmpty());
    EXPECT_THAT(tree.search(""), IsEmpty());
}

TEST(model_tree, small_letters_of_three_alphabets)
{
    EXPECT_EQ(small_letters("AZ[az]09"), "az[az]09");
    EXPECT_EQ(small_letters("ÀÖ×ØÞßÿ"), "àö×øþßÿ");
    EXPECT_EQ(small_letters("ĀČŁŠŸŽİı"), "āčłšÿžİı");
    EXPECT_EQ(small_letters("ΆΈΊΌΎΏΑΩΫ"), "άέίόύώαωϋ");
    EXPECT_EQ(small_letters("ЀЁЏАЯя"), "ѐёџаяя");
    EXPECT_EQ(small_letters("日本€"), "日本€");
    EXPECT_EQ(small_letters("\xd0"), "\xd0"); // cut off: stays
}

TEST(model_tree, an_unnamed_root_has_the_files_name)
{
    PackImage image;
    add_node(image, 0, "");
    add_node(image, 0, "");
    place(image, add_part(image, "", 1), 1);
    EXPECT_EQ(ModelTree(image).nodes()[0].label, "Model");
    image.provenance.source_name = "car.step";
    EXPECT_EQ(ModelTree(image).nodes()[0].label, "car.step");
}

TEST(model_tree, a_pack_without_a_tree_has_a_root_of_all_placements)
{
    PackImage image;
    const uint part = add_part(image, "bolt", 2);
    place(image, part, 0);
    place(image, part, 0);
    const ModelTree tree(image);
    ASSERT_EQ(tree.nodes().size(), 1u);
    EXPECT_THAT(tree.placements(0), ElementsAre(0, 1));
    EXPECT_EQ(tree.nodes()[0].faces, 4u);
}

TEST(model_tree, twenty_thousand_placements_at_the_end_of_a_deep_chain_are_counted)
{
    constexpr uint kChain = 100000, kPlacements = 20000;
    PackImage image;
    const uint part = add_part(image, "rivet", 7);
    for (uint i = 0; i < kChain; ++i)
        add_node(image, i > 0 ? i - 1 : 0, "");
    for (uint i = 0; i < kPlacements; ++i)
        place(image, part, add_node(image, kChain - 1, fmt::format("Rivet {}", i)));
    const ModelTree tree(image);
    EXPECT_EQ(tree.nodes()[0].placements, kPlacements);
    EXPECT_EQ(tree.nodes()[0].faces, 7u * kPlacements);
    EXPECT_EQ(tree.children(kChain - 1).size(), kPlacements);
    EXPECT_EQ(tree.path_to(kChain).size(), kChain + 1);
    EXPECT_EQ(tree.search("RIVET 1234").size(), 11u); // 1234, 12340 ... 12349
    EXPECT_EQ(tree.search("rivet").size(), kPlacements);
    EXPECT_EQ(tree.placements_below(0).size(), kPlacements);
}

TEST(model_tree, the_golden_pack_has_the_tree_that_its_placements_refer_to)
{
    const Result<LoadedPack> pack = read_pack(TRIMRAY_TESTS_DIR "/golden/synthetic.tray", {});
    ASSERT_TRUE(pack.ok());
    const ModelTree tree(pack->image);
    ASSERT_EQ(tree.nodes().size(), 2u);
    EXPECT_EQ(tree.nodes()[0].label, "assembly");
    EXPECT_EQ(tree.nodes()[0].placements, 3u);
    EXPECT_THAT(tree.placements(1), ElementsAre(1));
    EXPECT_EQ(tree.nodes()[1].faces, 3u);
    EXPECT_EQ(tree.nodes()[0].faces, 7u);
    EXPECT_THAT(tree.search("ПЛИТА"), ElementsAre(0, 1));
}

} // namespace
} // namespace trimray
