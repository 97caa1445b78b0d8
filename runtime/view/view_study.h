// The thread that finds out what takes longer than a picture: what each effect of the view costs, what accuracy costs
// in it, where it differs from the truth. One study at a time, of a view that rests; a view that changes gives it up.
#pragma once

#include "runtime/picture_size.h"
#include "runtime/view/accuracy_curve.h"
#include "runtime/view/effect_costs.h"
#include "runtime/view/error_mask.h"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <variant>

namespace trimray {

/// Of effects and accuracy the tracer is asked, which nobody else may use until the study is no longer busy; of errors
/// a frame that is there already.
struct StudyOrder {
    enum class What { Effects, Accuracy, Errors } what = What::Effects;
    uint64_t picture = 0; // which order of the picture thread it is of
    std::shared_ptr<const Scene> scene;
    std::shared_ptr<Tracer> tracer; // null for errors
    RenderOptions options;          // one sample a pixel
    uint32_t samples = 1;           // N x N a pixel: of effects
    Frame frame;                    // of errors: made with the options
    /// The same for views that show the same surfaces at the same pixels: their truth is found once. (Camera, size,
    /// placements, sections.)
    std::string view;
};

struct StudyFindings {
    uint64_t picture = 0; // as ordered
    bool complete = false;
    std::variant<EffectCosts, AccuracyCurve, ErrorMask> found;
};

class ViewStudy {
public:
    /// `wake` is called from the thread when there is something to take, and when it is no longer busy.
    explicit ViewStudy(std::function<void()> wake);
    ~ViewStudy();
    ViewStudy(const ViewStudy&) = delete;
    ViewStudy& operator=(const ViewStudy&) = delete;

    /// Never waits. Domain: not busy.
    void start(StudyOrder order);
    /// Gives up what is going on: it is busy for a while yet. Never waits.
    void cancel();
    /// Likewise, and waits until it holds neither tracer nor scene.
    void finish();

    bool busy() const { return busy_; }
    /// Busy, and with the tracer.
    bool uses_tracer() const { return uses_tracer_; }
    struct Progress {
        StudyOrder::What what;
        std::string doing;
        double share;
    };
    /// Nothing: not busy.
    std::optional<Progress> progress() const;
    /// The newest since the last call; of accuracy also what there is so far.
    std::optional<StudyFindings> take();
    /// Why the last study failed, once. Interrupted is not told.
    std::optional<Error> take_error();

private:
    void run();
    Status work_on(StudyOrder& order);
    Result<ViewReference*> reference_of(const StudyOrder& order, const RenderOptions& options, const std::string& view);
    void say(const std::string& doing, double share);
    void publish(const StudyOrder& order, std::variant<EffectCosts, AccuracyCurve, ErrorMask> found, bool complete);

    std::function<void()> wake_;
    std::atomic<bool> cancelled_ = false, busy_ = false, uses_tracer_ = false;
    // of the thread alone, or of whoever waited for it in finish()
    std::optional<ViewReference> reference_;
    std::string reference_view_;

    mutable std::mutex mutex_; // of all below
    std::condition_variable changed_;
    std::optional<StudyOrder> wanted_;
    StudyOrder::What what_ = StudyOrder::What::Effects;
    std::string doing_;
    double share_ = 0;
    bool stops_ = false;
    std::optional<StudyFindings> found_;
    std::optional<Error> error_;
    std::thread thread_; // last: it uses all of the above
};

/// As large a picture of the same shape as has at most this many pixels: what accuracy is measured at.
PictureSize study_size(PictureSize size);
constexpr uint64_t kStudyPixels = 240'000;

} // namespace trimray
