#include "runtime/view/viewer.h"

#include "format/pack_writer.h"
#include "runtime/camera_frame.h"
#include "runtime/command_trace.h"
#include "runtime/command_views.h"
#include "runtime/image_io.h"
#include "runtime/scene_write.h"
#include "runtime/trim_mode.h"
#include "runtime/view/folder_models.h"
#include "runtime/view/recent_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <tuple>
#include <utility>

namespace trimray {
namespace {
namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr auto kStillAfter = 150ms;  // without a move, a view rests
constexpr auto kDoubleClick = 350ms; // at most between two clicks
constexpr uint32_t kTurnSteps = 36;
constexpr double kClickPixels = 4;        // that the pointer may move in a click
constexpr double kZoomStep = 1.0 / 1.2;   // of distances, a step of the wheel
constexpr double kZoomDragPixels = 150.0; // of a drag that makes distances e times as long

/// The next of `values` after `now`, or the first.
template <class T, size_t N>
T next_of(const std::array<T, N>& values, const T& now)
{
    const auto at = std::find(values.begin(), values.end(), now);
    return at == values.end() || at + 1 == values.end() ? values.front() : *(at + 1);
}

const char* view_of(Action action)
{
    switch (action) {
    case Action::ViewFront:
        return "front";
    case Action::ViewBack:
        return "back";
    case Action::ViewLeft:
        return "left";
    case Action::ViewRight:
        return "right";
    case Action::ViewTop:
        return "top";
    case Action::ViewBottom:
        return "bottom";
    default:
        return "iso";
    }
}

reference::Vec3 to_vector(const std::array<double, 3>& v)
{
    return {v[0], v[1], v[2]};
}

/// The camera with its target, about which it turns, in the depth of the middle of what it shows.
Camera turning_about_middle(Camera camera, const Reach& reach)
{
    using namespace camera_math;
    const Vec3 forward = camera_axes(camera).forward;
    const double middle = 0.5 * (reach(forward) - reach(forward * -1)), way = middle - dot(camera.eye, forward);
    if (way > 0)
        camera.target = camera.eye + forward * way;
    return camera;
}

/// "folder/name1", or with the first number of which there is no file yet with this ending.
std::string free_stem(const std::string& folder, const std::string& name, const std::string& ending)
{
    for (int number = 1;; ++number) {
        const std::string stem = (fs::path(folder) / fmt::format("{}{}", name, number)).string();
        std::error_code unknown; // writing it says so
        if (!fs::exists(stem + ending, unknown))
            return stem;
    }
}

bool same(const Camera& a, const Camera& b)
{
    return std::tie(a.eye, a.target, a.up, a.fov_deg, a.orthographic_mm) ==
           std::tie(b.eye, b.target, b.up, b.fov_deg, b.orthographic_mm);
}

} // namespace

Viewer::Viewer(Start start)
    : state_(std::move(start.state)), preset_(start.preset ? start.preset : &presets().front()),
      turning_(preset_->turning), wake_(std::move(start.wake)), screenshot_folder_(std::move(start.screenshot_folder)),
      recent_list_(start.state_folder.empty() ? "" : start.state_folder + "/recent.json"),
      first_camera_(std::move(start.camera)), watch_(wake_), loader_(std::move(start.make_tracer), wake_),
      pictures_(wake_), study_(wake_)
{
    if (!start.files.empty())
        open(std::move(start.files));
}

// ---- files ---------------------------------------------------------------------------------------------------------

void Viewer::open(std::vector<std::string> files, size_t index)
{
    if (files.empty())
        return;
    if (files.size() == 1 && files[0].ends_with(".json"))
        return apply_scene(files[0]);
    files_ = std::move(files);
    file_index_ = index;
    keeps_view_ = remade_ = false;
    begin_load();
}

void Viewer::step_file(int step)
{
    if (files_.empty())
        return tell("there is no file yet: drop one, or press " + chords_of(*preset_, Action::OpenFile));
    if (files_.size() == 1) { // then those beside it are meant
        const std::string file = files_[0];
        files_ = models_beside(file);
        file_index_ = size_t(std::find(files_.begin(), files_.end(), file) - files_.begin()) % files_.size();
    }
    if (files_.size() < 2)
        return tell("there is no other model in the folder");
    file_index_ = (file_index_ + (step > 0 ? 1 : files_.size() - 1)) % files_.size();
    keeps_view_ = remade_ = false;
    begin_load();
}

// Written anew, it is read again.
void Viewer::follow_file()
{
    if (loader_.busy() || series_ || !watch_.take_change())
        return;
    tell("the file was written anew: reading it again");
    keeps_view_ = true;
    begin_load();
}

void Viewer::begin_load()
{
    failure_.reset();
    return_to_model();
    end_series("the turn is given up: another file is opened", true);
    if (const Status watched = watch_.watch(files_[file_index_]); !watched.ok())
        tell(fmt::format("{}: {}", watched.error().where, watched.error().detail));
    loader_.start(files_[file_index_]);
    if (on_title)
        on_title(fs::path(files_[file_index_]).filename().string());
}

void Viewer::cancel_load()
{
    loader_.cancel();
    return_to_model();
    if (!model_)
        failure_ = Error{ErrorCode::Interrupted, files_.empty() ? "" : files_[file_index_], "opening was cancelled"};
    else
        tell("cancelled");
}

// The view at hand is that of the model again, which another file was to replace.
void Viewer::return_to_model()
{
    reloaded_early_.reset();
    if (!before_)
        return;
    state_.camera = before_->camera;
    state_.look.look.arrangement = before_->arrangement;
    framing_ = std::move(before_->framing);
    framed_ = before_->framed;
    before_.reset();
    early_.reset();
    forget_pictures();
    dirty_ = true;
}

void Viewer::forget_pictures()
{
    shown_.reset();
    hits_.reset();
    set_selection({});
    ++shown_count_;
    arrangement_ = {};
    ++arrangement_count_;
    measured_ = {};
}

void Viewer::take_first_view()
{
    SceneCamera asked = std::exchange(first_camera_, std::nullopt).value_or(SceneCamera{});
    if (!asked.eye && state_.camera.orthographic_mm > 0)
        asked.parallel = true;
    const auto camera = [this, asked] {
        return camera_of(asked, placed(), visible_reach(), size().width, size().height);
    };
    const Result<Camera> first = camera();
    framing_ = nullptr;
    if (!first.ok())
        tell(first.error().detail, true);
    else if (asked.eye)
        state_.camera = *first;
    else
        look_framed([this, camera] { return turning_about_middle(*camera(), visible_reach()); });
}

void Viewer::take_early()
{
    if (!has_rect_)
        return; // as of a model
    std::shared_ptr<const EarlyModel> early = loader_.take_early();
    if (!early)
        return;
    if (loader_.busy() && keeps_view_ && model_) {
        reloaded_early_ = std::move(early); // what is there stays until the model is
        return;
    }
    early_ = std::move(early);
    ++shown_count_;
    if (!loader_.busy())
        return; // the model is there, its first picture not yet
    pictures_.cancel();
    forget_pictures();
    before_ = {state_.camera, state_.look.look.arrangement, std::move(framing_), framed_};
    if (model_)
        state_.look.look.arrangement = {}; // its names were the other model's
    take_first_view();
}

void Viewer::take_model()
{
    if (!has_rect_)
        return; // the first view is framed for the window as it is
    std::optional<Result<LoadedModel>> done = loader_.take();
    if (!done)
        return;
    if (!done->ok()) {
        const Error& error = done->error();
        return_to_model();
        tell(fmt::format("{}: {}", error.where, error.detail), true);
        if (!model_ || model_->file != files_[file_index_])
            failure_ = error;
        return;
    }
    const bool keeps_view = keeps_view_ && model_;
    const bool was_early = before_.has_value();
    before_.reset();
    if (!was_early)
        early_ = std::exchange(reloaded_early_, nullptr);
    forget_studies();
    pictures_.finish(); // the old tracer is let go before its scene
    forget_pictures();
    tree_.reset();
    if (model_ && !keeps_view && !was_early)
        state_.look.look.arrangement = {}; // its names were the other model's
    model_ = std::move(**done);
    tree_ = std::make_unique<ModelTree>(image());
    ++model_count_;
    for (const std::string& note : model_->notes)
        tell(note);
    if (!recent_list_.empty())
        if (const Status kept = remember_file(recent_list_, {model_->file, model_->pack}); !kept.ok())
            tell(fmt::format("{}: {}", kept.error().where, kept.error().detail), true);
    if (!keeps_view && !was_early)
        take_first_view();
    dirty_ = true;
}

// ---- pictures ------------------------------------------------------------------------------------------------------

void Viewer::set_picture_rect(const PictureRect& rect)
{
    const bool same_size = rect.width == rect_.width && rect.height == rect_.height;
    rect_ = {rect.x, rect.y, std::max(rect.width, 1), std::max(rect.height, 1)};
    has_rect_ = true;
    if (same_size)
        return;
    end_series("the turn is given up: the picture's size has changed", true);
    if (has_view() && framing_ && same(state_.camera, framed_))
        state_.camera = framed_ = framing_();
    changed(true); // a window's border being dragged is a move
}

void Viewer::changed(bool moving)
{
    dirty_ = true;
    if (moving) {
        moving_ = true;
        still_at_ = Clock::now() + kStillAfter;
    }
}

void Viewer::order(bool moving)
{
    const Result<RenderOptions> options = options_of(state_, size(), image());
    picture_failure_.reset();
    if (!options.ok()) {
        fail_picture(options.error());
        return;
    }
    ordered_ = pictures_.order({model_->tracer, *options, state_.samples(), moving});
}

// No picture will come of what is asked for: nobody is to wait for it.
void Viewer::fail_picture(const Error& error)
{
    tell(error.where.empty() ? error.detail : fmt::format("{}: {}", error.where, error.detail), true);
    picture_failure_ = error;
    if (!pending_.empty() && !save_failure_)
        save_failure_ = error;
    pending_.clear();
    end_series("the turn is given up", true);
}

void Viewer::take_picture()
{
    if (const std::optional<Error> error = pictures_.take_error()) {
        // a device that was lost is asked for once more; all that was in its memory is made anew
        if (error->code == ErrorCode::DeviceFailed && !remade_) {
            tell(fmt::format("{}: the device failed; it is started anew", error->detail), true);
            remade_ = keeps_view_ = true;
            begin_load();
            return;
        }
        fail_picture(*error);
    }
    std::optional<ShownPicture> picture = pictures_.take();
    if (!picture)
        return;
    ++shown_count_;
    if (picture->samples == 1)
        hits_ = *picture;
    shown_ = std::move(picture);
    early_.reset();
}

void Viewer::update(Clock::time_point now)
{
    follow_file();
    take_early();
    take_model();
    if (moving_ && now >= still_at_ && buttons_ == 0) {
        moving_ = false;
        dirty_ = true;
    }
    std::erase_if(toasts_, [now](const Toast& toast) { return toast.until <= now; });
    if (!model())
        return;
    take_picture();
    take_study();
    if (dirty_ && study_.busy())
        study_.cancel(); // the tracer is the picture's; this is called again as soon as it is free
    if (!study_.uses_tracer() && std::exchange(dirty_, false))
        order(moving_);
    start_study();
    write_pending();
    write_series();
}

double Viewer::patience(Clock::time_point now) const
{
    std::optional<Clock::time_point> next;
    const auto sooner = [&next](Clock::time_point at) { next = next ? std::min(*next, at) : at; };
    if (moving_ && buttons_ == 0)
        sooner(still_at_);
    for (const Toast& toast : toasts_)
        sooner(toast.until);
    if (loader_.busy())
        sooner(now + 100ms); // its bar runs
    return next ? std::max(0.001, std::chrono::duration<double>(*next - now).count()) : -1;
}

bool Viewer::at_rest() const
{
    if (!has_rect_ || loader_.busy() || moving_ || dirty_ || !pending_.empty() || series_ || study_.busy() ||
        wanted_study_)
        return false;
    return !model_ || picture_failure_ || (shown_ && shown_->complete && shown_->order == ordered_);
}

// ---- studies -------------------------------------------------------------------------------------------------------

void Viewer::study(StudyOrder::What what)
{
    if (model() && !series_)
        wanted_study_ = what;
}

void Viewer::cancel_study()
{
    wanted_study_.reset();
    study_.cancel();
}

void Viewer::show_errors(bool shown)
{
    shows_errors_ = shown;
    asked_errors_ = 0;
    if (!shown && study_.progress() && study_.progress()->what == StudyOrder::What::Errors)
        study_.cancel();
}

const ErrorMask* Viewer::errors() const
{
    return shows_errors_ && errors_ && errors_->picture == ordered_ ? &errors_->found : nullptr;
}

// What makes two pictures of one size show the same surfaces at the same pixels.
std::string Viewer::surfaces_seen() const
{
    SceneRequest seen;
    seen.cameras = {scene_camera(state_.camera)};
    seen.look.arrangement = state_.look.look.arrangement;
    seen.look.section.planes = state_.look.look.section.planes;
    return scene_text(seen);
}

void Viewer::start_study()
{
    if (!model() || study_.busy() || series_ || !shown_ || !shown_->complete || shown_->order != ordered_ || moving_ ||
        dirty_ || !pending_.empty())
        return;
    const bool wants_errors = shows_errors_ && asked_errors_ != ordered_ && hits_ && hits_->order == ordered_;
    if (!wanted_study_ && !wants_errors)
        return;
    const Result<RenderOptions> options = options_of(state_, size(), image());
    if (!options.ok())
        return;
    StudyOrder order;
    order.what = wanted_study_.value_or(StudyOrder::What::Errors);
    order.picture = ordered_;
    order.scene = model_->scene;
    order.options = *options;
    order.samples = state_.samples();
    order.view = surfaces_seen();
    if (std::exchange(wanted_study_, std::nullopt)) {
        pictures_.finish(); // it has nothing to do, and lets the tracer go
        order.tracer = model_->tracer;
    } else {
        asked_errors_ = ordered_;
        order.frame = hits_->frame;
    }
    study_.start(std::move(order));
}

void Viewer::take_study()
{
    if (const std::optional<Error> error = study_.take_error())
        tell(error->where.empty() ? error->detail : fmt::format("{}: {}", error->where, error->detail), true);
    std::optional<StudyFindings> findings = study_.take();
    if (!findings)
        return;
    ++shown_count_; // there is more to be seen
    const auto keep = [&](auto& place, auto& found) {
        place = {findings->picture, findings->complete, std::move(found)};
    };
    if (auto* const costs = std::get_if<EffectCosts>(&findings->found))
        keep(effect_costs_, *costs);
    else if (auto* const curve = std::get_if<AccuracyCurve>(&findings->found))
        keep(accuracy_curve_, *curve);
    else if (auto* const mask = std::get_if<ErrorMask>(&findings->found))
        keep(errors_, *mask);
}

// Of another model.
void Viewer::forget_studies()
{
    study_.finish();
    wanted_study_.reset();
    effect_costs_.reset();
    accuracy_curve_.reset();
    errors_.reset();
    asked_errors_ = 0;
}

void Viewer::save_picture(const std::string& file, bool transparent)
{
    if (model() && !picture_failure_)
        pending_.push_back({file, transparent});
    else if (!save_failure_)
        save_failure_ = picture_failure_
                            ? *picture_failure_
                            : Error{ErrorCode::ImageNotWritten, file, "there is no picture: no model is open"};
}

// The options of render that a scene file has no keys for, where they are not the defaults.
std::string Viewer::accuracy_options() const
{
    std::string options;
    if (state_.trim != TrimMode::Auto)
        options += fmt::format(" --trim {}", trim_name(state_.trim));
    if (state_.closest != ClosestPolicy::Certified)
        options += fmt::format(" --closest {}", closest_name(state_.closest));
    if (state_.error_px != RenderOptions{}.error_px)
        options += fmt::format(" --error-px {}", state_.error_px);
    return options;
}

void Viewer::write_pending()
{
    if (pending_.empty() || !shown_ || !shown_->complete || shown_->order != ordered_ || moving_ || dirty_)
        return;
    for (const PendingPicture& picture : std::exchange(pending_, {})) {
        ViewState state = state_;
        state.has_background = state.has_background && !picture.transparent;
        const Result<std::vector<std::byte>> png =
            encode_png(state.has_background ? shown_->colours : shown_->transparent());
        const std::string sidecar = fs::path(picture.file).replace_extension(".json").string();
        const std::string text = scene_text(scene_of(state), sidecar) + "\n";
        Status written = png.ok() ? write_file_atomically(picture.file, *png) : Status(png.error());
        if (written.ok()) {
            const auto bytes = std::as_bytes(std::span(text));
            written = write_file_atomically(sidecar, {bytes.begin(), bytes.end()});
        }
        if (!written.ok()) {
            tell(fmt::format("{}: {}", written.error().where, written.error().detail), true);
            if (!save_failure_)
                save_failure_ = written.error();
            continue;
        }
        tell(fmt::format("saved {}; the same again: trimray render {} --scene {} --size {}x{}{} -o FILE.png",
                         picture.file, model_->pack, sidecar, shown_->full_width, shown_->full_height,
                         accuracy_options()));
    }
}

void Viewer::save_turntable(uint32_t steps)
{
    if (!model() || series_)
        return;
    Series series;
    series.before = state_.camera;
    ViewArguments turn;
    turn.turntable = steps;
    const Result<std::vector<Camera>> cameras =
        cameras_for(turn, {scene_camera(state_.camera)}, image(), placed(), size().width, size().height);
    if (!cameras.ok())
        return tell(cameras.error().detail, true);
    series.cameras = *cameras;
    const std::string stem = free_stem(screenshot_folder_, fs::path(model_->file).stem().string() + "-turn-", ".json");
    series.scene = stem + ".json";
    const Result<std::vector<std::string>> files = picture_names(stem + "_%03d.png", steps);
    if (!files.ok())
        return tell(files.error().detail, true);
    series.files = *files;
    const std::string text = scene_text(scene_of(state_), series.scene) + "\n";
    const auto bytes = std::as_bytes(std::span(text));
    if (const Status written = write_file_atomically(series.scene, {bytes.begin(), bytes.end()}); !written.ok()) {
        if (!save_failure_)
            save_failure_ = written.error();
        return tell(fmt::format("{}: {}", written.error().where, written.error().detail), true);
    }
    select({});
    series_ = std::move(series);
    look_along(series_->cameras.front());
}

void Viewer::write_series()
{
    if (!series_ || !shown_ || !shown_->complete || shown_->order != ordered_ || moving_ || dirty_)
        return;
    Series& series = *series_;
    const Result<std::vector<std::byte>> png = encode_png(shown_->colours);
    const Status written = png.ok() ? write_file_atomically(series.files[series.written], *png, Durability::Unsynced)
                                    : Status(png.error());
    if (!written.ok()) {
        if (!save_failure_)
            save_failure_ = written.error();
        return end_series(fmt::format("{}: {}", written.error().where, written.error().detail), true);
    }
    if (++series.written < series.cameras.size())
        return look_along(series.cameras[series.written]);
    end_series(fmt::format("saved {} ... {}; the same again: trimray render {} --scene {} --turntable {} --size "
                           "{}x{}{} -o turn_%03d.png",
                           series.files.front(), series.files.back(), model_->pack, series.scene, series.cameras.size(),
                           shown_->full_width, shown_->full_height, accuracy_options()),
               false);
}

void Viewer::end_series(const std::string& why, bool is_error)
{
    if (!series_)
        return;
    const Camera before = series_->before;
    series_.reset();
    tell(why, is_error);
    look_along(before);
}

std::optional<std::array<size_t, 2>> Viewer::series_progress() const
{
    return series_ ? std::optional(std::array{series_->written, series_->cameras.size()}) : std::nullopt;
}

void Viewer::apply_scene(const std::string& file)
{
    Result<SceneRequest> scene = read_scene_file(file);
    if (!scene.ok())
        return tell(fmt::format("{}: {}", scene.error().where, scene.error().detail), true);
    std::shared_ptr<const Environment> environment;
    if (scene->environment) {
        Result<Environment> read = read_environment(*scene->environment);
        if (!read.ok())
            return tell(fmt::format("{}: {}", read.error().where, read.error().detail), true);
        environment = std::make_shared<Environment>(std::move(*read));
    }
    const std::vector<SceneCamera> cameras = std::exchange(scene->cameras, {});
    state_.look = std::move(*scene);
    state_.environment = std::move(environment);
    if (!has_view()) { // it is for the one that comes
        if (!cameras.empty())
            first_camera_ = cameras.front();
        return tell(fmt::format("{}: for the next model", file));
    }
    if (!cameras.empty()) {
        const Result<Camera> camera =
            camera_of(cameras.front(), placed(), visible_reach(), size().width, size().height);
        if (!camera.ok())
            return tell(fmt::format("{}: {}", file, camera.error().detail), true);
        state_.camera = *camera;
    }
    changed();
}

void Viewer::tell(std::string text, bool is_error)
{
    std::erase_if(toasts_, [&](const Toast& toast) { return toast.text == text; });
    toasts_.push_back({std::move(text), is_error, Clock::now() + (is_error ? 12s : 6s)});
}

// ---- views ---------------------------------------------------------------------------------------------------------

void Viewer::look_from(const std::string& view)
{
    if (!has_view())
        return;
    look_framed([this, view, parallel = state_.camera.orthographic_mm > 0, fov_deg = state_.camera.fov_deg] {
        const double aspect = double(rect_.width) / rect_.height;
        Camera camera;
        if (parallel)
            standard_orthographic_view(view, visible_reach(), aspect, 0, camera);
        else
            standard_view(view, visible_reach(), aspect, fov_deg, camera);
        camera.fov_deg = fov_deg; // also of parallel rays: for later
        return turning_about_middle(camera, visible_reach());
    });
}

void Viewer::look_framed(std::function<Camera()> framing)
{
    framing_ = std::move(framing);
    framed_ = framing_();
    look_along(framed_);
}

void Viewer::look_along(const Camera& camera)
{
    state_.camera = camera;
    changed();
}

// Where the look at hand puts everything. What it cannot is told by the picture that is ordered.
PlacementView Viewer::placed()
{
    if (const Result<bool> changed = arrangement_.change_to(outline(), state_.look.look.arrangement);
        changed.ok() && *changed)
        ++arrangement_count_;
    return arrangement_.view(outline());
}

size_t Viewer::hidden_count() const
{
    if (!model())
        return 0;
    const PlacementView view = arrangement_.view(image());
    return view.instances.size() - view.visible_count();
}

Reach Viewer::visible_reach()
{
    return model_reach(outline(), placed());
}

void Viewer::frame(std::function<Reach()> reach)
{
    look_framed([this, reach = std::move(reach), from = state_.camera] {
        Camera camera = from;
        frame_whole(camera, reach(), double(rect_.width) / rect_.height);
        return turning_about_middle(camera, reach());
    });
}

void Viewer::set_preset(const Preset& preset)
{
    preset_ = &preset;
    turning_ = preset.turning;
}

// ---- what lies under the pointer -----------------------------------------------------------------------------------

std::optional<PickedPoint> Viewer::pick(double x, double y) const
{
    const auto [px, py] = in_picture(x, y);
    if (!hits_ || px < 0 || py < 0 || px >= rect_.width || py >= rect_.height)
        return std::nullopt;
    const Frame& frame = hits_->frame;
    const auto column = std::min(uint32_t(px * frame.width / rect_.width), frame.width - 1),
               row = std::min(uint32_t(py * frame.height / rect_.height), frame.height - 1);
    const size_t at = size_t(row) * frame.width + column;
    if (frame.instance[at] < 0 && frame.face[at] < 0)
        return std::nullopt;
    const CameraRays rays = camera_rays(hits_->traced.camera, frame.width, frame.height);
    using namespace camera_math;
    const Vec3 along = normalised(rays.corner + rays.step_x * (column + 0.5) + rays.step_y * (row + 0.5), {0, 0, -1});
    PickedPoint picked;
    picked.face = frame.face[at];
    picked.instance = frame.instance[at];
    picked.uv = {frame.uv[2 * at], frame.uv[2 * at + 1]};
    picked.eye_mm = rays.eye;
    picked.along = along;
    double distance = frame.depth_mm[at];
    if (rays.plane_mm > 0) // depth counts from the plane, along the middle of the view
        distance += rays.plane_mm / dot(along, camera_axes(hits_->traced.camera).forward);
    picked.point_mm = rays.eye + along * distance;
    return picked;
}

std::optional<PickedPoint> Viewer::hovered() const
{
    return buttons_ == 0 ? pick(pointer_x_, pointer_y_) : std::nullopt;
}

// On the surface that is seen there now, though the picture may lag behind; else as far away as the target.
std::array<double, 3> Viewer::point_under(double x, double y) const
{
    const auto [px, py] = in_picture(x, y);
    if (!model())
        return point_at_target(state_.camera, px, py, size());
    if (state_.look.look.arrangement.any() || !state_.look.look.section.planes.empty()) { // one ray meets all there is
        if (const std::optional<PickedPoint> picked = pick(x, y))
            return picked->point_mm;
    } else {
        using namespace camera_math;
        const CameraRays rays = camera_rays(state_.camera, size().width, size().height);
        const Vec3 along = normalised(rays.corner + rays.step_x * px + rays.step_y * py, {0, 0, -1});
        const double from = rays.plane_mm > 0 ? rays.plane_mm / dot(along, camera_axes(state_.camera).forward) : 0;
        const Vec3 start = rays.eye + along * from;
        if (const RayHit hit = trace_ray(*model_->scene, start, along); hit.hit)
            return start + along * hit.distance_mm;
    }
    return point_at_target(state_.camera, px, py, size());
}

void Viewer::set_selection(Selection selection)
{
    selection_ = std::move(selection);
    ++selection_count_;
    ++shown_count_; // its overlay is another
}

void Viewer::select_at(const std::optional<PickedPoint>& picked, bool adds)
{
    const std::optional<uint32_t> placement =
        picked && picked->instance >= 0 ? std::optional(uint32_t(picked->instance)) : std::nullopt;
    if (adds) {
        if (placement)
            select({*placement}, true);
        return;
    }
    Selection selection;
    if (placement)
        selection.placements = {*placement};
    if (placement && picked->face >= 0)
        selection.face = uint32_t(picked->face);
    selection.place = picked;
    set_selection(std::move(selection));
    measured_.before = std::exchange(measured_.last, std::nullopt);
    measured_.edge.reset();
    if (!selection_.face) {
        measured_ = {};
        return;
    }
    measured_.last = surface_facts(image(), {*selection_.face,
                                             selection_.placements.front(),
                                             {picked->uv[0], picked->uv[1]},
                                             reference::Ray{to_vector(picked->eye_mm), to_vector(picked->along)}});
    measured_.edge = picked_edge(image(), *measured_.last);
}

void Viewer::select(std::vector<uint32_t> placements, bool adds)
{
    if (adds)
        placements = toggled(selection_.placements, placements);
    set_selection({.placements = std::move(placements), .face = {}, .place = {}});
    measured_ = {};
}

void Viewer::select_face(uint32_t placement, uint32_t face)
{
    set_selection({.placements = {placement}, .face = face, .place = {}});
    measured_ = {};
}

void Viewer::show(std::span<const uint32_t> placements, bool shown)
{
    set_shown(state_.look.look.arrangement, visible(), image().instances.size(), placements, shown);
    changed();
}

void Viewer::click(double x, double y, bool adds)
{
    const auto now = Clock::now();
    const bool is_double = now - last_click_ < kDoubleClick && std::hypot(x - click_x_, y - click_y_) <= kClickPixels;
    last_click_ = is_double ? Clock::time_point{} : now;
    click_x_ = x;
    click_y_ = y;
    if (is_double)
        recenter(x, y);
    else
        select_at(pick(x, y), adds);
}

// Turns go about the point from now on; it comes into the picture's middle.
void Viewer::recenter(double x, double y)
{
    const std::optional<PickedPoint> picked = pick(x, y);
    if (!picked)
        return;
    using namespace camera_math;
    Camera camera = state_.camera;
    const CameraAxes axes = camera_axes(camera);
    const Vec3 way = picked->point_mm - camera.target;
    const Vec3 across = way - axes.forward * dot(way, axes.forward);
    camera.eye = camera.eye + across; // at the same distance
    camera.target = picked->point_mm;
    look_along(camera);
}

void Viewer::zoom_at(double x, double y, double scale)
{
    zoom_point_ = point_under(x, y);
    state_.camera = zoom_about(state_.camera, zoom_point_, scale);
    changed(true);
}

// ---- events --------------------------------------------------------------------------------------------------------

void Viewer::drag_to(double x, double y)
{
    const double dx = x - pointer_x_, dy = y - pointer_y_;
    switch (drag_of(*preset_, buttons_, drag_mods_)) {
    case Drag::Orbit:
        state_.camera = orbit(state_.camera, dx, dy, size(), turning_, {0, 0, 1});
        break;
    case Drag::Pan:
        state_.camera = pan(state_.camera, dx, dy, size());
        break;
    case Drag::Zoom:
        state_.camera = zoom_about(state_.camera, zoom_point_, std::exp(dy / kZoomDragPixels));
        break;
    case Drag::None:
        return;
    }
    changed(true);
}

void Viewer::handle(const InputEvent& event)
{
    using Kind = InputEvent::Kind;
    if (series_ && (event.kind == Kind::Button || event.kind == Kind::Scroll))
        return; // the view is the turn's
    switch (event.kind) {
    case Kind::Move:
        if (buttons_ != 0 && std::hypot(event.x - press_x_, event.y - press_y_) > kClickPixels)
            dragged_ = true;
        if (buttons_ != 0 && dragged_ && has_view())
            drag_to(event.x, event.y);
        pointer_x_ = event.x;
        pointer_y_ = event.y;
        break;
    case Kind::Leave:
        pointer_x_ = pointer_y_ = -1;
        break;
    case Kind::Button:
        if (event.down) {
            if (buttons_ == 0) {
                press_x_ = pointer_x_;
                press_y_ = pointer_y_;
                dragged_ = false;
                if (has_view())
                    zoom_point_ = point_under(pointer_x_, pointer_y_);
            }
            buttons_ |= 1u << event.code;
            drag_mods_ = event.mods;
        } else if ((buttons_ & 1u << event.code) != 0) {
            buttons_ &= ~(1u << event.code);
            if (event.code == kLeftButton && !dragged_ && buttons_ == 0)
                click(pointer_x_, pointer_y_, (drag_mods_ & kModControl) != 0);
            if (dragged_)
                changed(true); // rests from now on
        }
        break;
    case Kind::Scroll:
        if (has_view() && event.y != 0)
            zoom_at(pointer_x_, pointer_y_, std::pow(kZoomStep, event.y));
        break;
    case Kind::Key:
        if (event.down)
            if (const std::optional<Action> action = action_of(*preset_, {event.code, event.mods}))
                act(*action);
        break;
    case Kind::Drop:
        open(event.paths);
        break;
    case Kind::Close:
        quits_ = true;
        break;
    case Kind::Text:
    case Kind::Resize:
        break;
    }
}

void Viewer::act(Action action)
{
    SceneRequest& look = state_.look;
    if (series_ && action == Action::Quit)
        return end_series("the turn is given up", false);
    if (series_)
        return tell("pictures of a turn are being saved; " + chords_of(*preset_, Action::Quit) + " ends that");
    switch (action) {
    case Action::Quit:
        if (panels.open) // what lies over the picture goes first
            panels.open = false;
        else if (panels.cheat_sheet)
            panels.cheat_sheet = false;
        else
            quits_ = true;
        return;
    case Action::NextFile:
        return step_file(1);
    case Action::PreviousFile:
        return step_file(-1);
    case Action::OpenFile:
        panels.open = !panels.open;
        return;
    case Action::Reload:
        if (!files_.empty()) {
            keeps_view_ = true;
            begin_load();
        }
        return;
    case Action::ToggleMenu:
        panels.menu = !panels.menu;
        return;
    case Action::ToggleTree:
        panels.tree = !panels.tree;
        return;
    case Action::Search:
        panels.tree = panels.wants_search = true;
        return;
    case Action::ToggleLook:
        panels.look = !panels.look;
        return;
    case Action::ToggleStatus:
        panels.status = !panels.status;
        return;
    case Action::ToggleCosts:
        panels.costs = !panels.costs;
        return;
    case Action::TimeEffects:
        panels.costs = true;
        return study(StudyOrder::What::Effects);
    case Action::DrawAccuracyCurve:
        panels.costs = true;
        return study(StudyOrder::What::Accuracy);
    case Action::ToggleErrors:
        panels.costs |= !shows_errors_;
        return show_errors(!shows_errors_);
    case Action::ToggleTimes:
        panels.times = !panels.times;
        return;
    case Action::ToggleCheatSheet:
        panels.cheat_sheet = !panels.cheat_sheet;
        return;
    case Action::ToggleMeasure:
        panels.measure = !panels.measure;
        return;
    case Action::ToggleTurntable:
        turning_ = turning_ == Turning::Turntable ? Turning::Free : Turning::Turntable;
        return tell(turning_ == Turning::Turntable ? "turns like a turntable" : "turns freely");
    case Action::ClearSelection:
        return select({});
    default:
        break;
    }
    if (!has_view())
        return;
    switch (action) {
    case Action::Fit:
        return frame([this] { return visible_reach(); });
    case Action::FitSelection:
        if (selection_.empty())
            return frame([this] { return visible_reach(); });
        return frame([this, fitted = selection_.placements] { return placements_reach(image(), placed(), fitted); });
    case Action::ToggleParallel:
        return look_along(state_.camera.orthographic_mm > 0 ? with_perspective(state_.camera)
                                                            : with_parallel_rays(state_.camera));
    case Action::RollLeft:
        return look_along(roll(state_.camera, -90));
    case Action::RollRight:
        return look_along(roll(state_.camera, 90));
    case Action::Screenshot:
    case Action::ScreenshotTransparent: {
        if (!model())
            return tell("there is no picture yet");
        const std::string stem = free_stem(screenshot_folder_, fs::path(model_->file).stem().string() + "-", ".png");
        return save_picture(stem + ".png", action == Action::ScreenshotTransparent);
    }
    case Action::SaveTurntable:
        return save_turntable(kTurnSteps);
    case Action::CycleEdges:
        look.edges = next_of(std::array{EdgeLines::None, EdgeLines::Sharp, EdgeLines::All},
                             look.edges.value_or(EdgeLines::None));
        break;
    case Action::ToggleSilhouettes:
        look.silhouettes = !look.silhouettes.value_or(false);
        break;
    case Action::ToggleOcclusion:
        look.look.occlusion.samples = look.look.occlusion.samples > 0 ? 0 : 16;
        break;
    case Action::ToggleShadows:
        look.shadows =
            look.shadows.value_or(ShadowKind::None) == ShadowKind::None ? ShadowKind::Hard : ShadowKind::None;
        break;
    case Action::CycleAntialias:
        look.samples = next_of(std::array<uint32_t, 3>{1, 2, 3}, state_.samples());
        break;
    case Action::ToggleXray:
        look.look.xray = look.look.xray ? std::nullopt : std::optional(0.35f);
        break;
    case Action::CycleMap:
        look.look.map.map = next_of(std::array{SurfaceMap::None, SurfaceMap::Zebra, SurfaceMap::Isophotes,
                                               SurfaceMap::CurvatureGaussian, SurfaceMap::CurvatureMean,
                                               SurfaceMap::CurvatureMax, SurfaceMap::CurvatureMin, SurfaceMap::Draft},
                                    look.look.map.map);
        break;
    case Action::ToggleSection:
        if (look.look.section.planes.empty()) {
            SectionPlane plane; // through the middle, what is nearer is cut away
            for (size_t axis = 0; axis < 3; ++axis)
                plane.point_mm[axis] = 0.5 * (outline().bounds_lo_mm[axis] + outline().bounds_hi_mm[axis]);
            plane.normal = {0, -1, 0};
            look.look.section.planes = {plane};
        } else
            look.look.section.planes.clear();
        break;
    case Action::HideSelection: {
        if (selection_.empty())
            return tell("nothing is selected: click a part first");
        const std::vector<uint32_t> hidden = selection_.placements;
        select({});
        return show(hidden, false);
    }
    case Action::IsolateSelection:
        if (selection_.empty())
            return tell("nothing is selected: click a part first");
        show_alone(look.look.arrangement, image().instances.size(), selection_.placements);
        break;
    case Action::ShowAll:
        look.look.arrangement.only.clear();
        look.look.arrangement.hide.clear();
        break;
    default: // the views
        return look_from(view_of(action));
    }
    changed();
}

} // namespace trimray
