// Opens a file beside the interface: a pack is read; a CAD file is converted into the cache first, unless its pack is
// there; and its tracer is made.
#pragma once

#include "runtime/tracer.h"

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

    /// Ends what is going on and begins with another file.
    void start(const std::string& file);
    /// Ends what is going on: a conversion leaves nothing behind. Waits for that.
    void cancel();

    /// Until what was started is taken or cancelled.
    bool busy() const { return busy_; }
    LoadProgress progress() const;
    /// The model, or why there is none; once. Nothing after a cancel.
    std::optional<Result<LoadedModel>> take();

private:
    Result<LoadedModel> load(const std::string& file);
    Result<std::string> pack_of(const std::string& file, LoadedModel& model);
    void say(const std::string& doing, double share);

    TracerMaker make_;
    std::function<void()> wake_;
    std::thread thread_;
    std::atomic<bool> cancelled_ = false, busy_ = false;
    mutable std::mutex mutex_;
    LoadProgress progress_;
    std::optional<Result<LoadedModel>> done_;
};

} // namespace trimray
