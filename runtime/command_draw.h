// The options that say what is drawn over the surfaces of a picture: edges, silhouettes, anti-aliased borders.
#pragma once

#include "format/result.h"
#include "runtime/tracer.h"

#include <array>
#include <optional>
#include <string>

namespace CLI {
class App;
}

namespace trimray {

/// What is drawn, as the command line says it.
struct DrawArguments {
    std::optional<std::string> edges; // none: as the style has it
    std::optional<bool> silhouettes;  // none: as the style has it
    std::string style = "shaded", edge_color = "auto", antialias = "none";
    double edge_width_px = static_cast<double>(RenderOptions{}.edge_width_px);
};

/// Adds the options to a command; they are stored in `arguments`, which must live as long as the command.
void add_draw_options(CLI::App& command, DrawArguments& arguments);

/// Sets what is drawn. The style edges-only draws sharp edges and silhouettes where nothing else is said.
/// Fails: Usage.
Status set_drawing(const DrawArguments& arguments, RenderOptions& options);

/// "white", "black" or "#rrggbb" (sRGB) as linear light; nothing where `text` is `other`. Fails: Usage.
Result<std::optional<std::array<float, 3>>> parse_color(const std::string& option, const std::string& text,
                                                        const std::string& other);

} // namespace trimray
