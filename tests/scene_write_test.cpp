// Scene files written: what is read back is what was written. Documents of random keys and values come from the schema
// that editors use, so that a key which the schema gains fails here until it is written.
#include "runtime/scene_write.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <initializer_list>
#include <map>
#include <random>
#include <set>
#include <string>

namespace trimray {
namespace {

using Json = nlohmann::json;
using Random = std::mt19937;

SceneRequest read(const std::string& text, const std::string& file = "scene.json")
{
    const Result<SceneNode> tree = parse_scene_json(text, file);
    SceneRequest request;
    if (!tree.ok()) {
        ADD_FAILURE() << tree.error().where << ": " << tree.error().detail << "\n" << text;
        return request;
    }
    const Status done = read_scene(*tree, file, request);
    EXPECT_TRUE(done.ok()) << done.error().where << ": " << done.error().detail << "\n" << text;
    return request;
}

Json schema()
{
    std::ifstream file(std::filesystem::path(TRIMRAY_TESTS_DIR).parent_path() / "examples/scene.schema.json");
    return Json::parse(file);
}

// What a key has where a file does not say it. Keys without such a value (a request knows whether they were said) are
// not here; nor is a light's strength, which becomes part of its colour.
const std::map<std::string, Json> kWithout{
    {"background", "transparent"},      {"cameras", Json::array()},
    {"lights", Json::array()},          {"lights[].color", "#ffffff"},
    {"lights[].half_angle_deg", 0},     {"lights[].radius_mm", 0},
    {"lights[].shadows", false},        {"materials", Json::array()},
    {"placements.only", Json::array()}, {"placements.hide", Json::array()},
    {"placements.explode", 0},          {"effects.style", "shaded"},
    {"effects.edges.width_px", 1.5},    {"effects.edges.color", "auto"},
    {"effects.antialias.trims", false}, {"effects.shadows.samples", 16},
    {"effects.occlusion.samples", 0},   {"effects.section.planes", Json::array()},
    {"effects.section.caps", "filled"}, {"effects.section.cap_color", "auto"},
    {"effects.mirror_depth", 1},        {"effects.map.kind", "none"},
    {"effects.map.stripes", 16},        {"effects.map.draft_deg", 3},
};

/// A number of at most 6 digits in what the schema allows: it is the same in single precision.
double some_number(const Json& of, Random& random)
{
    const double lo = std::max(of.value("minimum", of.value("exclusiveMinimum", -1e6)), -1e6);
    const double hi = std::min(of.value("maximum", of.value("exclusiveMaximum", 1e6)), 1e6);
    const double share = std::uniform_real_distribution(0.001, 0.999)(random);
    return std::stod(fmt::format("{:.6g}", lo + share * (hi - lo)));
}

/// A value that a schema allows; `every`: with all keys.
Json some_value(const Json& root, const Json& of, Random& random, bool every)
{
    const auto below = [&](size_t count) { return random() % count; };
    if (of.contains("$ref")) // "#/$defs/NAME"
        return some_value(root, root["$defs"][of["$ref"].get<std::string>().substr(8)], random, every);
    if (of.contains("const"))
        return of["const"];
    if (of.contains("enum"))
        return of["enum"][below(of["enum"].size())];
    if (of.contains("anyOf"))
        return some_value(root, of["anyOf"][below(of["anyOf"].size())], random, every);
    const std::string type = of["type"];
    if (type == "boolean")
        return below(2) == 0;
    if (type == "integer") {
        const auto least = of["minimum"].get<uint64_t>(), most = of["maximum"].get<uint64_t>();
        return least + random() % (most - least + 1);
    }
    if (type == "number")
        return some_number(of, random);
    if (type == "string")
        return of.contains("pattern") ? fmt::format("#{:06x}", below(1 << 24))
                                      : fmt::format("b\"ä/\\\n\u2028 {}", below(1000));
    if (type == "array") {
        const size_t least = of.value("minItems", size_t{every}), most = of.value("maxItems", least + 3);
        Json list = Json::array();
        for (size_t count = least + below(std::min<size_t>(most - least, 3) + 1); list.size() < count;)
            list.push_back(some_value(root, of["items"], random, every));
        return list;
    }
    Json object = Json::object();
    const Json required = of.value("required", Json::array());
    for (const auto& [key, value] : of["properties"].items())
        if (every || std::find(required.begin(), required.end(), key) != required.end() || below(2) == 0)
            object[key] = some_value(root, value, random, every);
    return object;
}

void erase(Json& object, std::initializer_list<const char*> keys)
{
    for (const char* key : keys)
        object.erase(key);
}

void make_camera_consistent(Json& camera, Random& random)
{
    if (camera.contains("eye") && random() % 2 == 0)
        erase(camera, {"view"});
    else
        erase(camera, {"eye", "target", "up"});
    if (random() % 2 == 0)
        erase(camera, {"height_mm", "parallel"});
    else
        erase(camera, {"fov_deg"});
    if (camera.contains("eye") && !camera.contains("height_mm"))
        erase(camera, {"parallel"});
}

void make_light_consistent(Json& light, Random& random)
{
    const std::array<const char*, 3> kinds{"direction", "position", "at_eye"};
    const size_t kind = random() % 3;
    erase(light, {"strength", kinds[(kind + 1) % 3], kinds[(kind + 2) % 3]});
    if (kind == 2) {
        light["at_eye"] = true;
        erase(light, {"shadows"});
    } else if (!light.contains(kinds[kind])) {
        light[kinds[kind]] = {1, 2, -3.5};
    }
    if (kind != 0)
        erase(light, {"half_angle_deg"});
    if (kind != 1)
        erase(light, {"radius_mm"});
}

/// Takes away what excludes each other in a way that the schema does not say.
void make_consistent(Json& scene, Random& random)
{
    scene.erase("$schema");
    const auto for_each = [&](const char* list, const std::function<void(Json&)>& change) {
        if (scene.contains(list))
            std::for_each(scene[list].begin(), scene[list].end(), change);
    };
    for_each("cameras", [&](Json& camera) { make_camera_consistent(camera, random); });
    for_each("lights", [&](Json& light) { make_light_consistent(light, random); });
    for_each("materials", [&](Json& rule) {
        if (!rule.contains("color") && !rule.contains("opacity") && !rule.contains("mirror"))
            rule["specular"] = 0.5;
    });
    if (scene.contains("effects") && scene["effects"].contains("map") && scene["effects"]["map"].contains("range")) {
        Json& range = scene["effects"]["map"]["range"];
        if (range[1] < range[0])
            std::swap(range[0], range[1]);
    }
}

/// The document without what holds anyway, and without objects that are empty for that.
Json said(const Json& value, const std::string& path)
{
    if (value.is_array()) {
        Json list = Json::array();
        for (const Json& item : value)
            list.push_back(said(item, path + "[]"));
        return list;
    }
    if (!value.is_object())
        return value;
    Json object = Json::object();
    for (const auto& [key, member] : value.items()) {
        const std::string at = path.empty() ? key : path + "." + key;
        const auto without = kWithout.find(at);
        const Json rest = said(member, at);
        if ((without == kWithout.end() || without->second != member) && !(rest.is_object() && rest.empty()))
            object[key] = rest;
    }
    return object;
}

void find_keys(const Json& value, const std::string& path, std::set<std::string>& keys)
{
    if (value.is_array())
        for (const Json& item : value)
            find_keys(item, path + "[]", keys);
    if (value.is_object())
        for (const auto& [key, member] : value.items()) {
            const std::string at = path.empty() ? key : path + "." + key;
            keys.insert(at);
            find_keys(member, at, keys);
        }
}

void find_schema_keys(const Json& root, const Json& of, const std::string& path, std::set<std::string>& keys)
{
    if (of.contains("$ref"))
        return find_schema_keys(root, root["$defs"][of["$ref"].get<std::string>().substr(8)], path, keys);
    if (of.contains("items"))
        return find_schema_keys(root, of["items"], path + "[]", keys);
    if (of.contains("properties"))
        for (const auto& [key, member] : of["properties"].items()) {
            const std::string at = path.empty() ? key : path + "." + key;
            keys.insert(at);
            find_schema_keys(root, member, at, keys);
        }
}

TEST(scene_write, what_asks_for_nothing_is_an_empty_object)
{
    EXPECT_EQ(scene_text(SceneRequest{}), "{}\n");
    EXPECT_EQ(scene_text(read("{\"effects\": {\"edges\": {\"width_px\": 1.5}, \"map\": {\"stripes\": 16}}}")), "{}\n");
}

TEST(scene_write, every_key_of_the_schema_comes_back)
{
    const Json root = schema();
    Random random(1);
    std::set<std::string> written, there;
    for (int i = 0; i < 60; ++i) {
        Json scene = some_value(root, root, random, true);
        make_consistent(scene, random);
        const Json back = Json::parse(scene_text(read(scene.dump())));
        ASSERT_EQ(back, said(scene, "")) << scene.dump(2);
        find_keys(back, "", written);
    }
    find_schema_keys(root, root, "", there);
    there.erase("$schema");
    there.erase("lights[].strength"); // in the colour
    EXPECT_EQ(written, there);
}

TEST(scene_write, random_scenes_come_back)
{
    const Json root = schema();
    Random random(2);
    for (int i = 0; i < 1000; ++i) {
        Json scene = some_value(root, root, random, false);
        make_consistent(scene, random);
        const SceneRequest request = read(scene.dump());
        const std::string text = scene_text(request);
        ASSERT_EQ(Json::parse(text), said(scene, "")) << scene.dump(2);
        ASSERT_EQ(scene_text(read(text)), text);
    }
}

TEST(scene_write, numbers_come_back_to_the_bit)
{
    Random random(3);
    std::uniform_real_distribution<double> wide(-1e12, 1e12), narrow(-1, 1);
    std::uniform_real_distribution<float> share(0, 1);
    SceneRequest request;
    request.cameras.emplace_back();
    request.look.lights.emplace_back();
    for (int i = 0; i < 2000; ++i) {
        SceneCamera& camera = request.cameras[0];
        camera.eye = {wide(random), std::ldexp(narrow(random), -60), i == 0 ? -0.0 : narrow(random)};
        camera.target = {narrow(random), 1e12, 123456789012.0};
        request.edge_width_px = std::ldexp(share(random), int(random() % 5)) + 1e-6f;
        request.look.xray = share(random);
        // up to the brightest light that a power of two can say
        for (float& channel : request.look.lights[0].color)
            channel = std::ldexp(share(random), int(random() % 40) - 2);
        const SceneRequest back = read(scene_text(request));
        ASSERT_EQ(back.cameras.size(), 1u);
        for (size_t c = 0; c < 3; ++c) {
            ASSERT_EQ(std::bit_cast<uint64_t>((*back.cameras[0].eye)[c]), std::bit_cast<uint64_t>((*camera.eye)[c]));
            ASSERT_EQ((*back.cameras[0].target)[c], (*camera.target)[c]);
            ASSERT_EQ(back.look.lights[0].color[c], request.look.lights[0].color[c]);
        }
        ASSERT_EQ(back.edge_width_px, request.edge_width_px);
        ASSERT_EQ(back.look.xray, request.look.xray);
    }
}

TEST(scene_write, colours_are_written_as_people_know_them_where_that_is_exact)
{
    for (const char* color : {"\"#000000\"", "\"#ffffff\"", "\"#ff8000\"", "\"#012345\""})
        EXPECT_EQ(scene_text(read(fmt::format("{{\"background\": {}}}", color))),
                  fmt::format("{{\"background\": {}}}\n", color));
    EXPECT_EQ(scene_text(read("{\"background\": [0.2, 0.5, 2]}")), "{\"background\": [0.2, 0.5, 2]}\n");
}

TEST(scene_write, short_lists_stay_on_one_line)
{
    const std::string text = "{\n"
                             "  \"cameras\": [{\"name\": \"close\", \"eye\": [100, -200, 80.5], \"fov_deg\": 30}],\n"
                             "  \"materials\": [{\"part\": \"Cover\", \"opacity\": 0.3}, {\"faces\": [1, 2], "
                             "\"color\": \"#3070c0\"}]\n"
                             "}\n";
    EXPECT_EQ(scene_text(read(text)), text);
}

TEST(scene_write, an_environment_is_found_from_where_the_file_lies)
{
    namespace fs = std::filesystem;
    const SceneRequest request = read("{\"environment\": \"lights/studio.hdr\"}", "");
    for (const char* file : {"scene.json", "out/scene.json", "../scene.json", "/tmp/a/scene.json"}) {
        const SceneRequest back = read(scene_text(request, file), file);
        EXPECT_EQ(fs::absolute(*back.environment).lexically_normal(), fs::absolute("lights/studio.hdr")) << file;
    }
    const SceneRequest far = read("{\"environment\": \"/somewhere/studio.hdr\"}", "");
    EXPECT_EQ(read(scene_text(far, "out/scene.json"), "out/scene.json").environment, far.environment);
}

TEST(scene_write, rules_that_give_nothing_and_names_that_are_no_utf8_do_not_spoil_the_file)
{
    SceneRequest request;
    request.look.materials.resize(2);
    request.look.materials[1].part = "a\xff";
    request.look.materials[1].material.opacity = 0.5f;
    const SceneRequest back = read(scene_text(request));
    ASSERT_EQ(back.look.materials.size(), 1u);
    EXPECT_EQ(back.look.materials[0].part, "a\xef\xbf\xbd");
}

} // namespace
} // namespace trimray
