// The viewer without its window: which files, which view, what is selected, and what each action does to that. The
// window's loop (main.cpp) gives it events and shows its pictures; the interface (interface.h) reads and changes it.
#pragma once

#include "runtime/arrangement.h"
#include "runtime/view/bindings.h"
#include "runtime/view/dimensions.h"
#include "runtime/view/edge_measure.h"
#include "runtime/view/file_watch.h"
#include "runtime/view/model_loader.h"
#include "runtime/view/model_tree.h"
#include "runtime/view/picture_thread.h"
#include "runtime/view/section_handles.h"
#include "runtime/view/selection.h"
#include "runtime/view/surface_facts.h"
#include "runtime/view/view_state.h"
#include "runtime/view/view_study.h"
#include "runtime/view/viewer_panels.h"

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace trimray {

/// Where the picture lies in the window, framebuffer pixels.
struct PictureRect {
    int x = 0, y = 0, width = 1, height = 1;
};

/// What was picked last and before that, measured on the surfaces themselves, and the edge nearest to the last.
struct MeasuredPicks {
    std::optional<SurfaceFacts> last, before;
    std::optional<PickedEdge> edge;
};

/// For people: what it concerns, if anything, and what became of it.
std::string words_of(const Error& error);

/// A message for a while, in the picture's corner.
struct Toast {
    std::string text;
    bool is_error = false;
    std::chrono::steady_clock::time_point until;
};

/// What a study found, and of which picture.
template <class Found>
struct Studied {
    uint64_t picture = 0;
    bool complete = false;
    Found found;
};

class Viewer {
public:
    using Clock = std::chrono::steady_clock;

    struct Start {
        std::vector<std::string> files;
        ViewState state;
        std::optional<SceneCamera> camera; // of the first file; none: the model whole, from iso
        const Preset* preset = nullptr;
        TracerMaker make_tracer;
        std::function<void()> wake;
        std::string screenshot_folder = ".";
        std::string state_folder; // where settings and recent files are kept; empty: they are not
    };
    explicit Viewer(Start start);

    // ---- what happens ----
    void open(std::vector<std::string> files, size_t index = 0);
    void act(Action action);
    /// An event that the interface does not take for itself.
    void handle(const InputEvent& event);
    /// Takes what the threads have ready and orders what is missing.
    void update(Clock::time_point now);
    /// Seconds until update is wanted though nothing happens; negative: as long as it takes.
    double patience(Clock::time_point now) const;
    void set_picture_rect(const PictureRect& rect);
    /// The view or look was changed by the interface. `moving`: it goes on changing.
    void changed(bool moving = false);
    void look_from(const std::string& view);
    void look_along(const Camera& camera);
    /// What was clicked, and measures it; nothing: selects nothing. `adds`: what is selected stays so, but what is
    /// clicked again.
    void select_at(const std::optional<PickedPoint>& pick, bool adds = false);
    /// Ascending.
    void select(std::vector<uint32_t> placements, bool adds = false);
    void select_face(uint32_t placement, uint32_t face);
    void show(std::span<const uint32_t> placements, bool shown);
    void tell(std::string text, bool is_error = false);
    void tell(const Error& error);
    /// Writes the picture, once it is complete, and beside it the scene file that makes it again.
    void save_picture(const std::string& file, bool transparent);
    void cancel_load();
    /// Takes over what a scene file says: its first camera, lights, materials, effects.
    void apply_scene(const std::string& file);
    /// Pictures of a turn around the model, one after another, as the picture thread has them.
    void save_turntable(uint32_t steps);
    /// Finds out what the effects or the accuracy of the view cost, once its picture is complete; a view that changes
    /// gives it up. Of errors: of this picture and every one that follows, until told otherwise.
    void study(StudyOrder::What what);
    void cancel_study();
    void show_errors(bool shown);

    // ---- what there is ----
    /// None while what is seen is the first picture of a file that is still being read.
    const LoadedModel* model() const { return model_ && !before_ ? &*model_ : nullptr; }
    /// Counts up with each model that takes the place of another.
    uint64_t model_count() const { return model_count_; }
    /// What is to be drawn in place of a picture, as long as there is none.
    std::shared_ptr<const EarlyModel> early() const { return shown_ ? nullptr : early_; }
    /// What is placed where, of the model or of what is drawn before it.
    PlacementView placed();
    const PackImage& image() const { return model_->scene->pack.image; }
    ViewState& state() { return state_; }
    const ViewState& state() const { return state_; }
    const Preset& preset() const { return *preset_; }
    void set_preset(const Preset& preset);
    Turning turning() const { return turning_; }
    const std::vector<std::string>& files() const { return files_; }
    size_t file_index() const { return file_index_; }
    const ModelLoader& loader() const { return loader_; }
    const std::optional<Error>& failure() const { return failure_; } // of the file that is to be seen
    /// Why the first picture that could not be saved was not.
    const std::optional<Error>& save_failure() const { return save_failure_; }
    const PictureRect& picture_rect() const { return rect_; }
    const ShownPicture* shown() const { return shown_ ? &*shown_ : nullptr; }
    /// Counts up with each picture that is taken.
    uint64_t shown_count() const { return shown_count_; }
    /// The last picture that knows what lies where, if it is of the view at hand.
    const ShownPicture* hits() const { return hits_ ? &*hits_ : nullptr; }
    /// What lies under a pixel of the picture.
    std::optional<PickedPoint> pick(double x, double y) const;
    const Selection& selection() const { return selection_; }
    /// Counts up with each change of the selection.
    uint64_t selection_count() const { return selection_count_; }
    /// Domain: there is a model, as below.
    const ModelTree& tree() const { return *tree_; }
    /// By placement, 0: hidden; empty: all are visible.
    std::span<const uint8_t> visible() { return placed().visible; }
    size_t hidden_count() const;
    /// Counts up when other placements are visible, or elsewhere.
    uint64_t arrangement_count() const { return arrangement_count_; }
    std::optional<PickedPoint> hovered() const;
    /// What planes that cut are moved by, in pixels of the picture; none where they are not to be seen.
    std::vector<SectionHandle> section_handles();
    /// What of them is held, or would be by a press now.
    std::optional<GrippedSection> section_grip();
    const MeasuredPicks& measured() const { return measured_; }
    const std::vector<Toast>& toasts() const { return toasts_; }
    /// Nothing is being loaded, traced or saved, and nothing moves.
    bool at_rest() const;
    bool wants_quit() const { return quits_; }
    /// The list of recent files; empty: none is kept.
    const std::string& recent_list() const { return recent_list_; }
    /// How many pictures of a turn are written, and of how many; nothing: none are.
    std::optional<std::array<size_t, 2>> series_progress() const;
    /// What the last studies of this model found. Of errors: of the picture that is shown, or nothing.
    const std::optional<Studied<EffectCosts>>& effect_costs() const { return effect_costs_; }
    const std::optional<Studied<AccuracyCurve>>& accuracy_curve() const { return accuracy_curve_; }
    const ErrorMask* errors() const;
    bool shows_errors() const { return shows_errors_; }
    std::optional<ViewStudy::Progress> study_progress() const { return study_.progress(); }
    /// What is found is of the picture that is ordered.
    template <class Found>
    bool is_of_this_view(const Studied<Found>& studied) const
    {
        return studied.picture == ordered_;
    }

    ViewerPanels panels;
    float scale = 1; // of what is drawn over the picture: 1 on a display of about 96 dots an inch
    LengthUnit unit = LengthUnit::Millimetre; // of what is told of places and measures
    std::function<void(const std::string& title)> on_title;

private:
    void begin_load();
    void step_file(int step);
    void follow_file();
    void write_series();
    void end_series(const std::string& why, bool is_error);
    void take_early();
    void take_model();
    void forget_pictures();
    void take_first_view();
    void return_to_model();
    bool has_view() const { return model_ || before_; }
    const PackImage& outline() const { return before_ ? early_->outline : image(); }
    void take_picture();
    void take_study();
    void start_study();
    void forget_studies();
    std::string surfaces_seen() const;
    void order(bool moving);
    void fail_picture(const Error& error);
    std::string accuracy_options() const;
    void save_numbered_picture(bool transparent);
    void write_pending();
    bool act_on_window(Action action);
    bool act_on_view(Action action);
    bool act_on_parts(Action action);
    bool act_on_look(Action action);
    void drag_section_to(double x, double y);
    void drag_to(double x, double y);
    void zoom_at(double x, double y, double scale);
    std::array<double, 3> point_under(double x, double y) const;
    void click(double x, double y, bool adds);
    void set_selection(Selection selection);
    void recenter(double x, double y);
    void frame(std::function<Reach()> reach);
    void look_framed(std::function<Camera()> framing);
    Reach visible_reach();
    std::array<double, 2> in_picture(double x, double y) const { return {x - rect_.x, y - rect_.y}; }
    PictureSize size() const { return {uint32_t(rect_.width), uint32_t(rect_.height)}; }

    ViewState state_;
    const Preset* preset_;
    Turning turning_;
    std::function<void()> wake_;
    std::string screenshot_folder_, recent_list_;
    std::vector<std::string> files_;
    size_t file_index_ = 0;
    std::optional<SceneCamera> first_camera_;
    bool keeps_view_ = false; // the file that is being loaded is the one that is there, read again
    std::optional<Error> failure_;
    std::optional<LoadedModel> model_;
    std::unique_ptr<const ModelTree> tree_;
    uint64_t model_count_ = 0, arrangement_count_ = 0;
    // of the model, until its first picture, or of what is seen before it is there; of a file that is read again
    std::shared_ptr<const EarlyModel> early_, reloaded_early_;
    /// The model's view, to return to if the file that is seen early does not become the model.
    struct ViewBefore {
        Camera camera;
        Arrangement arrangement;
        std::function<Camera()> framing;
        Camera framed;
    };
    std::optional<ViewBefore> before_; // set while a file is seen early and its model is not there: early_ is, too
    KeptArrangement arrangement_;      // of what outline() places, as the look says

    // The last view that framed something, and how: while nobody moves away from it, it is framed anew for each size
    std::function<Camera()> framing_;
    Camera framed_;
    PictureRect rect_;
    bool has_rect_ = false;
    bool dirty_ = false, moving_ = false;
    Clock::time_point still_at_{}; // when a moving view counts as resting
    uint64_t ordered_ = 0;
    std::optional<ShownPicture> shown_, hits_;
    uint64_t shown_count_ = 0;

    double pointer_x_ = -1, pointer_y_ = -1, press_x_ = 0, press_y_ = 0, click_x_ = 0, click_y_ = 0;
    unsigned buttons_ = 0;
    int drag_mods_ = 0;
    bool dragged_ = false;
    std::optional<GrippedSection> grip_; // since a button was pressed
    Clock::time_point last_click_{};
    std::array<double, 3> zoom_point_{};
    Selection selection_;
    uint64_t selection_count_ = 0;
    MeasuredPicks measured_;
    std::vector<Toast> toasts_;
    struct PendingPicture {
        std::string file;
        bool transparent;
    };
    std::vector<PendingPicture> pending_;
    struct Series { // of pictures, as a turn around the model
        std::vector<Camera> cameras;
        std::vector<std::string> files;
        std::string scene;
        size_t written = 0;
        Camera before;
    };
    std::optional<Series> series_;
    std::optional<Studied<EffectCosts>> effect_costs_;
    std::optional<Studied<AccuracyCurve>> accuracy_curve_;
    std::optional<Studied<ErrorMask>> errors_;
    std::optional<StudyOrder::What> wanted_study_; // once the picture is complete
    bool shows_errors_ = false;
    uint64_t asked_errors_ = 0;            // the picture whose errors were asked for last
    bool remade_ = false;                  // the tracer of this model was made anew after its device failed
    std::optional<Error> picture_failure_; // of what is ordered
    std::optional<Error> save_failure_;
    bool quits_ = false;

    FileWatch watch_;
    ModelLoader loader_;
    PictureThread pictures_;
    ViewStudy study_; // last: all threads use what is above
};

} // namespace trimray
