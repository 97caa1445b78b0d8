#include "runtime/scene_request.h"

#include "runtime/color_text.h"
#include "runtime/nearest_word.h"
#include "runtime/surface_map.h"
#include "shaders/light_layout.h"
#include "shaders/section_layout.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <utility>

namespace trimray {
namespace {

using Kind = SceneNode::Kind;
using Vec3 = std::array<double, 3>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMostMm = 1e12; // of a coordinate or length: their squares are still far from overflow in float

/// Numbers that a key may have.
struct Range {
    double lo = -kMostMm, hi = kMostMm;
    bool lo_open = false, hi_open = false;

    bool has(double x) const { return (lo_open ? x > lo : x >= lo) && (hi_open ? x < hi : x <= hi); }
    std::string text() const { return fmt::format("{}{}, {}{}", lo_open ? '(' : '[', lo, hi, hi_open ? ')' : ']'); }
};
constexpr Range kShare{0, 1};
constexpr Range kLength{0, kMostMm, true};

/// What an error says was found.
std::string shown(const SceneNode& node)
{
    constexpr size_t kMost = 60; // letters of a text
    const std::string text = node.text.size() > kMost ? node.text.substr(0, kMost) + "..." : node.text;
    switch (node.kind) {
    case Kind::Null:
        return "null";
    case Kind::Boolean:
        return node.boolean ? "true" : "false";
    case Kind::Number:
        return fmt::format("{}", node.number);
    case Kind::String:
        return fmt::format("\"{}\"", text);
    case Kind::Array:
        return fmt::format("a list of {}", node.items.size());
    case Kind::Object:
        return "an object";
    case Kind::Words:
        return fmt::format("'{}'", text);
    }
    return "";
}

/// The numbers of a list; nothing where it holds anything else, or they are not finite.
std::optional<std::vector<double>> numbers_of(const SceneNode& node)
{
    std::vector<double> numbers;
    if (node.kind == Kind::Array) {
        for (const SceneNode& item : node.items) {
            if (item.kind != Kind::Number)
                return std::nullopt;
            numbers.push_back(item.number);
        }
        return numbers;
    }
    if (node.kind == Kind::Number)
        return std::vector{node.number};
    if (node.kind != Kind::Words)
        return std::nullopt;
    const char* at = node.text.data();
    const char* const end = at + node.text.size();
    while (true) {
        double number = 0;
        const auto [next, status] = std::from_chars(at, end, number);
        if (status != std::errc() || !std::isfinite(number))
            return std::nullopt;
        numbers.push_back(number);
        if (next == end)
            return numbers;
        if (*next != ',')
            return std::nullopt;
        at = next + 1;
    }
}

/// What all readers of one tree share: whose it is, and the first fault. Nothing is read after a fault.
struct Reading {
    const std::string& file;
    std::optional<Error> error;

    /// The place of a node: "file:line", or the option.
    std::string where(const SceneNode& node, uint32_t line) const
    {
        return node.option.empty() ? fmt::format("{}:{}", file, line) : node.option;
    }
    void fail(const SceneNode& node, const std::string& path, const std::string& detail)
    {
        fail_at(node, node.line, path, detail);
    }
    void fail_at(const SceneNode& node, uint32_t line, const std::string& path, const std::string& detail)
    {
        if (error)
            return;
        const bool option = !node.option.empty();
        error = Error{option ? ErrorCode::Usage : ErrorCode::InvalidScene, where(node, line),
                      option || path.empty() ? detail : fmt::format("{}: {}", path, detail)};
    }
    void expected(const SceneNode& node, const std::string& path, const std::string& what)
    {
        fail(node, path, fmt::format("expected {}, found {}", what, shown(node)));
    }
};

/// The members of one object, taken by their keys; done() fails at those that nobody took.
class Fields {
public:
    Fields(Reading& reading, const SceneNode& node, std::string path)
        : reading_(reading), node_(node), path_(std::move(path))
    {
        if (node.kind != Kind::Object)
            reading.expected(node, path_, "an object");
    }

    const SceneNode* take(const char* key)
    {
        known_.emplace_back(key);
        return reading_.error || node_.kind != Kind::Object ? nullptr : node_.find(key);
    }
    std::string path(const char* key) const { return path_.empty() ? key : path_ + "." + key; }

    template <class T>
    bool number(const char* key, Range range, T& out)
    {
        const SceneNode* const node = take(key);
        if (node == nullptr)
            return false;
        const auto numbers = node->kind == Kind::Array ? std::nullopt : numbers_of(*node);
        if (!numbers || numbers->size() != 1 || !range.has((*numbers)[0]))
            return expected(*node, key, fmt::format("a number in {}", range.text()));
        out = static_cast<Value<T>>((*numbers)[0]);
        return true;
    }
    template <class T>
    bool count(const char* key, uint32_t lo, uint32_t hi, T& out)
    {
        const SceneNode* const node = take(key);
        if (node == nullptr)
            return false;
        const auto numbers = node->kind == Kind::Array ? std::nullopt : numbers_of(*node);
        if (!numbers || numbers->size() != 1 || !Range{double(lo), double(hi)}.has((*numbers)[0]) ||
            (*numbers)[0] != std::floor((*numbers)[0]))
            return expected(*node, key, fmt::format("a whole number from {} to {}", lo, hi));
        out = static_cast<uint32_t>((*numbers)[0]);
        return true;
    }
    template <class T>
    bool flag(const char* key, T& out)
    {
        const SceneNode* const node = take(key);
        if (node == nullptr)
            return false;
        const bool word = node->kind == Kind::Words && (node->text == "true" || node->text == "false");
        if (node->kind != Kind::Boolean && !word)
            return expected(*node, key, "true or false");
        out = word ? node->text == "true" : node->boolean;
        return true;
    }
    bool text(const char* key, std::string& out)
    {
        const SceneNode* const node = take(key);
        if (node == nullptr)
            return false;
        const std::string read = text_of(*node, path(key));
        if (!read.empty())
            out = read;
        return !read.empty();
    }
    /// Empty: it is no text, or one without letters, which is a fault.
    std::string text_of(const SceneNode& node, const std::string& path)
    {
        if ((node.kind == Kind::String || node.kind == Kind::Words) && !node.text.empty())
            return node.text;
        reading_.expected(node, path, "a text");
        return "";
    }
    /// The number of the word that is there in `words`; -1: there is none.
    int choice(const char* key, const std::vector<std::string>& words)
    {
        const SceneNode* const node = take(key);
        if (node == nullptr)
            return -1;
        const bool is_text = node->kind == Kind::String || node->kind == Kind::Words;
        const auto found = std::find(words.begin(), words.end(), is_text ? node->text : "");
        if (found != words.end())
            return int(found - words.begin());
        reading_.fail(*node, path(key),
                      fmt::format("expected one of {}, found {}{}", fmt::join(words, ", "), shown(*node),
                                  is_text ? did_you_mean(node->text, words) : ""));
        return -1;
    }
    template <class T>
    bool vector(const char* key, T& out)
    {
        return numbers<3>(key, "three numbers", out);
    }
    template <class T>
    bool direction(const char* key, T& out)
    {
        Vec3 read{};
        if (!numbers<3>(key, "three numbers", read))
            return false;
        if (read == Vec3{0, 0, 0}) {
            const SceneNode& node = *node_.find(key);
            reading_.fail(node, path(key), "has no length");
            return false;
        }
        out = read;
        return true;
    }
    template <size_t N, class T>
    bool numbers(const char* key, const char* what, T& out)
    {
        const SceneNode* const node = take(key);
        if (node == nullptr)
            return false;
        const auto numbers = numbers_of(*node);
        if (!numbers || numbers->size() != N ||
            !std::all_of(numbers->begin(), numbers->end(), [](double x) { return Range{}.has(x); }))
            return expected(*node, key,
                            fmt::format("{}{} of at most {} in size", node->kind == Kind::Words ? "" : "a list of ",
                                        what, kMostMm));
        std::array<double, N> read{};
        std::copy(numbers->begin(), numbers->end(), read.begin());
        out = read;
        return true;
    }
    /// A colour as text (sRGB) or three numbers (linear light). `other`: a word for none.
    bool color(const char* key, std::optional<std::array<float, 3>>& out, const char* other = nullptr)
    {
        const SceneNode* const node = take(key);
        if (node == nullptr)
            return false;
        if (const auto rgb = srgb_of_text(node->text)) {
            out = linear_of_srgb_bytes(*rgb);
            return true;
        }
        if (other != nullptr && node->text == other) {
            out.reset();
            return true;
        }
        const auto numbers = numbers_of(*node);
        if (!numbers || numbers->size() != 3 ||
            !std::all_of(numbers->begin(), numbers->end(), [](double x) { return x >= 0 && x <= kMostRadiance; }))
            return expected(*node, key,
                            fmt::format("{}{}white, black, #rrggbb or three numbers in [0, {}]",
                                        other != nullptr ? other : "", other != nullptr ? ", " : "", kMostRadiance));
        out = std::array{float((*numbers)[0]), float((*numbers)[1]), float((*numbers)[2])};
        return true;
    }
    /// Calls read(node, path) for each item of a list of at most `most`.
    template <class Read>
    bool list(const char* key, size_t most, Read read)
    {
        const SceneNode* const node = take(key);
        if (node == nullptr)
            return false;
        if (node->kind != Kind::Array)
            return expected(*node, key, "a list");
        if (node->items.size() > most) {
            reading_.fail(*node, path(key),
                          fmt::format("{} of them; at most {} are possible", node->items.size(), most));
            return false;
        }
        for (size_t i = 0; i < node->items.size() && !reading_.error; ++i)
            read(node->items[i], fmt::format("{}[{}]", path(key), i));
        return true;
    }

    void done()
    {
        if (reading_.error)
            return;
        for (size_t i = 0; i < node_.keys.size(); ++i)
            if (std::find(known_.begin(), known_.end(), node_.keys[i]) == known_.end()) {
                const std::string near = did_you_mean(node_.keys[i], known_);
                reading_.fail_at(node_.items[i], node_.items[i].key_line, path(node_.keys[i].c_str()),
                                 near.empty() ? fmt::format("no such key; there are {}", fmt::join(known_, ", "))
                                              : "no such key" + near);
                return;
            }
    }

private:
    static constexpr double kMostRadiance = 1e6;

    template <class T>
    struct ValueOf {
        using Type = T;
    };
    template <class T>
    struct ValueOf<std::optional<T>> {
        using Type = T;
    };
    template <class T>
    using Value = typename ValueOf<T>::Type;

    bool expected(const SceneNode& node, const char* key, const std::string& what)
    {
        reading_.expected(node, path(key), what);
        return false;
    }

    Reading& reading_;
    const SceneNode& node_;
    std::string path_;
    std::vector<std::string> known_;
};

SceneCamera camera_from(Reading& reading, const SceneNode& node, const std::string& path)
{
    SceneCamera camera;
    camera.where = reading.where(node, node.line);
    Fields fields(reading, node, path);
    fields.text("name", camera.name);
    if (const int view = fields.choice("view", standard_view_names()); view >= 0)
        camera.view = standard_view_names()[size_t(view)];
    fields.vector("eye", camera.eye);
    fields.vector("target", camera.target);
    fields.direction("up", camera.up);
    fields.number("fov_deg", Range{0, 180, true, true}, camera.fov_deg);
    fields.number("height_mm", kLength, camera.height_mm);
    fields.flag("parallel", camera.parallel);
    fields.done();
    if (camera.eye && !camera.view.empty())
        reading.fail(node, path, "an eye and a view exclude each other");
    if (camera.eye && camera.eye == camera.target)
        reading.fail(node, path, "the eye is where the target is: there is no direction to look in");
    if (camera.fov_deg && camera.height_mm)
        reading.fail(node, path, "fov_deg is a pinhole's, height_mm is of parallel rays: they exclude each other");
    if (camera.fov_deg && camera.parallel.value_or(false))
        reading.fail(node, path, "fov_deg is a pinhole's: it excludes parallel rays");
    return camera;
}

/// A camera of a file stands by itself; options may change some of its fields.
void check_whole(Reading& reading, const SceneNode& node, const std::string& path, const SceneCamera& camera)
{
    if (!camera.eye && (camera.target || camera.up))
        reading.fail(node, path, "target and up need an eye; without it the model is framed whole from a view");
    if (camera.eye && camera.parallel.value_or(false) && !camera.height_mm)
        reading.fail(node, path, "parallel rays from an eye need height_mm, the height of what is seen");
}

Light light_from(Reading& reading, const SceneNode& node, const std::string& path)
{
    Light light;
    Fields fields(reading, node, path);
    const bool directional = fields.direction("direction", light.direction);
    const bool point = fields.vector("position", light.position_mm);
    bool at_eye = false;
    fields.flag("at_eye", at_eye);
    std::optional<std::array<float, 3>> color;
    if (fields.color("color", color))
        light.color = *color;
    float strength = 1;
    fields.number("strength", Range{0, 1e6}, strength);
    for (float& channel : light.color)
        channel *= strength;
    const bool has_angle = fields.number("half_angle_deg", Range{0, 60}, light.half_angle_deg);
    const bool has_radius = fields.number("radius_mm", Range{0, kMostMm}, light.radius_mm);
    fields.flag("shadows", light.shadows);
    fields.done();
    if (int(directional) + int(point) + int(at_eye) != 1)
        reading.fail(node, path, "expected one of direction, position (of a point light) and at_eye");
    if (has_angle && !directional)
        reading.fail(node, path, "half_angle_deg is for lights with a direction; a point light has radius_mm");
    if (has_radius && !point)
        reading.fail(node, path, "radius_mm is for point lights; a light with a direction has half_angle_deg");
    if (at_eye && light.shadows)
        reading.fail(node, path, "a light at the eye throws no shadows that are seen");
    light.kind = point ? LightKind::Point : at_eye ? LightKind::Eye : LightKind::Directional;
    return light;
}

/// Face numbers; on the command line "3+4+10".
void read_faces(Reading& reading, Fields& fields, std::vector<uint32_t>& faces)
{
    const SceneNode* const node = fields.take("faces");
    if (node == nullptr)
        return;
    SceneNode listed = *node;
    std::replace(listed.text.begin(), listed.text.end(), '+', ',');
    const auto numbers = listed.kind == Kind::Number ? std::nullopt : numbers_of(listed);
    constexpr double kMost = 4294967294.0;
    if (!numbers || numbers->empty() || !std::all_of(numbers->begin(), numbers->end(), [](double x) {
            return x >= 0 && x <= kMost && x == std::floor(x);
        })) {
        reading.expected(*node, fields.path("faces"),
                         node->kind == Kind::Words ? "numbers of faces with + between them"
                                                   : "a list of one or more numbers of faces");
        return;
    }
    for (const double number : *numbers)
        faces.push_back(static_cast<uint32_t>(number));
}

MaterialRule rule_from(Reading& reading, const SceneNode& node, const std::string& path)
{
    MaterialRule rule;
    Fields fields(reading, node, path);
    std::string part;
    if (fields.text("part", part))
        rule.part = part;
    read_faces(reading, fields, rule.faces);
    if (const SceneNode* const color = fields.take("pack_color")) {
        rule.pack_color = srgb_of_text(color->text);
        if (!rule.pack_color)
            reading.expected(*color, fields.path("pack_color"), "white, black or #rrggbb");
    }
    fields.color("color", rule.material.color);
    fields.number("opacity", kShare, rule.material.opacity);
    fields.number("mirror", kShare, rule.material.mirror);
    fields.number("specular", kShare, rule.material.specular);
    fields.done();
    const Material& gives = rule.material;
    if (!gives.color && !gives.opacity && !gives.mirror && !gives.specular)
        reading.fail(node, path, "gives nothing; expected color, opacity, mirror or specular");
    return rule;
}

SectionPlane plane_from(Reading& reading, const SceneNode& node, const std::string& path)
{
    SectionPlane plane;
    Fields fields(reading, node, path);
    const bool has_point = fields.vector("point", plane.point_mm);
    const bool has_normal = fields.direction("normal", plane.normal);
    fields.done();
    if (!has_point || !has_normal)
        reading.fail(node, path, "expected a point and a normal");
    return plane;
}

void read_names(Fields& fields, const char* key, std::vector<std::string>& names)
{
    constexpr size_t kMostNames = 10000;
    std::vector<std::string> read;
    const auto read_one = [&](const SceneNode& node, const std::string& path) {
        read.push_back(fields.text_of(node, path));
    };
    if (fields.list(key, kMostNames, read_one))
        names = std::move(read);
}

void read_placements(Reading& reading, const SceneNode& node, const std::string& path, Arrangement& arrangement)
{
    Fields fields(reading, node, path);
    read_names(fields, "only", arrangement.only);
    read_names(fields, "hide", arrangement.hide);
    fields.number("explode", Range{0, 1e6}, arrangement.explode);
    fields.done();
}

void read_edges(Reading& reading, const SceneNode& node, const std::string& path, SceneRequest& request)
{
    Fields fields(reading, node, path);
    if (const int lines = fields.choice("lines", {"none", "sharp", "all"}); lines >= 0)
        request.edges = std::array{EdgeLines::None, EdgeLines::Sharp, EdgeLines::All}[size_t(lines)];
    fields.number("width_px", Range{0, double(kLargestEdgeWidthPx), true}, request.edge_width_px);
    fields.color("color", request.edge_color, "auto");
    fields.done();
}

void read_shadows(Reading& reading, const SceneNode& node, const std::string& path, SceneRequest& request)
{
    Fields fields(reading, node, path);
    if (const int kind = fields.choice("kind", {"none", "hard", "soft"}); kind >= 0)
        request.shadows = std::array{ShadowKind::None, ShadowKind::Hard, ShadowKind::Soft}[size_t(kind)];
    fields.count("samples", 1, kMostRaysAPixel, request.look.light_samples);
    fields.done();
}

void read_section(Reading& reading, const SceneNode& node, const std::string& path, SectionLook& section)
{
    Fields fields(reading, node, path);
    std::vector<SectionPlane> planes;
    if (fields.list("planes", kMostSectionPlanes, [&](const SceneNode& item, const std::string& at) {
            planes.push_back(plane_from(reading, item, at));
        }))
        section.planes = planes;
    if (const int caps = fields.choice("caps", {"none", "filled", "hatched"}); caps >= 0)
        section.caps = std::array{CapStyle::None, CapStyle::Filled, CapStyle::Hatched}[size_t(caps)];
    fields.color("cap_color", section.cap_color, "auto");
    fields.done();
}

void read_map(Reading& reading, const SceneNode& node, const std::string& path, SurfaceMapLook& map)
{
    Fields fields(reading, node, path);
    const int kind = fields.choice("kind", {"none", "zebra", "isophotes", "curvature-gaussian", "curvature-mean",
                                            "curvature-max", "curvature-min", "draft"});
    if (kind >= 0)
        map.map = std::array{SurfaceMap::None,          SurfaceMap::Zebra,
                             SurfaceMap::Isophotes,     SurfaceMap::CurvatureGaussian,
                             SurfaceMap::CurvatureMean, SurfaceMap::CurvatureMax,
                             SurfaceMap::CurvatureMin,  SurfaceMap::Draft}[size_t(kind)];
    fields.count("stripes", 1, kMostStripes, map.stripes);
    fields.direction("direction", map.direction);
    std::array<double, 2> range{};
    if (fields.numbers<2>("range", "two numbers", range)) {
        map.range = range;
        if (!(range[0] < range[1]))
            reading.fail(*node.find("range"), fields.path("range"), "the first number must be below the second");
    }
    fields.number("draft_deg", Range{0, 90, false, true}, map.draft_deg);
    fields.done();
}

void read_effects(Reading& reading, const SceneNode& node, const std::string& path, SceneRequest& request)
{
    Fields fields(reading, node, path);
    SceneLook& look = request.look;
    if (const int style = fields.choice("style", {"shaded", "edges-only"}); style >= 0)
        request.edges_only = style == 1;
    if (const SceneNode* const edges = fields.take("edges"))
        read_edges(reading, *edges, fields.path("edges"), request);
    fields.flag("silhouettes", request.silhouettes);
    if (const SceneNode* const antialias = fields.take("antialias")) {
        Fields samples(reading, *antialias, fields.path("antialias"));
        samples.count("samples", 1, kMostSamples, request.samples);
        samples.flag("trims", request.antialias_trims);
        samples.done();
    }
    if (const SceneNode* const shadows = fields.take("shadows"))
        read_shadows(reading, *shadows, fields.path("shadows"), request);
    if (const SceneNode* const occlusion = fields.take("occlusion")) {
        Fields rays(reading, *occlusion, fields.path("occlusion"));
        rays.count("samples", 0, kMostRaysAPixel, look.occlusion.samples);
        rays.number("reach_mm", kLength, look.occlusion.reach_mm);
        rays.done();
    }
    if (const SceneNode* const section = fields.take("section"))
        read_section(reading, *section, fields.path("section"), look.section);
    fields.number("xray", kShare, look.xray);
    fields.count("mirror_depth", 1, kMostMirrorDepth, look.mirror_depth);
    if (const SceneNode* const map = fields.take("map"))
        read_map(reading, *map, fields.path("map"), look.map);
    fields.done();
}

void read_root(Reading& reading, const SceneNode& root, SceneRequest& request)
{
    Fields fields(reading, root, "");
    fields.take("$schema"); // for editors
    constexpr size_t kMostCameras = 10000;
    fields.list("cameras", kMostCameras, [&](const SceneNode& node, const std::string& path) {
        request.cameras.push_back(camera_from(reading, node, path));
        check_whole(reading, node, path, request.cameras.back());
    });
    fields.color("background", request.background, "transparent");
    std::string environment;
    if (fields.text("environment", environment)) {
        const std::filesystem::path folder = std::filesystem::path(reading.file).parent_path();
        request.environment = (folder / environment).string();
    }
    std::vector<Light> lights;
    if (fields.list("lights", kMostLights, [&](const SceneNode& node, const std::string& path) {
            lights.push_back(light_from(reading, node, path));
        }))
        request.look.lights = lights;
    fields.number("sky", Range{0, kMostSky}, request.look.sky);
    fields.list("materials", kMostMaterialRules, [&](const SceneNode& node, const std::string& path) {
        request.look.materials.push_back(rule_from(reading, node, path));
        request.rules.push_back(node.option.empty() ? fmt::format("{}: {}", reading.where(node, node.line), path)
                                                    : node.option);
    });
    if (const SceneNode* const placements = fields.take("placements"))
        read_placements(reading, *placements, "placements", request.look.arrangement);
    if (const SceneNode* const effects = fields.take("effects"))
        read_effects(reading, *effects, "effects", request);
    fields.done();
}

/// A file's bytes, at most kMostSceneBytes and one: a pipe or device does not end by itself.
Result<SceneNode> read_tree(const std::string& path)
{
    std::error_code failed;
    if (!std::filesystem::exists(path, failed))
        return Error{ErrorCode::FileNotFound, path, "no such file"};
    if (std::filesystem::is_directory(path, failed))
        return Error{ErrorCode::FileNotReadable, path, "is a folder"};
    std::ifstream file(path, std::ios::binary);
    std::string text(kMostSceneBytes + 1, '\0');
    file.read(text.data(), std::streamsize(text.size()));
    if (file.bad() || (file.fail() && !file.eof()))
        return Error{ErrorCode::FileNotReadable, path, "cannot be read"};
    text.resize(size_t(file.gcount()));
    return parse_scene_json(text, path);
}

} // namespace

Status read_scene(const SceneNode& root, const std::string& file, SceneRequest& request)
{
    Reading reading{file, std::nullopt};
    read_root(reading, root, request);
    if (!reading.error && request.look.materials.size() > kMostMaterialRules)
        reading.error = Error{ErrorCode::Usage, "--material",
                              fmt::format("more than {} rules, with those of the scene file", kMostMaterialRules)};
    return reading.error ? Status(*reading.error) : Status(Done{});
}

Result<SceneRequest> read_scene_file(const std::string& path)
{
    const Result<SceneNode> tree = read_tree(path);
    if (!tree.ok())
        return tree.error();
    SceneRequest request;
    if (const Status read = read_scene(*tree, path, request); !read.ok())
        return read.error();
    return request;
}

Result<std::vector<SceneCamera>> read_cameras(const std::string& path)
{
    Result<SceneNode> tree = read_tree(path);
    if (!tree.ok())
        return tree.error();
    SceneNode root = std::move(*tree);
    if (root.kind == Kind::Array) { // a list of cameras by itself
        SceneNode scene;
        scene.line = root.line;
        set_node(scene, "cameras", std::move(root));
        root = std::move(scene);
    }
    SceneRequest request;
    if (const Status read = read_scene(root, path, request); !read.ok())
        return read.error();
    if (request.cameras.empty())
        return Error{ErrorCode::InvalidScene, path, "holds no cameras"};
    return request.cameras;
}

Result<SceneCamera> read_camera(const SceneNode& node)
{
    const std::string none;
    Reading reading{none, std::nullopt};
    const SceneCamera camera = camera_from(reading, node, "");
    return reading.error ? Result<SceneCamera>(*reading.error) : Result<SceneCamera>(camera);
}

} // namespace trimray
