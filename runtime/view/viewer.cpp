#include "runtime/view/viewer.h"

#include "runtime/camera_frame.h"
#include "runtime/command_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>
#include <utility>

namespace trimray {
namespace {
using namespace std::chrono_literals;

constexpr auto kStillAfter = 150ms; // without a move, a view rests

bool same(const Camera& a, const Camera& b)
{
    return std::tie(a.eye, a.target, a.up, a.fov_deg, a.orthographic_mm) ==
           std::tie(b.eye, b.target, b.up, b.fov_deg, b.orthographic_mm);
}

} // namespace

std::string words_of(const Error& error)
{
    return error.where.empty() ? error.detail : fmt::format("{}: {}", error.where, error.detail);
}

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
    tell(error);
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

void Viewer::tell(std::string text, bool is_error)
{
    std::erase_if(toasts_, [&](const Toast& toast) { return toast.text == text; });
    toasts_.push_back({std::move(text), is_error, Clock::now() + (is_error ? 12s : 6s)});
}

void Viewer::tell(const Error& error)
{
    tell(words_of(error), true);
}

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

} // namespace trimray
