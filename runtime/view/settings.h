// What the viewer keeps of itself between runs: how mouse and keys behave, its panels and window, and how it draws.
#pragma once

#include "format/result.h"
#include "runtime/picture_size.h"
#include "runtime/scene_request.h"
#include "runtime/view/dimensions.h"
#include "runtime/view/viewer_panels.h"

#include <optional>
#include <string>

namespace trimray {

struct ViewerSettings {
    std::string navigation = "f3d";
    LengthUnit unit = LengthUnit::Millimetre;
    ViewerPanels panels;
    PictureSize window{1280, 800};
    std::optional<SceneRequest> look; // lines, samples, shadows, occlusion; none: as the program has it
};

/// Of `folder`: settings.json, and look.json, which is a scene file. The defaults where there are none. Fails:
/// FileNotReadable, InvalidScene.
Result<ViewerSettings> read_settings(const std::string& folder);

/// Writes what differs from what is there. Of the look what suits any model: no sections, placements, maps, materials,
/// lights, backgrounds or environments. Fails: FileNotWritable.
Status write_settings(const std::string& folder, const ViewerSettings& settings);

/// Takes over from `kept` what write_settings keeps of a look; all else of `look` stays.
void take_kept_look(const SceneRequest& kept, SceneRequest& look);

} // namespace trimray
