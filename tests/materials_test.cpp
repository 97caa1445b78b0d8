// Materials resolved from rules, as a table of cases.
#include "runtime/materials.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trimray {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// Part 0 "Plate": face 0 red, face 1 without a colour. Part 1 "Bolt": face 2 without a colour.
/// Placements: 0 "Base" of part 0, blue; 1 "Bolt 1" of part 1, blue; 2 "Bolt 2" of part 1, no colour.
PackImage three_placements()
{
    PackImage image;
    image.parts.resize(2);
    image.parts[0].name = image.strings.add("Plate");
    image.parts[1].name = image.strings.add("Bolt");
    image.faces.resize(3);
    image.faces[0].flags = kFaceHasColor;
    image.faces[0].color_rgba = 0xff0000ff; // red is the low byte
    image.faces[2].part = 1;
    image.instances.resize(3);
    image.instances[1].part = image.instances[2].part = 1;
    image.instances[0].color_rgba = image.instances[1].color_rgba = 0xffff0000;
    const char* names[] = {"Base", "Bolt 1", "Bolt 2"};
    for (size_t i = 0; i < 3; ++i)
        image.instances[i].name = image.strings.add(names[i]);
    return image;
}

/// Opacities of face 0 and 1 of the plate, face 2 of bolt 1 and of bolt 2.
std::array<float, 4> opacities(const SceneLook& look)
{
    const Result<MaterialTable> table = resolve_materials(three_placements(), look);
    EXPECT_TRUE(table.ok());
    return {table->of(0, 0).opacity, table->of(1, 0).opacity, table->of(2, 1).opacity, table->of(2, 2).opacity};
}

MaterialRule makes(float opacity)
{
    MaterialRule rule;
    rule.material.opacity = opacity;
    return rule;
}

SceneLook look_of(std::vector<MaterialRule> rules)
{
    SceneLook look;
    look.materials = std::move(rules);
    return look;
}

TEST(materials, without_rules_are_one_plain_material)
{
    const Result<MaterialTable> table = resolve_materials(three_placements(), {});
    ASSERT_TRUE(table.ok());
    ASSERT_EQ(table->materials.size(), 1u);
    EXPECT_EQ(table->face_classes, 1u);
    EXPECT_EQ(table->of_classes.size(), 1u);
    EXPECT_FALSE(table->transparent || table->mirrors);
    EXPECT_EQ(table->materials[0].has_color, 0);
    EXPECT_EQ(table->materials[0].opacity, 1);
    EXPECT_EQ(table->materials[0].mirror, 0);
    EXPECT_FLOAT_EQ(table->materials[0].specular, 0.12f) << "kSpecular of shaders/shared/shading.h";
    EXPECT_TRUE(resolve_materials({}, {}).ok()) << "an empty pack";
}

TEST(materials, rules_hold_where_all_their_conditions_do)
{
    MaterialRule plate = makes(0.5f), bolts = plate, bolt_2 = plate, numbered = plate, faces = plate, red = plate,
                 blue = plate, grey = plate, both = plate;
    plate.part = "Plate";
    bolts.part = "Bolt";
    bolt_2.part = "Bolt 2";
    numbered.part = "#1";
    faces.faces = {1, 2, 99};
    red.pack_color = 0xff0000;
    blue.pack_color = 0x0000ff;
    grey.pack_color = 0xacb0b4; // the default, of what has none
    both.part = "Bolt 1";
    both.pack_color = 0x0000ff;
    both.faces = {2};
    EXPECT_THAT(opacities(look_of({plate})), ElementsAre(0.5f, 0.5f, 1, 1));
    EXPECT_THAT(opacities(look_of({bolts})), ElementsAre(1, 1, 0.5f, 0.5f));
    EXPECT_THAT(opacities(look_of({bolt_2})), ElementsAre(1, 1, 1, 0.5f));
    EXPECT_THAT(opacities(look_of({numbered})), ElementsAre(1, 1, 0.5f, 0.5f));
    EXPECT_THAT(opacities(look_of({faces})), ElementsAre(1, 0.5f, 0.5f, 0.5f));
    EXPECT_THAT(opacities(look_of({red})), ElementsAre(0.5f, 1, 1, 1));
    EXPECT_THAT(opacities(look_of({blue})), ElementsAre(1, 0.5f, 0.5f, 1));
    EXPECT_THAT(opacities(look_of({grey})), ElementsAre(1, 1, 1, 0.5f));
    EXPECT_THAT(opacities(look_of({both})), ElementsAre(1, 1, 0.5f, 1));
    EXPECT_THAT(opacities(look_of({makes(0.25f)})), ElementsAre(0.25f, 0.25f, 0.25f, 0.25f));
}

TEST(materials, later_rules_win_field_by_field_and_xray_is_what_is_left)
{
    MaterialRule all = makes(0.5f), face = makes(0.25f), bolt;
    all.material.mirror = 0.75f;
    face.faces = {2};
    bolt.part = "Bolt 2";
    bolt.material.color = {0, 1, 0};
    SceneLook look = look_of({all, face, bolt});
    EXPECT_THAT(opacities(look), ElementsAre(0.5f, 0.5f, 0.25f, 0.25f));
    const Result<MaterialTable> table = resolve_materials(three_placements(), look);
    EXPECT_EQ(table->of(2, 2).has_color, 1) << "of the placement, beside the face's opacity";
    EXPECT_EQ(table->of(2, 2).color[1], 1);
    EXPECT_EQ(table->of(2, 2).mirror, 0.75f);
    EXPECT_EQ(table->of(2, 1).has_color, 0);
    EXPECT_EQ(table->materials.size(), 3u);
    look.materials = {face};
    look.xray = 0.125f;
    EXPECT_THAT(opacities(look), ElementsAre(0.125f, 0.125f, 0.25f, 0.25f));
}

TEST(materials, say_whether_anything_is_transparent_or_mirrors)
{
    const auto flags = [](const SceneLook& look) {
        const Result<MaterialTable> table = resolve_materials(three_placements(), look);
        return std::pair{table->transparent, table->mirrors};
    };
    MaterialRule mirror;
    mirror.material.mirror = 0.5f;
    EXPECT_EQ(flags(look_of({makes(1)})), (std::pair{false, false}));
    EXPECT_EQ(flags(look_of({makes(0.5f)})), (std::pair{true, false}));
    EXPECT_EQ(flags(look_of({mirror})), (std::pair{false, true}));
    EXPECT_EQ(flags(look_of({makes(0.5f), makes(1)})), (std::pair{false, false})) << "the later rule takes it back";
    MaterialRule nothing = makes(0.5f);
    nothing.part = "Bolt";
    nothing.faces = {0};
    EXPECT_EQ(flags(look_of({nothing})), (std::pair{false, false})) << "face 0 is not of the bolt";
}

TEST(materials, name_the_rules_that_match_nothing)
{
    MaterialRule known = makes(0.5f), unknown = known, elsewhere = known, color = known;
    known.part = "Bolt 1";
    unknown.part = "Nut";
    elsewhere.part = "Bolt 1";
    elsewhere.faces = {0};
    color.part = "Bolt 2";
    color.pack_color = 0x0000ff;
    EXPECT_THAT(resolve_materials(three_placements(), look_of({unknown, known, elsewhere, color}))->unmatched,
                ElementsAre(0, 2, 3));
    EXPECT_THAT(resolve_materials(three_placements(), look_of({known}))->unmatched, IsEmpty());
}

TEST(materials, rules_that_tell_too_much_apart_are_refused)
{
    PackImage image;
    image.parts.resize(1);
    image.faces.resize(600);
    image.instances.resize(600);
    SceneLook look;
    for (uint32_t bit = 0; bit < 10; ++bit) { // faces and placements by their numbers' bits: all differ
        MaterialRule of_faces = makes(0.5f), of_placements = makes(0.5f);
        for (uint32_t i = 0; i < 600; ++i)
            if ((i >> bit & 1) != 0)
                of_faces.faces.push_back(i);
        of_placements.pack_color = bit;
        look.materials.push_back(of_faces);
        look.materials.push_back(of_placements);
    }
    ASSERT_TRUE(resolve_materials(image, look).ok());
    for (uint32_t i = 0; i < 600; ++i)
        image.instances[i].name = image.strings.add(std::to_string(i));
    for (uint32_t i = 0; i < 500; ++i) {
        MaterialRule rule = makes(0.5f);
        rule.part = std::to_string(i);
        look.materials.push_back(rule);
    }
    const Result<MaterialTable> table = resolve_materials(image, look);
    ASSERT_FALSE(table.ok());
    EXPECT_EQ(table.error().code, ErrorCode::InvalidScene);
}

} // namespace
} // namespace trimray
