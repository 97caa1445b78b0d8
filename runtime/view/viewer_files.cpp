// Files: opening, reading again, seeing early, going through folders.
#include "runtime/view/viewer.h"

#include "runtime/command_trace.h"
#include "runtime/command_views.h"
#include "runtime/view/folder_models.h"
#include "runtime/view/recent_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

namespace trimray {
namespace {
namespace fs = std::filesystem;

} // namespace

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
        tell(words_of(watched.error()));
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
        tell(error);
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
            tell(kept.error());
    if (!keeps_view && !was_early)
        take_first_view();
    dirty_ = true;
}

void Viewer::apply_scene(const std::string& file)
{
    Result<SceneRequest> scene = read_scene_file(file);
    if (!scene.ok())
        return tell(scene.error());
    std::shared_ptr<const Environment> environment;
    if (scene->environment) {
        Result<Environment> read = read_environment(*scene->environment);
        if (!read.ok())
            return tell(read.error());
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

} // namespace trimray
