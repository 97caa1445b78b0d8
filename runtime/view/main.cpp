// trimray-view: the viewer's window and its loop. `trimray view` runs it.
#include "format/command_report.h"
#include "format/pack_writer.h"
#include "runtime/command_draw.h"
#include "runtime/command_json.h"
#include "runtime/command_trace.h"
#include "runtime/command_views.h"
#include "runtime/image_io.h"
#include "runtime/view/interface.h"
#include "runtime/view/script.h"
#include "runtime/view/settings.h"
#include "runtime/view/user_folders.h"
#include "runtime/view/viewer.h"
#include "runtime/view/window.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace {
using namespace trimray;
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr const char* kProgram = "trimray-view";

struct Options {
    std::vector<std::string> files;
    std::string device = "auto", trim = "auto", closest = "certified", navigation, size, scene;
    std::string record, play, screenshots = ".", state;
    ViewArguments view;
    DrawArguments draw;
    double error_px = RenderOptions{}.error_px;
    uint32_t threads = 0;
    bool plain = false, json = false, no_state = false;
};

/// Nothing: help was asked for and given. Fails: Usage.
Result<std::optional<Options>> parse_options(int argc, char** argv)
{
    static Options options; // the parser keeps addresses of its fields
    CLI::App app{"Look at packs (.tray), STEP and IGES models", "trimray view"};
    app.add_option("FILE", options.files, "Packs, or models to convert first; without any, drop some into the window");
    app.add_option("--device", options.device, "auto, cpu or vulkan")->capture_default_str();
    app.add_option("--trim", options.trim, "auto, exact, hybrid, sdf or kd")->capture_default_str();
    app.add_option("--closest", options.closest, "certified or stochastic")->capture_default_str();
    app.add_option("--error-px", options.error_px, "The error allowed, in pixels")->capture_default_str();
    app.add_option("--threads", options.threads, "Bounds the processor's threads; 0: all")->capture_default_str();
    app.add_option("--size", options.size, "Of the window, WIDTHxHEIGHT; else as it was last, or 1280x800");
    app.add_option("--navigation", options.navigation,
                   "Mouse and keys as in: f3d, cad or blender; else as they were last, or f3d");
    app.add_option("--scene", options.scene, "A scene file: its first camera, its lights, materials and effects");
    app.add_flag("--plain", options.plain, "Begin without lines and with one sample a pixel, as render does");
    app.add_option("--screenshots", options.screenshots, "The folder that F12 saves pictures to")
        ->capture_default_str();
    app.add_option("--record", options.record, "Write what is done to a file");
    app.add_option("--play", options.play, "Do what such a file says, then close");
    app.add_option("--state", options.state,
                   "The folder that settings and recent files are kept in, else the user's own; not while playing");
    app.add_flag("--no-state", options.no_state, "Begin with the defaults and keep nothing");
    app.add_flag("--json", options.json, "Report at the end as one JSON object");
    add_view_options(app, options.view);
    add_draw_options(app, options.draw);
    app.footer("H shows what keys and mouse do.\n\n"
               "Examples:\n"
               "  trimray view model.tray\n"
               "  trimray view model.step --view top --edges all\n"
               "  trimray view *.tray --navigation blender");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) { // --help
            app.exit(error);
            return std::optional<Options>();
        }
        return Error{ErrorCode::Usage, "", fmt::format("{}; see 'trimray view --help'", error.what())};
    }
    return std::optional(options);
}

/// Whether the command line leaves it to the settings how things are drawn.
bool keeps_look(const Options& options)
{
    return !options.plain && options.scene.empty();
}

/// Settings of the run before, and where this one's go.
struct Kept {
    std::string folder; // empty: nowhere
    ViewerSettings settings;
};

/// Fails: as user_folder, read_settings.
Result<Kept> read_kept(const Options& options)
{
    Kept kept;
    if (options.no_state || (options.state.empty() && !options.play.empty()))
        return kept; // a recording is the same wherever it is played
    kept.folder = options.state;
    if (kept.folder.empty()) {
        const Result<std::string> folder = user_folder(UserFolder::State);
        if (!folder.ok())
            return folder.error();
        kept.folder = *folder;
    }
    Result<ViewerSettings> settings = read_settings(kept.folder);
    if (!settings.ok())
        return settings.error();
    kept.settings = std::move(*settings);
    return kept;
}

/// Fails: as write_settings.
Status keep(const Options& options, Kept kept, const Viewer& viewer, const Window& window)
{
    if (kept.folder.empty())
        return Done{};
    kept.settings.navigation = viewer.preset().name;
    kept.settings.unit = viewer.unit;
    kept.settings.panels = viewer.panels;
    if (options.size.empty())
        kept.settings.window = {uint32_t(std::lround(float(window.width()) / window.scale())),
                                uint32_t(std::lround(float(window.height()) / window.scale()))};
    if (keeps_look(options))
        kept.settings.look = viewer.state().look;
    return write_settings(kept.folder, kept.settings);
}

/// What the command line says of the picture. Fails: Usage; as read_scene_file.
Result<Viewer::Start> understand(const Options& options, const Kept& kept)
{
    for (const auto& [choice, value] :
         {std::pair{&device_choice(), &options.device}, std::pair{&trim_choice(), &options.trim},
          std::pair{&closest_choice(), &options.closest}})
        if (const Status known = check_choice(*choice, *value); !known.ok())
            return known.error();
    Viewer::Start start;
    start.preset = find_preset(options.navigation.empty() ? kept.settings.navigation : options.navigation);
    if (!start.preset)
        return Error{ErrorCode::Usage, "--navigation",
                     fmt::format("expected f3d, cad or blender, found '{}'", options.navigation)};
    if (options.view.several())
        return Error{ErrorCode::Usage, "--turntable", "makes pictures: use 'trimray render'"};
    if (!(options.error_px > 0 && options.error_px <= 1))
        return Error{ErrorCode::Usage, "--error-px",
                     fmt::format("expected a part of a pixel in (0, 1], found {}", options.error_px)};
    if (!options.plain)
        start.state.look = default_look();
    if (keeps_look(options) && kept.settings.look)
        take_kept_look(*kept.settings.look, start.state.look);
    if (!options.scene.empty()) {
        Result<SceneRequest> scene = read_scene_file(options.scene);
        if (!scene.ok())
            return scene.error();
        start.state.look = std::move(*scene);
    }
    if (const Status drawn = read_drawing(options.draw, start.state.look); !drawn.ok())
        return drawn.error();
    Result<std::vector<SceneCamera>> cameras = cameras_asked(options.view, std::exchange(start.state.look.cameras, {}));
    if (!cameras.ok())
        return cameras.error();
    start.camera = cameras->front();
    if (start.state.look.environment) {
        Result<Environment> environment = read_environment(*start.state.look.environment);
        if (!environment.ok())
            return environment.error();
        start.state.environment = std::make_shared<Environment>(std::move(*environment));
    }
    start.state.trim = trim_mode(options.trim);
    start.state.closest = closest_policy(options.closest);
    start.state.error_px = static_cast<float>(options.error_px);
    start.state.threads = options.threads;
    start.files = options.files;
    start.screenshot_folder = options.screenshots;
    start.state_folder = kept.folder;
    start.make_tracer = [device = options.device](const std::shared_ptr<const Scene>& scene, std::string& note) {
        return make_tracer(scene, device, note);
    };
    start.wake = Window::wake;
    return start;
}

Json report_of(Viewer& viewer)
{
    Json report;
    report["files"] = viewer.files();
    if (const LoadedModel* model = viewer.model()) {
        report["file"] = model->file;
        report["pack"] = model->pack;
        report["device"] = model->tracer->device_name();
        report["faces"] = viewer.image().faces.size();
        report["placements"] = viewer.image().instances.size();
        report["convert_seconds"] = model->convert_seconds;
        report["load_seconds"] = model->load_seconds;
    }
    if (const std::optional<Error>& failure = viewer.failure())
        report["error"] = {{"where", failure->where}, {"detail", failure->detail}};
    if (const ShownPicture* shown = viewer.shown())
        report["picture"] = {{"width", shown->full_width},          {"height", shown->full_height},
                             {"traced_width", shown->traced.width}, {"samples", shown->samples},
                             {"complete", shown->complete},         {"ms", shown->ms}};
    const Camera& camera = viewer.state().camera;
    report["camera"] = {{"eye", camera.eye},
                        {"target", camera.target},
                        {"up", camera.up},
                        {"fov_deg", camera.fov_deg},
                        {"height_mm", camera.orthographic_mm}};
    if (const Selection& selection = viewer.selection(); !selection.empty()) {
        report["selection"]["placements"] = selection.placements;
        if (selection.placements.size() == 1)
            report["selection"]["instance"] = selection.placements.front();
        if (selection.face)
            report["selection"]["face"] = *selection.face;
        if (selection.place) {
            report["selection"]["point"] = selection.place->point_mm;
            report["selection"]["uv"] = selection.place->uv;
        }
    }
    if (!viewer.state().look.look.section.planes.empty()) {
        for (const SectionPlane& plane : viewer.state().look.look.section.planes)
            report["section"]["planes"].push_back({{"point", plane.point_mm}, {"normal", plane.normal}});
        const PictureRect& rect = viewer.picture_rect();
        for (const SectionHandle& handle : viewer.section_handles())
            report["section"]["handles"].push_back(
                {{"plane", handle.plane},
                 {"middle", {handle.middle_px[0] + rect.x, handle.middle_px[1] + rect.y}},
                 {"ball", {handle.tip_px[0] + rect.x, handle.tip_px[1] + rect.y}}});
    }
    report["hidden"] = viewer.hidden_count();
    if (const std::optional<SurfaceFacts>& facts = viewer.measured().last) {
        report["selection"]["kind"] = facts->kind_name;
        if (facts->radius_mm)
            report["selection"]["radius_mm"] = *facts->radius_mm;
        Json& measures = report["measures"] = Json::array();
        std::vector<Dimension> dimensions = dimensions_of(*facts);
        const auto add = [&](const std::vector<Dimension>& more) {
            dimensions.insert(dimensions.end(), more.begin(), more.end());
        };
        if (viewer.measured().edge)
            add(dimensions_of(viewer.measured().edge->facts));
        if (viewer.measured().before)
            add(dimensions_between(*viewer.measured().before, *facts));
        for (const Dimension& dimension : dimensions)
            measures.push_back({{"name", name_of(dimension.kind)}, {"value", dimension.value}});
    }
    if (const auto& costs = viewer.effect_costs()) {
        report["effects"] = {{"picture_ms", costs->found.picture_ms}, {"of_this_view", viewer.is_of_this_view(*costs)}};
        for (const EffectCost& effect : costs->found.effects)
            if (effect.ms)
                report["effects"]["ms"][effect.name] = *effect.ms;
    }
    if (const auto& curve = viewer.accuracy_curve()) {
        report["accuracy"] = {{"in_double", curve->found.in_double}, {"complete", curve->complete}};
        for (const CurvePoint& point : curve->found.points)
            report["accuracy"]["points"].push_back(
                {{"name", point.name}, {"ms", point.ms}, {"wrong", point.errors.wrong}, {"pareto", point.pareto}});
    }
    if (const ErrorMask* errors = viewer.errors())
        report["errors"] = {{"pixels", errors->pixels},
                            {"wrong", errors->wrong},
                            {"other_face", errors->other_face},
                            {"open", errors->open}};
    Json toasts = Json::array();
    for (const Toast& toast : viewer.toasts())
        toasts.push_back(toast.text);
    report["messages"] = toasts;
    report["preset"] = viewer.preset().name;
    return report;
}

/// When things were seen first, seconds since the start.
struct Milestones {
    Clock::time_point start = Clock::now();
    std::optional<double> window, proxy, first_picture, complete_picture;
    void reach(std::optional<double>& milestone)
    {
        if (!milestone)
            milestone = std::chrono::duration<double>(Clock::now() - start).count();
    }
};

Status write_text(const std::string& file, const std::string& text)
{
    const auto bytes = std::as_bytes(std::span(text));
    return write_file_atomically(file, {bytes.begin(), bytes.end()}, Durability::Unsynced);
}

/// The window's loop: events in, pictures out, asleep when nothing changes.
class Loop {
public:
    Loop(Window& window, Viewer& viewer, std::deque<ScriptStep> script, bool plays, std::optional<Recorder> recorder,
         Milestones milestones)
        : window_(window), viewer_(viewer), interface_(window.scale()), script_(std::move(script)), plays_(plays),
          recorder_(std::move(recorder)), milestones_(milestones)
    {
    }

    /// Fails: what a recording wants and cannot have.
    Status run()
    {
        while (!viewer_.wants_quit()) {
            const auto now = Clock::now();
            window_.wait(wait_seconds(now));
            std::vector<InputEvent> events = window_.take_events();
            if (plays_) {
                std::erase_if(events, [](const InputEvent& event) {
                    return event.kind != InputEvent::Kind::Resize && event.kind != InputEvent::Kind::Close;
                });
                if (const Status stepped = step(events); !stepped.ok())
                    return stepped;
            }
            frame(events);
        }
        return Done{};
    }
    Json report() const
    {
        Json report = report_of(viewer_);
        for (const auto& [name, seconds] :
             {std::pair{"window", milestones_.window}, std::pair{"proxy", milestones_.proxy},
              std::pair{"first_picture", milestones_.first_picture},
              std::pair{"complete_picture", milestones_.complete_picture}})
            if (seconds)
                report["seconds"][name] = *seconds;
        report["presented_by"] = window_.driver();
        report["frames"] = frames_;
        report["cpu_seconds"] = double(std::clock()) / CLOCKS_PER_SEC; // of all threads
        return report;
    }

private:
    double wait_seconds(Clock::time_point now) const
    {
        if (redraws_ > 0)
            return 0;
        double patience = viewer_.patience(now);
        if (const double drawing = interface_.proxy().patience(); drawing >= 0)
            patience = patience < 0 ? drawing : std::min(patience, drawing);
        if (!plays_)
            return patience;
        const double until_step = std::max(0.0, std::chrono::duration<double>(next_step_ - now).count());
        const bool waits = !script_.empty() && is_awaited(script_.front());
        const double wanted = waits ? patience : until_step;
        return patience < 0 ? wanted : wanted < 0 ? patience : std::min(wanted, patience);
    }

    void frame(const std::vector<InputEvent>& events)
    {
        const auto now = Clock::now();
        for (const InputEvent& event : events) {
            if (recorder_)
                recorder_->add(event);
            if (goes_to_viewer(event))
                viewer_.handle(event);
        }
        const uint64_t count = viewer_.shown_count();
        viewer_.update(now);
        // the interface settles a frame after what it is told; then nothing moves until something happens
        if (!events.empty() || viewer_.shown_count() != count)
            redraws_ = 2;
        else if (redraws_ > 0)
            --redraws_;
        if (!window_.minimised())
            show(events, now);
    }

    void show(const std::vector<InputEvent>& events, Clock::time_point now)
    {
        window_.begin_frame(events, std::chrono::duration<double>(now - last_).count());
        last_ = now;
        interface_.draw(viewer_, window_.width(), window_.height());
        window_.end_frame(wanted_pixels_);
        ++frames_;
        milestones_.reach(milestones_.window);
        if (interface_.proxy().is_drawn())
            milestones_.reach(milestones_.proxy);
        if (viewer_.shown())
            milestones_.reach(milestones_.first_picture);
        if (viewer_.shown() && viewer_.shown()->complete)
            milestones_.reach(milestones_.complete_picture);
    }

    bool goes_to_viewer(const InputEvent& event)
    {
        using Kind = InputEvent::Kind;
        switch (event.kind) {
        case Kind::Button:
            if (!event.down)
                return true; // a drag ends wherever the pointer is
            return !interface_.wants_pointer();
        case Kind::Scroll:
            return !interface_.wants_pointer();
        case Kind::Key:
        case Kind::Text:
            return !interface_.wants_keys();
        default:
            return true;
        }
    }

    /// Whether a step waits for something that is not there yet.
    bool is_awaited(const ScriptStep& step) const
    {
        if (viewer_.failure())
            return false;
        if (std::holds_alternative<WaitForProxy>(step))
            return !interface_.proxy().is_drawn() && (!viewer_.shown() || viewer_.loader().busy()) &&
                   !viewer_.at_rest();
        return std::holds_alternative<WaitForRest>(step) && !viewer_.at_rest();
    }

    /// Takes the recording's next step where its time has come; its event is added to those of the window.
    Status step(std::vector<InputEvent>& events)
    {
        const bool settles = script_.empty() || !std::holds_alternative<WaitForProxy>(script_.front());
        if ((settles && redraws_ > 0) || Clock::now() < next_step_)
            return Done{};
        if (script_.empty()) {
            if (viewer_.at_rest() || viewer_.failure())
                events.push_back({.kind = InputEvent::Kind::Close});
            return Done{};
        }
        const ScriptStep& next = script_.front();
        if (is_awaited(next))
            return Done{};
        if (std::holds_alternative<WaitForProxy>(next)) {
            script_.pop_front();
            redraws_ = 0;
            return step(events); // before a traced picture takes its place
        }
        if (const auto* wait = std::get_if<WaitSeconds>(&next))
            next_step_ = Clock::now() +
                         std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(wait->seconds));
        Status done = Done{};
        if (const auto* event = std::get_if<InputEvent>(&next)) {
            if (event->kind == InputEvent::Kind::Resize)
                window_.resize(int(event->x), int(event->y));
            else
                events.push_back(*event);
        }
        if (const auto* save = std::get_if<SaveFile>(&next))
            done = save_file(*save);
        script_.pop_front();
        redraws_ = std::max(redraws_, 2);
        return done;
    }

    Status save_file(const SaveFile& save)
    {
        using What = SaveFile::What;
        if (save.what == What::Report)
            return write_text(save.file, report().dump(1) + "\n");
        if (save.what != What::Window) {
            viewer_.save_picture(save.file, save.what == What::TransparentPicture);
            return Done{};
        }
        std::vector<unsigned char> pixels;
        wanted_pixels_ = &pixels;
        show({}, Clock::now());
        wanted_pixels_ = nullptr;
        const Picture picture{uint32_t(window_.width()), uint32_t(window_.height()), std::move(pixels)};
        const Result<std::vector<std::byte>> png = encode_png(picture);
        return png.ok() ? write_file_atomically(save.file, *png, Durability::Unsynced) : Status(png.error());
    }

    Window& window_;
    Viewer& viewer_;
    Interface interface_;
    std::deque<ScriptStep> script_;
    bool plays_;
    std::optional<Recorder> recorder_;
    Milestones milestones_;
    Clock::time_point last_ = Clock::now(), next_step_{};
    int redraws_ = 3;
    uint64_t frames_ = 0;
    std::vector<unsigned char>* wanted_pixels_ = nullptr;
};

int run(int argc, char** argv)
{
    const Milestones milestones;
    const Result<std::optional<Options>> parsed = parse_options(argc, argv);
    if (!parsed.ok())
        return report_error(parsed.error(), kProgram);
    if (!*parsed)
        return kExitOk;
    const Options& options = **parsed;
    Result<Kept> kept = read_kept(options);
    if (!kept.ok()) {
        report_note(fmt::format("{}: {}; settings are not kept", kept.error().where, kept.error().detail));
        kept = Kept{};
    }
    const Result<PictureSize> size =
        options.size.empty() ? Result<PictureSize>(kept->settings.window) : parse_size(options.size, 1);
    if (!size.ok())
        return report_error(size.error(), kProgram);
    Result<Viewer::Start> start = understand(options, *kept);
    if (!start.ok())
        return report_error(start.error(), kProgram);
    std::deque<ScriptStep> script;
    if (!options.play.empty()) {
        Result<std::deque<ScriptStep>> read = read_script(options.play);
        if (!read.ok())
            return report_error(read.error(), kProgram);
        script = std::move(*read);
    }
    std::optional<Recorder> recorder;
    if (!options.record.empty()) {
        Result<Recorder> opened = Recorder::open(options.record);
        if (!opened.ok())
            return report_error(opened.error(), kProgram);
        recorder.emplace(std::move(*opened));
    }
    const Result<std::unique_ptr<Window>> window =
        Window::open("Trimray", static_cast<int>(size->width), static_cast<int>(size->height));
    if (!window.ok())
        return report_error(window.error(), kProgram);
    Viewer viewer(std::move(*start));
    viewer.on_title = [&](const std::string& title) { (*window)->set_title(title + " - Trimray"); };
    viewer.panels = kept->settings.panels;
    viewer.unit = kept->settings.unit;
    viewer.scale = (*window)->scale();
    Loop loop(**window, viewer, std::move(script), !options.play.empty(), std::move(recorder), milestones);
    const Status ran = loop.run();
    if (const Status written = keep(options, *kept, viewer, **window); !written.ok())
        report_note(fmt::format("{}: {}; settings are not kept", written.error().where, written.error().detail));
    if (options.json)
        fmt::print("{}\n", loop.report().dump());
    if (!ran.ok())
        return report_error(ran.error(), kProgram);
    for (const std::optional<Error>& failure : {viewer.failure(), viewer.save_failure()})
        if (failure && !options.play.empty())
            return report_error(*failure, kProgram);
    return kExitOk;
}

} // namespace

int main(int argc, char** argv)
{
    try {
        return run(argc, argv);
    } catch (const std::bad_alloc&) {
        return report_error({ErrorCode::Internal, "", "out of memory; ask for a smaller window"}, kProgram);
    } catch (const std::exception& error) {
        return report_error({ErrorCode::Internal, "", error.what()}, kProgram);
    }
}
