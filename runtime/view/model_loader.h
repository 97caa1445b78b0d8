// Opens a file beside the interface: a pack is read; a CAD file is converted into the cache first, unless its pack is
// there; and its tracer is made. On the way it tells of what a first picture can be drawn from.
#pragma once

#include "runtime/tracer.h"
#include "runtime/view/early_model.h"

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace trimray {

/// A model that is ready to be seen.
struct LoadedModel {
    std::string file, pack; // what was asked for, and what is read: the same, or the pack in the cache
    std::shared_ptr<const Scene> scene;
    std::shared_ptr<Tracer> tracer;
    std::vector<std::string> notes; // which device and why; what the conversion lost
    double convert_seconds = 0, load_seconds = 0;
};

/// Makes a tracer for a scene by the device's name, as make_tracer.
using TracerMaker =
    std::function<Result<std::unique_ptr<Tracer>>(const std::shared_ptr<const Scene>& scene, std::string& note)>;

/// What is being done: a sentence's beginning, and the share that is done, negative where unknown.
struct LoadProgress {
    std::string doing;
    double share = -1;
};

class ModelLoader {
public:
    /// `wake` is called from the loader's thread when something changed.
    ModelLoader(TracerMaker make, std::function<void()> wake);
    ~ModelLoader();
    ModelLoader(const ModelLoader&) = delete;
    ModelLoader& operator=(const ModelLoader&) = delete;

    /// Ends what is going on, as cancel, and begins with another file once it has ended. Never waits.
    void start(const std::string& file);
    /// Nothing is wanted any more: what is going on ends as soon as it can, and a conversion leaves nothing behind.
    /// Never waits; the destructor does.
    void cancel();

    /// Until what was started is taken or cancelled.
    bool busy() const { return busy_; }
    LoadProgress progress() const;
    /// The model, or why there is none; once. Nothing after a cancel.
    std::optional<Result<LoadedModel>> take();
    /// What a first picture of it can be drawn from, once; it may come before the model, after it or never. Nothing
    /// after a cancel.
    std::shared_ptr<const EarlyModel> take_early();

private:
    struct Job {
        std::string file;
        std::atomic<bool> cancelled = false;
    };
    void run(const std::shared_ptr<Job>& job);
    Result<LoadedModel> load(const std::shared_ptr<Job>& job, std::thread& early);
    Result<std::string> pack_of(const Job& job, LoadedModel& model);
    void say(const Job& job, const std::string& doing, double share);
    void publish_early(const Job& job, PackImage outline);

    TracerMaker make_;
    std::function<void()> wake_;
    std::thread thread_; // of the last job; it ends after those of all jobs before
    std::atomic<bool> busy_ = false;
    mutable std::mutex mutex_; // of all below
    std::shared_ptr<Job> job_;
    LoadProgress progress_;
    std::optional<Result<LoadedModel>> done_;
    std::shared_ptr<const EarlyModel> early_;
};

} // namespace trimray
