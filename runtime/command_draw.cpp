#include "runtime/command_draw.h"

#include "runtime/command_trace.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cstdint>
#include <utility>

namespace trimray {
namespace {

using Values = std::vector<std::string>;

/// Puts an option's values where a scene file has them. Fails: Usage.
using Put = Status (*)(const std::string& option, const Values& values, SceneNode& root, const char* path);

Status put_words(const std::string& option, const Values& values, SceneNode& root, const char* path)
{
    set_node(root, path, words_node(option, values.back()));
    return Done{};
}

/// A list of "key=value,..." objects.
Status put_pairs(const std::string& option, const Values& values, SceneNode& root, const char* path)
{
    SceneNode list;
    list.kind = SceneNode::Kind::Array;
    list.option = option;
    for (const std::string& value : values) {
        Result<SceneNode> pairs = pairs_node(option, value);
        if (!pairs.ok())
            return pairs.error();
        list.items.push_back(std::move(*pairs));
    }
    set_node(root, path, std::move(list));
    return Done{};
}

/// A list of names.
Status put_names(const std::string& option, const Values& values, SceneNode& root, const char* path)
{
    SceneNode list;
    list.kind = SceneNode::Kind::Array;
    list.option = option;
    for (const std::string& value : values)
        list.items.push_back(words_node(option, value));
    set_node(root, path, std::move(list));
    return Done{};
}

/// "x,y,z:nx,ny,nz" each.
Status put_planes(const std::string& option, const Values& values, SceneNode& root, const char* path)
{
    SceneNode list;
    list.kind = SceneNode::Kind::Array;
    list.option = option;
    for (const std::string& value : values) {
        const size_t colon = value.find(':');
        if (colon == value.npos)
            return Error{ErrorCode::Usage, option,
                         fmt::format("expected a point and a normal, x,y,z:nx,ny,nz, found '{}'", value)};
        SceneNode plane;
        set_node(plane, "point", words_node(option, value.substr(0, colon)));
        set_node(plane, "normal", words_node(option, value.substr(colon + 1)));
        plane.option = option;
        list.items.push_back(std::move(plane));
    }
    set_node(root, path, std::move(list));
    return Done{};
}

/// "N" or "N,REACH_MM".
Status put_occlusion(const std::string& option, const Values& values, SceneNode& root, const char*)
{
    const std::string& value = values.back();
    const size_t comma = value.find(',');
    set_node(root, "effects.occlusion.samples", words_node(option, value.substr(0, comma)));
    if (comma != value.npos)
        set_node(root, "effects.occlusion.reach_mm", words_node(option, value.substr(comma + 1)));
    return Done{};
}

Status put_antialias(const std::string& option, const Values& values, SceneNode& root, const char* path)
{
    static const Choice choice{"--antialias", {"none", "trims"}, {"none", "trims"}};
    if (const Status known = check_choice(choice, values.back()); !known.ok())
        return known;
    set_node(root, path, words_node(option, values.back() == "trims" ? "true" : "false"));
    return Done{};
}

constexpr const char* kDrawing = "Drawing";
constexpr const char* kLights = "Lights and shadows";
constexpr const char* kMaterials = "Materials and surroundings";
constexpr const char* kPlacements = "Placements";
constexpr const char* kSections = "Sections and maps";

struct DrawOption {
    const char* option;
    const char* path; // of the key
    Put put;
    const char* group;
    const char* help;
};
constexpr DrawOption kOptions[] = {
    {"--edges", "effects.edges.lines", put_words, kDrawing,
     "Lines along borders of faces: none, sharp (faces meet at an angle, or one ends) or all (smooth ones too) [none; "
     "sharp in the style edges-only]"},
    {"--style", "effects.style", put_words, kDrawing,
     "shaded, or edges-only: faces hide what is behind them, unseen themselves [shaded]"},
    {"--edge-width", "effects.edges.width_px", put_words, kDrawing,
     "Width of lines in pixels, the same at every slant [1.5]"},
    {"--edge-color", "effects.edges.color", put_words, kDrawing,
     "auto (dark on light faces, light on dark ones), black, white or #rrggbb [auto]"},
    {"--antialias", "effects.antialias.trims", put_antialias, kDrawing,
     "none, or trims: borders and rims of faces smoothed at one sample a pixel [none]"},
    {"--samples", "effects.antialias.samples", put_words, kDrawing,
     "N x N samples a pixel, averaged (PNG only), N at most 16 [1]"},
    {"--light", "lights", put_pairs, kLights,
     "A light, repeatable: direction=x,y,z (the way light goes), position=x,y,z or at_eye=true; color=, strength=, "
     "half_angle_deg= "
     "or radius_mm= (its size), shadows=true|false [one light at the eye]"},
    {"--sky", "sky", put_words, kLights,
     "Strength of the light from all around, in [0, 100] [1; 3 with --occlusion and no lights]"},
    {"--shadows", "effects.shadows.kind", put_words, kLights,
     "none, hard or soft, of all lights; without any, of a sun from the upper left [each light's own]"},
    {"--light-samples", "effects.shadows.samples", put_words, kLights,
     "Rays a pixel to each light that has a size [16]"},
    {"--occlusion", "effects.occlusion", put_occlusion, kLights,
     "N[,REACH_MM]: ambient occlusion by N rays a pixel; what is farther than REACH_MM hides nothing"},
    {"--material", "materials", put_pairs, kMaterials,
     "What faces are made of, repeatable, later ones win: part=NAME or part=#N, faces=1+2+3, pack_color=#rrggbb say "
     "which; color=, opacity=, mirror=, specular= say what"},
    {"--xray", "effects.xray", put_words, kMaterials, "Opacity, in [0, 1], of every surface that no rule gives one"},
    {"--mirror-depth", "effects.mirror_depth", put_words, kMaterials,
     "Reflections of reflections that are followed [1]"},
    {"--background", "background", put_words, kMaterials, "transparent, white, black or #rrggbb [transparent]"},
    {"--environment", "environment", put_words, kMaterials,
     "A picture all around, .hdr or .exr, equirectangular: seen behind the model and in mirrors"},
    {"--only", "placements.only", put_names, kPlacements,
     "A part or placement by its name, a part by #N, a placement by @N, repeatable: all others are hidden"},
    {"--hide", "placements.hide", put_names, kPlacements, "Likewise, repeatable: what is hidden"},
    {"--explode", "placements.explode", put_words, kPlacements,
     "Placements moved away from the model's middle by so many times their distance from there [0]"},
    {"--section", "effects.section.planes", put_planes, kSections,
     "x,y,z:nx,ny,nz, repeatable: cuts away what lies on the normal's side of a plane"},
    {"--caps", "effects.section.caps", put_words, kSections, "Cut solids: none, filled or hatched [filled]"},
    {"--cap-color", "effects.section.cap_color", put_words, kSections,
     "auto (of the face behind), black, white or #rrggbb [auto]"},
    {"--map", "effects.map.kind", put_words, kSections,
     "In place of colours: zebra, isophotes, curvature-gaussian, curvature-mean, curvature-max, curvature-min or "
     "draft"},
    {"--map-direction", "effects.map.direction", put_words, kSections,
     "x,y,z: the axis of zebra stripes, the light of isophotes, the pull of draft angles [0,0,1]"},
    {"--map-range", "effects.map.range", put_words, kSections,
     "lo,hi: curvatures at the ends of the scale [from the model's size]"},
    {"--stripes", "effects.map.stripes", put_words, kSections,
     "Pairs of bands over half a turn, zebra and isophotes [16]"},
    {"--draft", "effects.map.draft_deg", put_words, kSections, "Draft angle that is in order, in degrees [3]"},
};

} // namespace

void add_draw_options(CLI::App& command, DrawArguments& arguments)
{
    for (const DrawOption& option : kOptions) {
        DrawArguments::Given& given = arguments.given.emplace_back(DrawArguments::Given{option.option, {}});
        command.add_option(option.option, given.values, option.help)
            ->expected(1)
            ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
            ->group(option.group);
    }
    command
        .add_flag(
            "--silhouettes,!--no-silhouettes", [&arguments](std::int64_t count) { arguments.silhouettes = count > 0; },
            "Lines where a surface turns away and where a border hides what lies behind [no; yes in the style "
            "edges-only]")
        ->group(kDrawing);
}

Status read_drawing(const DrawArguments& arguments, SceneRequest& request)
{
    SceneNode root;
    root.kind = SceneNode::Kind::Object;
    for (size_t i = 0; i < arguments.given.size(); ++i) {
        const DrawArguments::Given& given = arguments.given[i];
        if (given.values.empty())
            continue;
        if (const Status put = kOptions[i].put(given.option, given.values, root, kOptions[i].path); !put.ok())
            return put;
    }
    if (arguments.silhouettes)
        set_node(root, "effects.silhouettes", words_node("--silhouettes", *arguments.silhouettes ? "true" : "false"));
    return read_scene(root, "", request);
}

} // namespace trimray
