#include "runtime/command_draw.h"

#include "runtime/command_trace.h"
#include "runtime/frame_effects.h"
#include "runtime/image_io.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <charconv>
#include <cstdint>
#include <utility>

namespace trimray {
namespace {

const Choice& edges_choice()
{
    static const Choice choice{"--edges", {"none", "sharp", "all"}, {"none", "sharp", "all"}};
    return choice;
}

const Choice& style_choice()
{
    static const Choice choice{"--style", {"shaded", "edges-only"}, {"shaded", "edges-only"}};
    return choice;
}

const Choice& antialias_choice()
{
    static const Choice choice{"--antialias", {"none", "trims"}, {"none", "trims"}};
    return choice;
}

} // namespace

void add_draw_options(CLI::App& command, DrawArguments& arguments)
{
    constexpr const char* kGroup = "Drawing";
    command
        .add_option("--edges", arguments.edges,
                    "Lines along borders of faces: none, sharp (faces meet at an angle, or one ends) or all (smooth "
                    "ones too) [none; sharp in the style edges-only]")
        ->group(kGroup);
    command
        .add_flag(
            "--silhouettes,!--no-silhouettes", [&arguments](std::int64_t count) { arguments.silhouettes = count > 0; },
            "Lines where a surface turns away and where a border hides what lies behind [no; yes in the style "
            "edges-only]")
        ->group(kGroup);
    command
        .add_option("--style", arguments.style,
                    "shaded, or edges-only: faces hide what is behind them, unseen themselves")
        ->capture_default_str()
        ->group(kGroup);
    command.add_option("--edge-width", arguments.edge_width_px, "Width of lines in pixels, the same at every slant")
        ->capture_default_str()
        ->group(kGroup);
    command
        .add_option("--edge-color", arguments.edge_color,
                    "auto (dark on light faces, light on dark ones), black, white or #rrggbb")
        ->capture_default_str()
        ->group(kGroup);
    command
        .add_option("--antialias", arguments.antialias,
                    "none, or trims: borders and rims of faces smoothed at one sample a pixel")
        ->capture_default_str()
        ->group(kGroup);
}

Status set_drawing(const DrawArguments& arguments, RenderOptions& options)
{
    const bool edges_only = arguments.style == "edges-only";
    const std::string edges = arguments.edges.value_or(edges_only ? "sharp" : "none");
    for (const auto& [choice, value] :
         {std::pair{&edges_choice(), &edges}, std::pair{&style_choice(), &arguments.style},
          std::pair{&antialias_choice(), &arguments.antialias}})
        if (const Status known = check_choice(*choice, *value); !known.ok())
            return known;
    const auto color = parse_color("--edge-color", arguments.edge_color, "auto");
    if (!color.ok())
        return color.error();
    options.edges = edges == "all" ? EdgeLines::All : edges == "sharp" ? EdgeLines::Sharp : EdgeLines::None;
    options.silhouettes = arguments.silhouettes.value_or(edges_only);
    options.fill = !edges_only;
    options.edge_width_px = static_cast<float>(arguments.edge_width_px);
    options.edge_color = *color;
    options.antialias_trims = arguments.antialias == "trims";
    if (edges_only && options.edges == EdgeLines::None && !options.silhouettes)
        return Error{ErrorCode::Usage, "--style", "edges-only without edges and silhouettes draws nothing"};
    return check_effects(options);
}

Result<std::optional<std::array<float, 3>>> parse_color(const std::string& option, const std::string& text,
                                                        const std::string& other)
{
    if (text == other)
        return std::optional<std::array<float, 3>>();
    const std::string hex = text == "white" ? "#ffffff" : text == "black" ? "#000000" : text;
    uint32_t rgb = 0;
    const char* const end = hex.data() + hex.size();
    if (hex.size() == 7 && hex[0] == '#')
        if (const auto parsed = std::from_chars(hex.data() + 1, end, rgb, 16);
            parsed.ec == std::errc() && parsed.ptr == end)
            return std::optional(std::array<float, 3>{srgb_to_linear(static_cast<float>(rgb >> 16) / 255.0f),
                                                      srgb_to_linear(static_cast<float>(rgb >> 8 & 0xff) / 255.0f),
                                                      srgb_to_linear(static_cast<float>(rgb & 0xff) / 255.0f)});
    return Error{ErrorCode::Usage, option,
                 fmt::format("expected {}, white, black or #rrggbb, found '{}'", other, text)};
}

} // namespace trimray
