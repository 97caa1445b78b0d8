// Scene files: what each key does, and that every fault is told with its line and key.
#include "runtime/scene_request.h"
#include "shaders/light_layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <regex>
#include <sstream>

namespace trimray {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

Result<SceneRequest> read(const std::string& text)
{
    const Result<SceneNode> tree = parse_scene_json(text, "scene.json");
    if (!tree.ok())
        return tree.error();
    SceneRequest request;
    if (const Status done = read_scene(*tree, "scene.json", request); !done.ok())
        return done.error();
    return request;
}

/// "where: detail" of the fault in a text.
std::string fault(const std::string& text)
{
    const Result<SceneRequest> request = read(text);
    if (request.ok())
        return "none";
    EXPECT_EQ(request.error().code, ErrorCode::InvalidScene) << text;
    return request.error().where + ": " + request.error().detail;
}

std::string contents(const std::filesystem::path& path)
{
    std::ifstream file(path, std::ios::binary);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

/// The example in SCENE.md.
std::string documented_example()
{
    const std::string words = contents(std::filesystem::path(TRIMRAY_TESTS_DIR).parent_path() / "runtime/SCENE.md");
    const size_t begin = words.find("```json\n"), end = words.find("```", begin + 8);
    EXPECT_NE(begin, words.npos);
    return words.substr(begin + 8, end - begin - 8);
}

TEST(scene_file, an_empty_object_asks_for_nothing)
{
    const Result<SceneRequest> request = read("{}");
    ASSERT_TRUE(request.ok());
    EXPECT_TRUE(request->cameras.empty() && request->look.lights.empty() && !request->background && !request->samples);
}

TEST(scene_file, the_documented_example_says_what_its_words_say)
{
    const Result<SceneRequest> request = read(documented_example());
    ASSERT_TRUE(request.ok()) << request.error().where << ": " << request.error().detail;
    const SceneRequest& scene = *request;
    ASSERT_EQ(scene.cameras.size(), 3u);
    EXPECT_EQ(scene.cameras[0].name, "whole");
    EXPECT_EQ(scene.cameras[0].view, "iso");
    EXPECT_THAT(*scene.cameras[1].eye, ElementsAre(100, -200, 80));
    EXPECT_EQ(scene.cameras[1].fov_deg, 30);
    EXPECT_EQ(scene.cameras[2].height_mm, 120);
    EXPECT_EQ(scene.environment, "studio.hdr");
    ASSERT_EQ(scene.look.lights.size(), 2u);
    EXPECT_EQ(scene.look.lights[0].kind, LightKind::Directional);
    EXPECT_TRUE(scene.look.lights[0].shadows);
    EXPECT_EQ(scene.look.lights[0].half_angle_deg, 1.5);
    EXPECT_EQ(scene.look.lights[1].kind, LightKind::Point);
    EXPECT_THAT(scene.look.lights[1].position_mm, ElementsAre(0, -300, 200));
    EXPECT_FLOAT_EQ(scene.look.lights[1].color[0], 0.4f);
    ASSERT_EQ(scene.look.materials.size(), 3u);
    EXPECT_EQ(scene.look.materials[0].part, "Cover");
    EXPECT_FLOAT_EQ(scene.look.materials[0].material.opacity.value(), 0.3f);
    EXPECT_THAT(scene.look.materials[1].faces, ElementsAre(12, 13, 20));
    EXPECT_FLOAT_EQ(scene.look.materials[1].material.mirror.value(), 0.4f);
    EXPECT_EQ(scene.look.materials[2].pack_color, 0xff8000u);
    EXPECT_EQ(scene.edges, EdgeLines::Sharp);
    EXPECT_FLOAT_EQ(scene.edge_width_px, 2);
    EXPECT_TRUE(scene.silhouettes.value());
    EXPECT_EQ(scene.samples, 2u);
    EXPECT_TRUE(scene.antialias_trims);
    EXPECT_EQ(scene.shadows, ShadowKind::Soft);
    EXPECT_EQ(scene.look.light_samples, 32u);
    EXPECT_EQ(scene.look.occlusion.samples, 16u);
    EXPECT_EQ(scene.look.occlusion.reach_mm, 25);
    ASSERT_EQ(scene.look.section.planes.size(), 1u);
    EXPECT_THAT(scene.look.section.planes[0].normal, ElementsAre(0, 0, 1));
    EXPECT_EQ(scene.look.section.caps, CapStyle::Hatched);
    EXPECT_EQ(scene.look.mirror_depth, 2u);
    EXPECT_EQ(scene.look.map.map, SurfaceMap::Zebra);
    EXPECT_EQ(scene.look.map.stripes, 20u);
}

TEST(scene_file, faults_are_told_with_line_and_key)
{
    const struct {
        const char *text, *says;
    } cases[] = {
        {"{\n \"lights\": [\n  {\"direction\": [0, 0, -1]},\n  {\n   \"direction\": \"up\"}]}",
         "scene.json:5: lights[1].direction: expected a list of three numbers of at most 1000000000000 in size, found "
         "\"up\""},
        {"{\"efects\": {}}", "scene.json:1: efects: no such key; did you mean 'effects'?"},
        {"{\"effects\": {\n\"zzz\"\n:\n1}}", "scene.json:2: effects.zzz: no such key; there are style, edges"},
        {"{\"effects\": {\"xray\": 1.5}}", "scene.json:1: effects.xray: expected a number in [0, 1], found 1.5"},
        {"{\"effects\": {\"xray\":\n-0.1\n}}", "scene.json:2: effects.xray: expected a number in [0, 1], found -0.1"},
        {"{\"effects\": {\"xray\": NaN}}", "scene.json:1: "},
        {"{\"effects\": {\"xray\": 1e999}}", "scene.json:1: "},
        {"{\"effects\": {\"silhouettes\": 1}}", "expected true or false, found 1"},
        {"{\"effects\": {\"map\": {\"kind\": \"zerba\"}}}", "found \"zerba\"; did you mean 'zebra'?"},
        {"{\"effects\": {\"map\": {\"stripes\": 1.5}}}", "expected a whole number from 1 to 10000, found 1.5"},
        {"{\"effects\": {\"map\": {\"range\": [1, 1]}}}", "effects.map.range: the first number must be below"},
        {"{\"effects\": {\"occlusion\": {\"reach_mm\": 0}}}", "expected a number in (0, 1000000000000], found 0"},
        {"{\"effects\": {\"shadows\": \"soft\"}}", "effects.shadows: expected an object, found \"soft\""},
        {"{\"effects\": {\"section\": {\"planes\": [{\"point\": [0, 0, 0]}]}}}", "expected a point and a normal"},
        {"{\"effects\": {\"section\": {\"planes\": [{\"point\": [0, 0, 0], \"normal\": [0, 0, 0]}]}}}",
         "effects.section.planes[0].normal: has no length"},
        {"{\"lights\": [{}]}", "lights[0]: expected one of direction, position (of a point light) and at_eye"},
        {"{\"lights\": [{\"direction\": [0, 0, 1], \"position\": [0, 0, 1]}]}", "expected one of"},
        {"{\"lights\": [{\"at_eye\": true, \"shadows\": true}]}", "throws no shadows"},
        {"{\"lights\": [{\"direction\": [0, 0, 1], \"radius_mm\": 1}]}", "radius_mm is for point lights"},
        {"{\"lights\": [{\"direction\": [0, 0, 1], \"color\": \"red\"}]}", "expected white, black, #rrggbb or three"},
        {"{\"lights\": [{\"direction\": [0, 0, 1], \"color\": [1, -1, 0]}]}", "found a list of 3"},
        {"{\"materials\": [{\"part\": \"a\"}]}", "materials[0]: gives nothing"},
        {"{\"materials\": [{\"faces\": [], \"opacity\": 1}]}", "materials[0].faces: expected a list of one or more"},
        {"{\"materials\": [{\"faces\": [-1], \"opacity\": 1}]}", "materials[0].faces: expected a list of one or more"},
        {"{\"cameras\": [{\"view\": \"isometric\"}]}", "cameras[0].view: expected one of iso, front"},
        {"{\"cameras\": [{\"target\": [0, 0, 0]}]}", "cameras[0]: target and up need an eye"},
        {"{\"cameras\": [{\"eye\": [1, 0, 0], \"target\": [1, 0, 0]}]}", "cameras[0]: the eye is where the target is"},
        {"{\"cameras\": [{\"eye\": [1, 0, 0], \"view\": \"iso\"}]}", "exclude each other"},
        {"{\"cameras\": [{\"fov_deg\": 180}]}", "cameras[0].fov_deg: expected a number in (0, 180), found 180"},
        {"{\"cameras\": [{\"eye\": [1, 0, 0], \"parallel\": true}]}", "need height_mm"},
        {"{\"cameras\": {}}", "cameras: expected a list, found an object"},
        {"{\"background\": 3}", "background: expected transparent, white, black, #rrggbb or three numbers"},
        {"{\"a\": 1,\n\n\"a\": 2}", "scene.json:3: the key 'a' is there twice"},
        {"[]", "scene.json:1: expected an object, found a list of 0"},
        {"{\n\n", "scene.json:"},
        {"", "scene.json:1: "},
        {"{\"a\": \"\xff\"}", "scene.json:1: "},
        {"{} {}", "scene.json:1: "},
    };
    for (const auto& [text, says] : cases)
        EXPECT_THAT(fault(text), HasSubstr(says)) << text;
}

TEST(scene_file, numbers_before_a_line_end_keep_their_line)
{
    const Result<SceneNode> tree = parse_scene_json("{\n\"a\": 1\n,\"b\":\r\n [2,\n3\n], \"c\": true\n}", "x");
    ASSERT_TRUE(tree.ok());
    EXPECT_EQ(tree->find("a")->line, 2u);
    EXPECT_EQ(tree->find("b")->line, 4u);
    EXPECT_EQ(tree->find("b")->key_line, 3u);
    EXPECT_EQ(tree->find("b")->items[1].line, 5u);
    EXPECT_EQ(tree->find("c")->line, 6u);
}

TEST(scene_file, what_is_too_large_or_too_deep_is_refused)
{
    EXPECT_THAT(fault(std::string(100000, '[')), HasSubstr("more than 16 deep"));
    std::string many = "{\"materials\": [{\"opacity\": 1, \"faces\": [0";
    for (size_t i = 0; i <= kMostSceneValues; ++i)
        many += ",0";
    EXPECT_THAT(fault(many + "]}]}"), HasSubstr("more than 262144 values"));
    EXPECT_THAT(fault(std::string(kMostSceneBytes + 1, ' ')), HasSubstr("at most 8388608"));
    std::string lights = "{\"lights\": [";
    for (size_t i = 0; i <= kMostLights; ++i)
        lights += std::string(i > 0 ? "," : "") + "{\"direction\": [0, 0, 1]}";
    EXPECT_THAT(fault(lights + "]}"), HasSubstr("lights: 17 of them; at most 16"));
    std::string keys = "{";
    for (size_t i = 0; i <= kMostSceneKeys; ++i)
        keys += (i > 0 ? ",\"" : "\"") + std::to_string(i) + "\": 1";
    EXPECT_THAT(fault(keys + "}"), HasSubstr("more than 64 keys"));
}

TEST(scene_file, damaged_texts_end_in_an_error_with_a_line_or_in_a_scene)
{
    const std::string whole = documented_example();
    for (size_t size = 0; size < whole.size(); ++size) // every prefix but those that lack white space alone
        if (whole.find_first_not_of(" \n", size) != whole.npos) {
            EXPECT_THAT(fault(whole.substr(0, size)), HasSubstr("scene.json:")) << size;
        }
    std::mt19937 random(5);
    const std::string letters = "{}[]\",:0123456789.eE+-truefalsn \n\\u\x01\xc3";
    for (int round = 0; round < 3000; ++round) {
        std::string damaged = whole;
        for (uint32_t change = 0; change <= random() % 4; ++change) {
            const size_t at = random() % damaged.size();
            if (random() % 2 == 0)
                damaged[at] = letters[random() % letters.size()];
            else
                damaged.erase(at, random() % 9);
        }
        if (const Result<SceneRequest> request = read(damaged); !request.ok()) {
            EXPECT_THAT(request.error().where, testing::StartsWith("scene.json")) << damaged;
        }
    }
}

TEST(scene_file, files_that_are_not_there_or_no_files_are_told_apart)
{
    EXPECT_EQ(read_scene_file("/no/such/scene.json").error().code, ErrorCode::FileNotFound);
    EXPECT_EQ(read_scene_file("/").error().code, ErrorCode::FileNotReadable);
    EXPECT_EQ(read_scene_file("/dev/zero").error().code, ErrorCode::InvalidScene);
}

TEST(scene_file, names_in_it_are_relative_to_it)
{
    const std::filesystem::path folder = std::filesystem::temp_directory_path() / "scene_file_test";
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "s.json") << "{\"environment\": \"sky.hdr\"}";
    std::ofstream(folder / "cameras.json") << "[{\"view\": \"top\"}, {\"view\": \"front\", \"name\": \"f\"}]";
    EXPECT_EQ(read_scene_file((folder / "s.json").string())->environment, (folder / "sky.hdr").string());
    const Result<std::vector<SceneCamera>> cameras = read_cameras((folder / "cameras.json").string());
    ASSERT_TRUE(cameras.ok());
    EXPECT_EQ(cameras->size(), 2u);
    EXPECT_EQ((*cameras)[1].name, "f");
    EXPECT_THAT(read_cameras((folder / "s.json").string()).error().detail, HasSubstr("no cameras"));
    std::filesystem::remove_all(folder);
}

TEST(scene_options, win_over_the_file)
{
    SceneRequest request =
        *read("{\"lights\": [{\"direction\": [0, 0, 1]}, {\"direction\": [0, 1, 0]}], \"materials\": "
              "[{\"opacity\": 0.5}], \"effects\": {\"xray\": 0.5, \"occlusion\": {\"samples\": 4}}}");
    SceneNode options;
    SceneNode lights, materials;
    lights.kind = materials.kind = SceneNode::Kind::Array;
    lights.items.push_back(*pairs_node("--light", "position=1,2,3,color=0.5,0.5,1,strength=2,shadows=true"));
    materials.items.push_back(*pairs_node("--material", "part=a, b,faces=3+4,mirror=0.25"));
    set_node(options, "lights", lights);
    set_node(options, "materials", materials);
    set_node(options, "effects.occlusion.reach_mm", words_node("--occlusion", "7"));
    ASSERT_TRUE(read_scene(options, "", request).ok());
    ASSERT_EQ(request.look.lights.size(), 1u) << "the file's lights are replaced";
    EXPECT_THAT(request.look.lights[0].position_mm, ElementsAre(1, 2, 3));
    EXPECT_THAT(request.look.lights[0].color, ElementsAre(1, 1, 2));
    ASSERT_EQ(request.look.materials.size(), 2u) << "rules are added";
    EXPECT_EQ(request.look.materials[1].part, "a, b");
    EXPECT_THAT(request.look.materials[1].faces, ElementsAre(3, 4));
    EXPECT_THAT(request.rules, ElementsAre("scene.json:1: materials[0]", "--material"));
    EXPECT_EQ(request.look.occlusion.samples, 4u);
    EXPECT_EQ(request.look.occlusion.reach_mm, 7);
    EXPECT_EQ(request.look.xray, 0.5f);

    SceneNode wrong;
    set_node(wrong, "effects.xray", words_node("--xray", "nan"));
    const Status refused = read_scene(wrong, "", request);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::Usage);
    EXPECT_EQ(refused.error().where, "--xray");
    EXPECT_EQ(refused.error().detail, "expected a number in [0, 1], found 'nan'");
    EXPECT_EQ(pairs_node("--light", "up").error().detail, "expected key=value,..., found 'up'");
    EXPECT_THAT(pairs_node("--light", "color=white,color=black").error().detail, HasSubstr("twice"));
}

TEST(scene_options, shadows_without_lights_are_of_a_sun_and_soft_ones_have_a_size)
{
    SceneRequest request;
    RenderOptions options;
    request.shadows = ShadowKind::Soft;
    ASSERT_TRUE(apply_request(request, 100, options).ok());
    ASSERT_EQ(options.look.lights.size(), 1u);
    EXPECT_GT(options.look.lights[0].half_angle_deg, 0);
    EXPECT_TRUE(options.look.lights[0].shadows);
    request.look.lights = {{LightKind::Point, {}, {0, 0, 9}, {1, 1, 1}, 0, 0, false}};
    ASSERT_TRUE(apply_request(request, 100, options).ok());
    EXPECT_DOUBLE_EQ(options.look.lights[0].radius_mm, 2);
    request.look.lights[0].radius_mm = 3;
    ASSERT_TRUE(apply_request(request, 100, options).ok());
    EXPECT_EQ(options.look.lights[0].radius_mm, 3);
    request.shadows = ShadowKind::Hard;
    ASSERT_TRUE(apply_request(request, 100, options).ok());
    EXPECT_EQ(options.look.lights[0].radius_mm, 0);
    EXPECT_TRUE(options.look.lights[0].shadows);
    request.shadows = ShadowKind::None;
    ASSERT_TRUE(apply_request(request, 100, options).ok());
    EXPECT_FALSE(options.look.lights[0].shadows);
    request.shadows.reset();
    request.edges_only = true;
    ASSERT_TRUE(apply_request(request, 100, options).ok());
    EXPECT_TRUE(options.edges == EdgeLines::Sharp && options.silhouettes && !options.fill);
    request.edges = EdgeLines::None;
    request.silhouettes = false;
    EXPECT_EQ(apply_request(request, 100, options).error().where, "--style");
}

TEST(scene_options, a_camera_is_changed_by_what_is_given)
{
    SceneCamera base;
    base.eye = {1, 2, 3};
    base.fov_deg = 20;
    SceneCamera over;
    over.height_mm = 5;
    Result<SceneCamera> merged = merge_camera(base, over);
    ASSERT_TRUE(merged.ok());
    EXPECT_TRUE(merged->eye && merged->height_mm && !merged->fov_deg);
    over = {};
    over.view = "top";
    merged = merge_camera(base, over);
    ASSERT_TRUE(merged.ok());
    EXPECT_TRUE(!merged->eye && merged->view == "top" && merged->fov_deg == 20);
    over = {};
    over.target = {0, 0, 0};
    EXPECT_TRUE(merge_camera(base, over).ok());
    EXPECT_EQ(merge_camera({}, over).error().where, "--target");
    over = {};
    over.parallel = true;
    EXPECT_EQ(merge_camera(base, over).error().where, "--ortho");
    EXPECT_TRUE(merge_camera({}, over).ok());
}

} // namespace
} // namespace trimray
