// The options that say from where pictures are taken: one camera, those of a file, or a turn around the model; and what
// the files of several pictures are called.
#pragma once

#include "format/pack_image.h"
#include "format/result.h"
#include "runtime/camera.h"
#include "runtime/placement_view.h"
#include "runtime/scene_request.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace trimray {

struct ViewArguments {
    std::string view, eye, target, up, fov, ortho; // empty: not given
    std::string camera;                            // a name among the scene file's; empty: its first
    std::string frames_from;
    std::optional<uint32_t> turntable;
    bool several() const { return !frames_from.empty() || turntable; }
};

/// Adds the options to a command; they are stored in `arguments`, which must live as long as the command.
void add_view_options(CLI::App& command, ViewArguments& arguments);

/// The cameras that are asked for, at least one: of --frames-from all, else one of `scene_cameras` (the scene file's),
/// else the model from iso; what options say wins. Fails: Usage; as read_cameras.
Result<std::vector<SceneCamera>> cameras_asked(const ViewArguments& arguments,
                                               const std::vector<SceneCamera>& scene_cameras);

/// The same, resolved for what is placed of a pack; with a turntable, its steps. A model that is framed whole is so at
/// every step. Fails: as camera_of.
Result<std::vector<Camera>> cameras_for(const ViewArguments& arguments, const std::vector<SceneCamera>& asked,
                                        const PackImage& image, const PlacementView& placed, uint32_t width,
                                        uint32_t height);

/// The names of `count` pictures: `output` with its one %d or %0Nd replaced by 1, 2, ..., or with _1, _2, ... (as many
/// digits for all) before its ending. Fails: Usage (another or a second %).
Result<std::vector<std::string>> picture_names(const std::string& output, size_t count);

} // namespace trimray
