// What a scene file and the command line together ask of a picture, before a pack is looked at. Both are read by
// read_scene, the file first: what the command line says later wins.
#pragma once

#include "format/result.h"
#include "runtime/light_view.h"
#include "runtime/scene_json.h"
#include "runtime/scene_look.h"
#include "runtime/tracer.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace trimray {

/// Where a picture is taken from. Without an eye the model is framed whole from the named view.
struct SceneCamera {
    std::string name;
    std::string view;                                     // of standard_view; empty: iso
    std::optional<std::array<double, 3>> eye, target, up; // world mm; no target: the model's middle
    std::optional<double> fov_deg;                        // vertical
    std::optional<double> height_mm;                      // of what is seen: parallel rays instead of a pinhole
    std::optional<bool> parallel;                         // with a view: parallel rays, the model framed whole
    std::string where;                                    // the file and line, or option, that says so; for errors
};

enum class ShadowKind {
    None,
    Hard, // of all lights, as if each were a point or a direction alone
    Soft, // of all lights; those without a size get one
};

struct SceneRequest {
    std::vector<SceneCamera> cameras;
    std::optional<std::string> environment; // a picture's path; relative to the working folder
    std::optional<std::array<float, 3>> background;
    std::optional<uint32_t> samples; // N x N a pixel
    bool edges_only = false;         // the style without faces' shading
    std::optional<EdgeLines> edges;  // none: as the style has it
    std::optional<bool> silhouettes; // likewise
    float edge_width_px = RenderOptions{}.edge_width_px;
    std::optional<std::array<float, 3>> edge_color;
    bool antialias_trims = false;
    std::optional<ShadowKind> shadows; // none: each light's own
    SceneLook look;                    // lights, materials, occlusion, map, section; neither background nor environment
    std::vector<std::string> rules;    // of each of look.materials: the file and line, or option, that gives it
};

constexpr uint32_t kMostSamples = 16;      // N of N x N a pixel
constexpr size_t kMostMaterialRules = 256; // with the command line's; lights: kMostLights (shaders/light_layout.h)

/// Reads what a tree says into `request`, over what is there. Lights and section planes take the place of those there,
/// materials are added behind them, cameras are added. `file` is the scene file, for errors and for relative paths;
/// empty for the command line's options. The keys: SCENE.md.
/// Fails: InvalidScene at "file:line" (key path first in `detail`), Usage at an option.
Status read_scene(const SceneNode& root, const std::string& file, SceneRequest& request);

/// The request of a scene file alone. Fails: FileNotFound, FileNotReadable, InvalidScene.
Result<SceneRequest> read_scene_file(const std::string& path);

/// The cameras of a file: those of a scene file, or of a file that is a list of cameras. Fails: as read_scene_file,
/// and if there are none.
Result<std::vector<SceneCamera>> read_cameras(const std::string& path);

/// One camera, as options say it; a target or up without an eye is for merge_camera to judge. Fails: Usage.
Result<SceneCamera> read_camera(const SceneNode& node);

/// `base` with what `over` sets in place of its own: an eye or a view replaces where it stands.
/// Fails: Usage (a target or an up, and no eye).
Result<SceneCamera> merge_camera(const SceneCamera& base, const SceneCamera& over);

/// The light where shadows are asked for and no lights are given: from the upper left, before the model, seen from the
/// front.
Light default_sun();

/// Sets what a request asks for, but for cameras, samples and the environment. `diagonal_mm` is the model's: soft
/// shadows of point lights without a size are of a radius of a fiftieth of it.
/// Fails: Usage (nothing would be drawn, or lines too wide).
Status apply_request(const SceneRequest& request, double diagonal_mm, RenderOptions& options);

} // namespace trimray
