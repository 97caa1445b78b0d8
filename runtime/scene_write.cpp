#include "runtime/scene_write.h"

#include "runtime/color_text.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

namespace trimray {
namespace {

using Kind = SceneNode::Kind;

// ---- values --------------------------------------------------------------------------------------------------------

SceneNode node_of(double number)
{
    SceneNode node;
    node.kind = Kind::Number;
    node.number = number;
    return node;
}
/// The number with the fewest digits that is read as this one.
SceneNode node_of(float number)
{
    const std::string digits = fmt::format("{}", number);
    double read = 0;
    std::from_chars(digits.data(), digits.data() + digits.size(), read);
    return node_of(float(read) == number ? read : double(number));
}
SceneNode node_of(uint32_t number)
{
    return node_of(double(number));
}
SceneNode node_of(bool yes)
{
    SceneNode node;
    node.kind = Kind::Boolean;
    node.boolean = yes;
    return node;
}
SceneNode node_of(const std::string& text)
{
    SceneNode node;
    node.kind = Kind::String;
    node.text = text;
    return node;
}
template <class List>
SceneNode list_of(const List& values)
{
    SceneNode node;
    node.kind = Kind::Array;
    for (const auto& value : values)
        node.items.push_back(node_of(value));
    return node;
}
SceneNode node_of(const std::array<double, 3>& point)
{
    return list_of(point);
}
SceneNode node_of(const std::array<double, 2>& range)
{
    return list_of(range);
}

std::string hex_text(uint32_t rgb)
{
    return fmt::format("#{:06x}", rgb);
}

/// "#rrggbb" where that says exactly this, else three numbers.
SceneNode node_of(const std::array<float, 3>& linear)
{
    uint32_t rgb = 0;
    for (const float channel : linear) {
        // the byte whose light is the nearest: light grows with the byte, and 256 are few
        uint32_t byte = 0;
        while (byte < 255 && linear_of_srgb_bytes(byte)[2] < channel)
            ++byte;
        rgb = rgb << 8 | byte;
    }
    return linear_of_srgb_bytes(rgb) == linear ? node_of(hex_text(rgb)) : list_of(linear);
}

/// Objects under way: a key is written where its value is not what holds without it.
class Object {
public:
    Object() { node_.kind = Kind::Object; }

    template <class T>
    void always(const char* path, const T& value)
    {
        set_node(node_, path, node_of(value));
    }
    template <class T>
    void number(const char* path, const T& value, const T& without)
    {
        if (value != without)
            always(path, value);
    }
    template <class T>
    void given(const char* path, const std::optional<T>& value)
    {
        if (value)
            always(path, *value);
    }
    void text(const char* path, const std::string& value)
    {
        if (!value.empty())
            always(path, value);
    }
    /// `words` in the order of the enumeration.
    template <class T>
    void choice(const char* path, T value, std::initializer_list<const char*> words)
    {
        always(path, std::string(words.begin()[size_t(value)]));
    }
    void list(const char* path, std::vector<SceneNode> items)
    {
        if (items.empty())
            return;
        SceneNode node;
        node.kind = Kind::Array;
        node.items = std::move(items);
        set_node(node_, path, std::move(node));
    }
    SceneNode take() { return std::move(node_); }

private:
    SceneNode node_;
};

template <class Items, class Write>
std::vector<SceneNode> each(const Items& items, Write write)
{
    std::vector<SceneNode> nodes;
    std::transform(items.begin(), items.end(), std::back_inserter(nodes), write);
    return nodes;
}

// ---- what a request has --------------------------------------------------------------------------------------------

SceneNode camera_node(const SceneCamera& camera)
{
    Object object;
    object.text("name", camera.name);
    object.text("view", camera.view);
    object.given("eye", camera.eye);
    object.given("target", camera.target);
    object.given("up", camera.up);
    object.given("fov_deg", camera.fov_deg);
    object.given("height_mm", camera.height_mm);
    object.given("parallel", camera.parallel);
    return object.take();
}

SceneNode light_node(const Light& light)
{
    Object object;
    switch (light.kind) {
    case LightKind::Directional:
        object.always("direction", light.direction);
        object.number("half_angle_deg", light.half_angle_deg, 0.0);
        break;
    case LightKind::Point:
        object.always("position", light.position_mm);
        object.number("radius_mm", light.radius_mm, 0.0);
        break;
    case LightKind::Eye:
        object.always("at_eye", true);
        break;
    }
    // colours end at 1e6 and go on by the strength, a power of 2: what it divides and multiplies stays the same
    constexpr float kMostColor = 1e6f, kStrength = 524288;
    std::array<float, 3> color = light.color;
    if (*std::max_element(color.begin(), color.end()) > kMostColor) {
        for (float& channel : color)
            channel = std::min(channel / kStrength, kMostColor);
        object.always("strength", kStrength);
    }
    object.number("color", color, {1, 1, 1});
    object.number("shadows", light.shadows, false);
    return object.take();
}

bool gives_anything(const Material& material)
{
    return material.color || material.opacity || material.mirror || material.specular;
}

SceneNode rule_node(const MaterialRule& rule)
{
    Object object;
    object.given("part", rule.part);
    object.list("faces", each(rule.faces, [](uint32_t face) { return node_of(face); }));
    if (rule.pack_color)
        object.always("pack_color", hex_text(*rule.pack_color));
    object.given("color", rule.material.color);
    object.given("opacity", rule.material.opacity);
    object.given("mirror", rule.material.mirror);
    object.given("specular", rule.material.specular);
    return object.take();
}

SceneNode plane_node(const SectionPlane& plane)
{
    Object object;
    object.always("point", plane.point_mm);
    object.always("normal", plane.normal);
    return object.take();
}

void write_placements(const Arrangement& arrangement, Object& scene)
{
    const auto named = [](const std::string& name) { return node_of(name); };
    scene.list("placements.only", each(arrangement.only, named));
    scene.list("placements.hide", each(arrangement.hide, named));
    scene.number("placements.explode", arrangement.explode, 0.0);
}

void write_map(const SurfaceMapLook& map, Object& scene)
{
    const SurfaceMapLook plain;
    if (map.map != plain.map)
        scene.choice("effects.map.kind", map.map,
                     {"none", "zebra", "isophotes", "curvature-gaussian", "curvature-mean", "curvature-max",
                      "curvature-min", "draft"});
    scene.number("effects.map.stripes", map.stripes, plain.stripes);
    scene.number("effects.map.direction", map.direction, plain.direction);
    scene.given("effects.map.range", map.range);
    scene.number("effects.map.draft_deg", map.draft_deg, plain.draft_deg);
}

void write_effects(const SceneRequest& request, Object& scene)
{
    const SceneRequest plain;
    const SceneLook &look = request.look, &plain_look = plain.look;
    if (request.edges_only)
        scene.always("effects.style", std::string("edges-only"));
    if (request.edges)
        scene.choice("effects.edges.lines", *request.edges, {"none", "sharp", "all"});
    scene.number("effects.edges.width_px", request.edge_width_px, plain.edge_width_px);
    scene.given("effects.edges.color", request.edge_color);
    scene.given("effects.silhouettes", request.silhouettes);
    scene.given("effects.antialias.samples", request.samples);
    scene.number("effects.antialias.trims", request.antialias_trims, plain.antialias_trims);
    if (request.shadows)
        scene.choice("effects.shadows.kind", *request.shadows, {"none", "hard", "soft"});
    scene.number("effects.shadows.samples", look.light_samples, plain_look.light_samples);
    scene.number("effects.occlusion.samples", look.occlusion.samples, plain_look.occlusion.samples);
    scene.number("effects.occlusion.reach_mm", look.occlusion.reach_mm, plain_look.occlusion.reach_mm);
    scene.list("effects.section.planes", each(look.section.planes, plane_node));
    if (look.section.caps != plain_look.section.caps)
        scene.choice("effects.section.caps", look.section.caps, {"none", "filled", "hatched"});
    scene.given("effects.section.cap_color", look.section.cap_color);
    scene.given("effects.xray", look.xray);
    scene.number("effects.mirror_depth", look.mirror_depth, plain_look.mirror_depth);
    write_map(look.map, scene);
}

/// A path from the working folder as one from the folder of `file`.
std::string path_beside(const std::string& path, const std::string& file)
{
    namespace fs = std::filesystem;
    const fs::path folder = fs::path(file).parent_path();
    if (folder.empty() || fs::path(path).is_absolute())
        return path;
    return fs::absolute(path).lexically_normal().lexically_proximate(fs::absolute(folder).lexically_normal()).string();
}

// ---- text ----------------------------------------------------------------------------------------------------------

constexpr size_t kLineLength = 100;

std::string quoted(const std::string& text)
{
    // a file is UTF-8: what is not is marked as such, as anywhere
    return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// The value on one line where it fits, else an item a line. `indent`: of the line it begins on.
std::string json_text(const SceneNode& node, size_t indent)
{
    switch (node.kind) {
    case Kind::Boolean:
        return node.boolean ? "true" : "false";
    case Kind::Number: // JSON's whole numbers have no negative zero
        return node.number == 0 && std::signbit(node.number) ? "-0.0" : fmt::format("{}", node.number);
    case Kind::String:
        return quoted(node.text);
    default:
        break;
    }
    const bool object = node.kind == Kind::Object;
    std::vector<std::string> items;
    size_t length = indent;
    bool broken = false;
    for (size_t i = 0; i < node.items.size(); ++i) {
        const std::string item = json_text(node.items[i], indent + 2);
        items.push_back(object ? fmt::format("{}: {}", quoted(node.keys[i]), item) : item);
        length += items.back().size() + 2;
        broken = broken || items.back().find('\n') != std::string::npos;
    }
    broken = broken || length > kLineLength;
    const std::string line = fmt::format("\n{:{}}", "", indent);
    std::string text(1, object ? '{' : '[');
    for (size_t i = 0; i < items.size(); ++i)
        text += fmt::format("{}{}{}{}", i > 0 ? "," : "",
                            broken  ? line
                            : i > 0 ? " "
                                    : "",
                            broken ? "  " : "", items[i]);
    if (broken)
        text += line;
    return text + (object ? '}' : ']');
}

} // namespace

std::string scene_text(const SceneRequest& request, const std::string& file)
{
    Object scene;
    scene.list("cameras", each(request.cameras, camera_node));
    scene.given("background", request.background);
    if (request.environment)
        scene.always("environment", path_beside(*request.environment, file));
    scene.list("lights", each(request.look.lights, light_node));
    scene.given("sky", request.look.sky);
    std::vector<MaterialRule> rules;
    std::copy_if(request.look.materials.begin(), request.look.materials.end(), std::back_inserter(rules),
                 [](const MaterialRule& rule) { return gives_anything(rule.material); });
    scene.list("materials", each(rules, rule_node));
    write_placements(request.look.arrangement, scene);
    write_effects(request, scene);
    return json_text(scene.take(), 0) + "\n";
}

} // namespace trimray
