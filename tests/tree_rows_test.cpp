// The lines of the tree panel, and what a click, a box and a search do to sets of placements.
#include "runtime/view/selection.h"
#include "runtime/view/tree_rows.h"

#include "tests/model_trees.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trimray {
namespace {

using testing::ElementsAre;

/// Each line as "depth label", with + where it can be opened and - where it is open.
std::vector<std::string> lines(TreeRows& rows)
{
    std::vector<std::string> out;
    for (const TreeRow& row : rows.rows())
        out.push_back(fmt::format("{}{} {}", row.depth, row.is_open ? "-" : row.can_open ? "+" : "", rows.label(row)));
    return out;
}

const TreeRow& row_of(TreeRows& rows, const std::string& label)
{
    for (const TreeRow& row : rows.rows())
        if (rows.label(row) == label)
            return row;
    ADD_FAILURE() << "no line " << label;
    return rows.rows().front();
}

TEST(tree_rows, open_lines_list_what_is_in_them)
{
    const Car car;
    const ModelTree tree(car.image);
    TreeRows rows(tree, car.image);
    EXPECT_THAT(lines(rows), ElementsAre("0- car", "1+ Wheels", "1+ Assembly 2", "1+ Кузов"));
    rows.set_open(TreeRow(row_of(rows, "Assembly 2")), true);
    // two placements are a line each; a part that is placed once is its node's line
    EXPECT_THAT(lines(rows), ElementsAre("0- car", "1+ Wheels", "1- Assembly 2", "2+ Part 2", "2+ screw", "1+ Кузов"));
    rows.set_open(TreeRow(row_of(rows, "screw")), true);
    EXPECT_THAT(lines(rows), ElementsAre("0- car", "1+ Wheels", "1- Assembly 2", "2+ Part 2", "2- screw",
                                         "3 Face 8 (plane)", "1+ Кузов"));
    rows.set_open(TreeRow(row_of(rows, "car")), false);
    EXPECT_THAT(lines(rows), ElementsAre("0+ car"));
}

TEST(tree_rows, what_is_picked_is_opened_to)
{
    const Car car;
    const ModelTree tree(car.image);
    TreeRows rows(tree, car.image);
    const size_t at = rows.reveal(3, {});
    EXPECT_EQ(rows.label(rows.rows()[at]), "Part 2");
    EXPECT_EQ(rows.rows()[at].placement, 3u);
    EXPECT_EQ(rows.rows()[at].depth, 2u);
    const size_t face = rows.reveal(2, 8);
    EXPECT_EQ(rows.rows()[face].kind, TreeRow::Kind::Face);
    EXPECT_EQ(rows.rows()[face].face, 8u);
    EXPECT_EQ(rows.rows()[face].placement, 2u);
}

TEST(tree_rows, a_search_lists_what_it_finds_and_where_that_is)
{
    const Car car;
    const ModelTree tree(car.image);
    TreeRows rows(tree, car.image);
    rows.search("part 2");
    EXPECT_THAT(lines(rows), ElementsAre("0- car", "1- Wheels", "2+ Part 2", "1- Assembly 2", "2+ Part 2", "2+ screw"));
    EXPECT_EQ(rows.found(), 2u);
    EXPECT_THAT(rows.found_placements(), ElementsAre(1, 2, 3));
    rows.search("r"); // also the model's own name
    EXPECT_EQ(rows.found(), 5u);
    EXPECT_THAT(rows.found_placements(), ElementsAre(0, 1, 2, 3, 4, 5));
    rows.search("car");
    EXPECT_THAT(rows.found_placements(), ElementsAre(0, 1, 2, 3, 4, 5));
    rows.search("nothing of the kind");
    EXPECT_THAT(lines(rows), ElementsAre());
    rows.search("part 2");
    rows.reveal(4, {}); // not among them
    EXPECT_EQ(rows.searched(), "");
    EXPECT_THAT(lines(rows), ElementsAre("0- car", "1+ Wheels", "1+ Assembly 2", "1+ Кузов"));
}

TEST(tree_rows, a_hundred_thousand_nested_assemblies_are_no_danger)
{
    PackImage image;
    add_node(image, 0, "top");
    for (uint n = 0; n < 100000; ++n)
        add_node(image, n, "");
    place(image, add_part(image, "deep", 1), 100000);
    const ModelTree tree(image);
    TreeRows rows(tree, image);
    EXPECT_EQ(rows.rows().size(), 100001u); // each is alone in the one above
    EXPECT_EQ(rows.reveal(0, {}), 100000u);
    rows.search("deep");
    EXPECT_EQ(rows.rows().size(), 100001u);
}

TEST(selection, clicks_with_ctrl_add_and_take_away)
{
    EXPECT_THAT(toggled({1, 3, 5}, std::vector<uint32_t>{3, 4}), ElementsAre(1, 4, 5));
    EXPECT_THAT(toggled({}, std::vector<uint32_t>{2}), ElementsAre(2));
}

TEST(selection, boxes_say_what_is_shown_by_the_shorter_list)
{
    Arrangement arranged;
    arranged.explode = 0.5;
    const auto after = [&arranged](std::vector<uint8_t> before, std::vector<uint32_t> which, bool shown) {
        set_shown(arranged, before, 5, which, shown);
    };
    after({}, {1}, false);
    EXPECT_THAT(arranged.hide, ElementsAre("@1"));
    EXPECT_THAT(arranged.only, ElementsAre());
    after({1, 0, 1, 1, 1}, {0, 2, 3}, false);
    EXPECT_THAT(arranged.only, ElementsAre("@4"));
    EXPECT_THAT(arranged.hide, ElementsAre());
    after({0, 0, 0, 0, 1}, {4}, false); // nothing is left: a list of those shown would mean all
    EXPECT_THAT(arranged.only, ElementsAre());
    EXPECT_THAT(arranged.hide, ElementsAre("@0", "@1", "@2", "@3", "@4"));
    after({0, 0, 0, 0, 0}, {0, 1, 2, 3, 4}, true);
    EXPECT_THAT(arranged.only, ElementsAre());
    EXPECT_THAT(arranged.hide, ElementsAre());
    EXPECT_EQ(arranged.explode, 0.5);
    show_alone(arranged, 5, std::vector<uint32_t>{2});
    EXPECT_THAT(arranged.only, ElementsAre("@2"));
}

} // namespace
} // namespace trimray
