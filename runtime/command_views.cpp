#include "runtime/command_views.h"

#include "runtime/command_trace.h"
#include "runtime/nearest_word.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <utility>

namespace trimray {
namespace {

using Vec3 = std::array<double, 3>;

constexpr uint32_t kMostSteps = 100000;

/// The camera fields that the command line gives. Fails: Usage.
Result<SceneCamera> given_camera(const ViewArguments& arguments)
{
    SceneNode node;
    node.kind = SceneNode::Kind::Object;
    for (const auto& [option, key, text] :
         {std::tuple{"--view", "view", &arguments.view}, std::tuple{"--eye", "eye", &arguments.eye},
          std::tuple{"--target", "target", &arguments.target}, std::tuple{"--up", "up", &arguments.up},
          std::tuple{"--fov", "fov_deg", &arguments.fov}}) {
        if (text->empty())
            continue;
        set_node(node, key, words_node(option, *text));
        node.option = option; // what is said of the camera as a whole is said of its last option,
    }
    if (!arguments.eye.empty())
        node.option = "--eye"; // or its most telling one
    if (!arguments.ortho.empty()) {
        const bool fit = arguments.ortho == "fit";
        set_node(node, fit ? "parallel" : "height_mm", words_node("--ortho", fit ? "true" : arguments.ortho));
        node.option = "--ortho";
    }
    return read_camera(node);
}

/// The scene's camera of a name, or its first, or none in particular. Fails: Usage.
Result<SceneCamera> base_camera(const std::string& name, const std::vector<SceneCamera>& cameras)
{
    if (name.empty())
        return cameras.empty() ? SceneCamera{} : cameras.front();
    std::vector<std::string> names;
    for (const SceneCamera& camera : cameras) {
        if (camera.name == name)
            return camera;
        names.push_back(camera.name);
    }
    return Error{ErrorCode::Usage, "--camera",
                 cameras.empty() ? "there is no scene file with cameras"
                                 : fmt::format("no camera '{}' in the scene file{}", name, did_you_mean(name, names))};
}

/// v turned by `angle` around a unit axis (Rodrigues).
Vec3 turned(const Vec3& v, const Vec3& axis, double angle)
{
    const double c = std::cos(angle), s = std::sin(angle);
    const double along = (1 - c) * (axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2]);
    return {c * v[0] + s * (axis[1] * v[2] - axis[2] * v[1]) + along * axis[0],
            c * v[1] + s * (axis[2] * v[0] - axis[0] * v[2]) + along * axis[1],
            c * v[2] + s * (axis[0] * v[1] - axis[1] * v[0]) + along * axis[2]};
}

Vec3 unit(const Vec3& v)
{
    const double length = std::hypot(v[0], v[1], v[2]);
    return {v[0] / length, v[1] / length, v[2] / length};
}

double step_angle(uint32_t step, uint32_t steps)
{
    return 2 * std::numbers::pi * step / steps;
}

/// The cameras of a turn around the axis through the model's middle, counter-clockwise seen from its end.
Result<std::vector<Camera>> turn_around(const SceneCamera& asked, const PackImage& image, const PlacementView& placed,
                                        uint32_t steps, uint32_t width, uint32_t height)
{
    const Vec3 axis = unit(asked.up.value_or(Vec3{0, 0, 1}));
    Vec3 middle;
    for (size_t i = 0; i < 3; ++i)
        middle[i] = 0.5 * (placed.bounds_lo_mm[i] + placed.bounds_hi_mm[i]);
    // to be framed whole at every step is what the model is at all angles at once: a point p turned by R about the
    // middle m reaches (R (p - m) + m) . d = p . R'd + m . (d - R'd)
    const Reach reach = model_reach(image, placed);
    const Reach of_all = [&](const Vec3& d) {
        double largest = -std::numeric_limits<double>::infinity();
        for (uint32_t step = 0; step < steps; ++step) {
            const Vec3 back = turned(d, axis, -step_angle(step, steps));
            double shift = 0;
            for (size_t i = 0; i < 3; ++i)
                shift += middle[i] * (d[i] - back[i]);
            largest = std::max(largest, reach(back) + shift);
        }
        return largest;
    };
    const Result<Camera> first = camera_of(asked, placed, of_all, width, height);
    if (!first.ok())
        return first.error();
    std::vector<Camera> cameras;
    for (uint32_t step = 0; step < steps; ++step) {
        const double angle = step_angle(step, steps);
        const auto around_middle = [&](const Vec3& p) {
            Vec3 out = turned({p[0] - middle[0], p[1] - middle[1], p[2] - middle[2]}, axis, angle);
            for (size_t i = 0; i < 3; ++i)
                out[i] += middle[i];
            return out;
        };
        Camera camera = *first;
        if (step > 0) { // the first stays as it is, bit by bit
            camera.eye = around_middle(first->eye);
            camera.target = around_middle(first->target);
            camera.up = turned(first->up, axis, angle);
        }
        cameras.push_back(camera);
    }
    return cameras;
}

} // namespace

void add_view_options(CLI::App& command, ViewArguments& arguments)
{
    constexpr const char* kCamera = "Camera";
    auto* view = command.add_option("--view", arguments.view,
                                    "iso, front, back, left, right, top or bottom: the model framed whole [iso]");
    auto* eye = command.add_option("--eye", arguments.eye, "x,y,z in mm; the picture is taken from there");
    auto* target = command.add_option("--target", arguments.target, "x,y,z in mm [the middle of the model]");
    auto* up = command.add_option("--up", arguments.up, "x,y,z [0,0,1]");
    auto* fov = command.add_option("--fov", arguments.fov, "Vertical field of view in degrees [35]");
    auto* ortho = command.add_option("--ortho", arguments.ortho,
                                     "Parallel rays: HEIGHT in mm of what is seen; with a view also fit: framed whole");
    auto* camera = command.add_option("--camera", arguments.camera, "The scene file's camera of this name [its first]");
    auto* frames = command.add_option("--frames-from", arguments.frames_from,
                                      "Pictures from all cameras of a file: a JSON list of cameras, or a scene file");
    auto* turntable =
        command
            .add_option("--turntable", arguments.turntable,
                        "N pictures around the model's middle, counter-clockwise around z, or around --up")
            ->check(CLI::Range(1u, kMostSteps));
    view->excludes(eye);
    view->excludes(target);
    view->excludes(up);
    for (CLI::Option* const other : {view, eye, target, up, camera, turntable})
        frames->excludes(other);
    for (CLI::Option* const option : {view, eye, target, up, fov, ortho, camera, frames, turntable})
        option->group(kCamera);
}

Result<std::vector<SceneCamera>> cameras_asked(const ViewArguments& arguments,
                                               const std::vector<SceneCamera>& scene_cameras)
{
    const Result<SceneCamera> given = given_camera(arguments);
    if (!given.ok())
        return given.error();
    std::vector<SceneCamera> cameras;
    if (!arguments.frames_from.empty()) {
        Result<std::vector<SceneCamera>> read = read_cameras(arguments.frames_from);
        if (!read.ok())
            return read.error();
        cameras = std::move(*read);
    } else {
        const Result<SceneCamera> base = base_camera(arguments.camera, scene_cameras);
        if (!base.ok())
            return base.error();
        cameras.push_back(*base);
    }
    for (SceneCamera& camera : cameras) {
        Result<SceneCamera> merged = merge_camera(camera, *given);
        if (!merged.ok())
            return merged.error();
        camera = std::move(*merged);
    }
    return cameras;
}

Result<std::vector<Camera>> cameras_for(const ViewArguments& arguments, const std::vector<SceneCamera>& asked,
                                        const PackImage& image, const PlacementView& placed, uint32_t width,
                                        uint32_t height)
{
    if (arguments.turntable)
        return turn_around(asked.front(), image, placed, *arguments.turntable, width, height);
    std::vector<Camera> cameras;
    for (const SceneCamera& camera : asked) {
        const Result<Camera> resolved = camera_of(camera, placed, model_reach(image, placed), width, height);
        if (!resolved.ok())
            return resolved.error();
        cameras.push_back(*resolved);
    }
    return cameras;
}

Result<std::vector<std::string>> picture_names(const std::string& output, size_t count)
{
    const std::filesystem::path path(output);
    const std::string file = path.filename().string();
    std::string before = path.stem().string() + "_", after = path.extension().string();
    size_t digits = fmt::format("{}", count).size();
    if (const size_t percent = file.find('%'); percent != file.npos) {
        size_t end = percent + 1;
        digits = 1;
        if (end < file.size() && file[end] == '0') {
            const auto width = std::from_chars(file.data() + end, file.data() + file.size(), digits);
            end = size_t(width.ptr - file.data());
        }
        if (end == file.size() || file[end] != 'd' || digits > 9 || file.find('%', end) != file.npos)
            return Error{ErrorCode::Usage, "-o",
                         fmt::format("expected one %d or %0Nd for the number, found '{}'", file)};
        before = file.substr(0, percent);
        after = file.substr(end + 1);
    }
    std::vector<std::string> names;
    for (size_t i = 1; i <= count; ++i)
        names.push_back((path.parent_path() / fmt::format("{}{:0{}}{}", before, i, digits, after)).string());
    return names;
}

} // namespace trimray
