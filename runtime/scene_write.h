// A request as the text of a scene file (SCENE.md): what read_scene reads, written back.
#pragma once

#include "runtime/scene_request.h"

#include <string>

namespace trimray {

/// JSON that read_scene, given the same `file`, reads as this request again: every number the same to the bit, keys
/// that say what is so without them left out. Not written: where a rule or camera came from, and rules that give
/// nothing. `file` is where the text will lie, which the environment's path is written relative to; empty: the working
/// folder. Domain: the request is one that read_scene may give; of colours above 5e11 the last bits may change.
std::string scene_text(const SceneRequest& request, const std::string& file = "");

} // namespace trimray
