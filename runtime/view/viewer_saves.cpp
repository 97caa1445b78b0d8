// Saving: pictures with the scene files that make them again, turns around the model.
#include "runtime/view/viewer.h"

#include "format/pack_writer.h"
#include "runtime/command_trace.h"
#include "runtime/command_views.h"
#include "runtime/image_io.h"
#include "runtime/scene_write.h"
#include "runtime/trim_mode.h"

#include <fmt/format.h>

#include <filesystem>
#include <span>
#include <utility>

namespace trimray {
namespace {
namespace fs = std::filesystem;

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

} // namespace

void Viewer::save_picture(const std::string& file, bool transparent)
{
    if (model() && !picture_failure_)
        pending_.push_back({file, transparent});
    else if (!save_failure_)
        save_failure_ = picture_failure_
                            ? *picture_failure_
                            : Error{ErrorCode::ImageNotWritten, file, "there is no picture: no model is open"};
}

void Viewer::save_numbered_picture(bool transparent)
{
    if (!model())
        return tell("there is no picture yet");
    save_picture(free_stem(screenshot_folder_, fs::path(model_->file).stem().string() + "-", ".png") + ".png",
                 transparent);
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
            tell(written.error());
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
        return tell(written.error());
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
        return end_series(words_of(written.error()), true);
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

} // namespace trimray
