// The viewer without its window: which files, which view, what is selected, and what each action does to that. The
// window's loop (main.cpp) gives it events and shows its pictures; the interface (interface.h) reads and changes it.
#pragma once

#include "runtime/arrangement.h"
#include "runtime/view/bindings.h"
#include "runtime/view/edge_measure.h"
#include "runtime/view/model_loader.h"
#include "runtime/view/picture_thread.h"
#include "runtime/view/surface_facts.h"
#include "runtime/view/view_state.h"

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace trimray {

/// Where the picture lies in the window, framebuffer pixels.
struct PictureRect {
    int x = 0, y = 0, width = 1, height = 1;
};

/// What lies under a pixel, as the picture's arrays have it.
struct PickedPoint {
    int32_t face = -1, instance = -1; // face -1: a cap of a section
    std::array<double, 3> point_mm{};
    std::array<double, 2> uv{};
    std::array<double, 3> eye_mm{}, along{}; // whence and along what it is seen
};

struct ViewerPanels {
    bool look = false, status = true, times = false, cheat_sheet = false, measure = false;
};

/// What was picked last and before that, measured on the surfaces themselves, and the edge nearest to the last.
struct MeasuredPicks {
    std::optional<SurfaceFacts> last, before;
    std::optional<PickedEdge> edge;
};

/// A message for a while, in the picture's corner.
struct Toast {
    std::string text;
    bool is_error = false;
    std::chrono::steady_clock::time_point until;
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
    void select(std::optional<PickedPoint> pick);
    void tell(std::string text, bool is_error = false);
    /// Writes the picture, once it is complete, and beside it the scene file that makes it again.
    void save_picture(const std::string& file, bool transparent);
    void cancel_load();

    // ---- what there is ----
    /// None while what is seen is the first picture of a file that is still being read.
    const LoadedModel* model() const { return model_ && !before_ ? &*model_ : nullptr; }
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
    const std::optional<PickedPoint>& selection() const { return selection_; }
    std::optional<PickedPoint> hovered() const;
    const MeasuredPicks& measured() const { return measured_; }
    const std::vector<Toast>& toasts() const { return toasts_; }
    /// Nothing is being loaded, traced or saved, and nothing moves.
    bool at_rest() const;
    bool wants_quit() const { return quits_; }

    ViewerPanels panels;
    std::function<void(const std::string& title)> on_title;

private:
    void begin_load();
    void take_early();
    void take_model();
    void forget_pictures();
    void take_first_view();
    void return_to_model();
    bool has_view() const { return model_ || before_; }
    const PackImage& outline() const { return before_ ? early_->outline : image(); }
    void take_picture();
    void order(bool moving);
    void fail_picture(const Error& error);
    std::string accuracy_options() const;
    void write_pending();
    void drag_to(double x, double y);
    void zoom_at(double x, double y, double scale);
    std::array<double, 3> point_under(double x, double y) const;
    void click(double x, double y);
    void recenter(double x, double y);
    void frame(const Reach& reach);
    Reach visible_reach();
    std::array<double, 2> in_picture(double x, double y) const { return {x - rect_.x, y - rect_.y}; }
    PictureSize size() const { return {uint32_t(rect_.width), uint32_t(rect_.height)}; }

    ViewState state_;
    const Preset* preset_;
    Turning turning_;
    std::function<void()> wake_;
    std::string screenshot_folder_;
    std::vector<std::string> files_;
    size_t file_index_ = 0;
    std::optional<SceneCamera> first_camera_;
    bool keeps_view_ = false; // the file that is being loaded is the one that is there, read again
    std::optional<Error> failure_;
    std::optional<LoadedModel> model_;
    // of the model, until its first picture, or of what is seen before it is there; of a file that is read again
    std::shared_ptr<const EarlyModel> early_, reloaded_early_;
    /// The model's view, to return to if the file that is seen early does not become the model.
    struct ViewBefore {
        Camera camera;
        Arrangement arrangement;
    };
    std::optional<ViewBefore> before_; // set while a file is seen early and its model is not there: early_ is, too
    KeptArrangement arrangement_;      // of what outline() places, as the look says

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
    Clock::time_point last_click_{};
    std::array<double, 3> zoom_point_{};
    std::optional<PickedPoint> selection_;
    MeasuredPicks measured_;
    std::vector<Toast> toasts_;
    struct PendingPicture {
        std::string file;
        bool transparent;
    };
    std::vector<PendingPicture> pending_;
    std::optional<Error> picture_failure_; // of what is ordered
    std::optional<Error> save_failure_;
    bool quits_ = false;

    ModelLoader loader_;
    PictureThread pictures_; // last: both threads use what is above
};

} // namespace trimray
