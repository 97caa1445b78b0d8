// Measures the trim modes on one pack: frames timed in turns, queries alone, bytes, and errors against the reference.
#pragma once

#include "format/derive.h"
#include "format/result.h"
#include "runtime/tracer.h"
#include "runtime/trim_errors.h"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace trimray {

/// One way to answer trims; textures where the mode reads them.
struct TrimSetting {
    TrimMode mode = TrimMode::Exact;
    TrimTextureOptions textures;
    double memory = 0;  // of the textures, relative to the kd-trees' bytes
    bool edges = false; // sharp edges drawn too, to see what they cost
    bool has_textures() const { return mode == TrimMode::Sdf || mode == TrimMode::Hybrid; }
};

/// kd, exact, exact with edges, then hybrid and sdf for each source, layout and memory.
std::vector<TrimSetting> trim_settings(const std::vector<double>& memories);

struct TrimFigures {
    TrimSetting setting;
    uint64_t bytes = 0;     // of what the mode reads: trees, pieces and cells, textures, with edges the borders' cells
    double frame_ms = 0;    // median; on one thread its processor time
    double speed_to_kd = 0; // median over the rounds of kd's time over this one's
    double ns_per_query = 0;
    uint64_t queries = 0, wrong_queries = 0; // of the reference's picture, hidden surfaces' included
    TrimErrors errors;
};

struct TrimView {
    std::string name;
    Camera camera;
    std::vector<TrimFigures> figures; // by setting
};

struct TrimReport {
    std::string device;
    std::vector<TrimView> views;
};

struct TrimBenchOptions {
    uint32_t width = 960, height = 540;
    uint32_t rounds = 5;
    uint32_t threads = 1;
    std::string instruction_set; // empty: the best
    std::vector<double> memories{0.5, 1, 2, 4};
    std::vector<std::string> views{"iso", "top", "close-up"};
    double magnification = 8; // of the close-up
};

/// Settings take turns (bench_turns.h); each time two frames are traced and the second is timed, with the caches as a
/// viewer has them. Queries are those that the reference's picture asks, in its order, answered again by the mode
/// alone; the time is that of their loop over the lanes that ask. `progress` is told what is being done, view by view.
/// Fails: as Tracer::render; Usage (a view's name).
Result<TrimReport> bench_trims(const std::shared_ptr<const Scene>& scene, const TrimBenchOptions& options,
                               const std::function<void(const std::string&)>& progress);

} // namespace trimray
