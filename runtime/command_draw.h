// The options that say what is drawn: lines, lights, shadows, materials, placements, maps,
// sections. Each is a key of a scene file
// too (SCENE.md); both are read by the same code.
#pragma once

#include "format/result.h"
#include "runtime/scene_request.h"

#include <deque>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace trimray {

/// What is drawn, as the command line says it.
struct DrawArguments {
    struct Given {
        std::string option;
        std::vector<std::string> values; // empty: not given
    };
    std::deque<Given> given; // in the order of the help
    std::optional<bool> silhouettes;
};

/// Adds the options to a command; they are stored in `arguments`, which must live as long as the command.
void add_draw_options(CLI::App& command, DrawArguments& arguments);

/// Reads the options into `request`, over what a scene file put there. Fails: Usage.
Status read_drawing(const DrawArguments& arguments, SceneRequest& request);

} // namespace trimray
