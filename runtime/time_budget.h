// A picture within a time budget: the ladder of what may be given up for time, from all that is asked for to the least,
// and the search for the best rung of it that fits. Neither knows a clock or a tracer: times come from outside.
//
// Only effort is given up, never content: lines, maps, sections and transparency stay, and so does exactness, which
// costs next to nothing (ACCURACY.md).
#pragma once

#include "format/result.h"
#include "runtime/tracer.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace trimray {

/// What a picture is made with, of what can be given up.
struct Effort {
    uint32_t samples = 1;       // N x N a pixel
    uint32_t occlusion = 0;     // rays a pixel; 0: none
    uint32_t light_samples = 0; // rays a pixel to each light that has a size and throws shadows; 0: there is none
    uint32_t mirror_depth = 0;  // 0: there are no mirrors
    bool smoothed = false;      // RenderOptions::antialias_trims
    uint32_t shrink = 1;        // traced at 1/shrink of the width and height and enlarged

    bool operator==(const Effort&) const = default;
};

/// The effort that a request of N x N `samples` a pixel takes.
Effort effort_of(const RenderOptions& options, uint32_t samples);

/// The efforts for a request, the first as asked for, each later one without more of anything: first fewer samples a
/// pixel, then fewer rays of occlusion, fewer rays to lights, hard shadows, fewer reflections, no smoothed trims, no
/// occlusion, and at last 1/2, 1/3, 1/4, 1/6 and 1/8 of the size, where that leaves kLeastSide pixels a side.
std::vector<Effort> effort_ladder(const RenderOptions& options, uint32_t samples);
constexpr uint32_t kLeastSide = 16;

/// `options` with all of an effort but its samples and its size.
RenderOptions with_effort(RenderOptions options, const Effort& effort);

/// One thing that is given up, in words.
struct GivenUp {
    std::string what, from, to;
};
std::vector<GivenUp> given_up(const Effort& asked, const Effort& made);

/// Finds the best rung of a ladder whose picture takes no longer than the budget, and keeps what it learnt for the
/// next picture.
class BudgetSearch {
public:
    /// Domain: rungs > 0, budget_ms > 0.
    BudgetSearch(size_t rungs, double budget_ms) : budget_ms_(budget_ms), rungs_(rungs) {}

    /// A rung's time for the whole picture, ms, guessed from a small share of it. Fails: as Tracer::render.
    using Probe = std::function<Result<double>(size_t rung)>;

    void begin_picture();

    /// The rung to make the picture with next; none: the best one has been made. Rungs are probed from the first on,
    /// each once; none where there is but one. After a picture that takes too long the next is
    /// of a lower rung, after one that fits of a higher one, kMostUpgrades times at most, if what was measured lets
    /// expect that it fits. Fails: as `probe`.
    Result<std::optional<size_t>> next(const Probe& probe);

    /// Tells what the picture of the rung that next() gave took. True: it is the best so far, to be kept.
    bool measured(size_t rung, double ms);

    /// Of the best picture so far. Domain: one was measured.
    double best_ms() const { return *rungs_[*best_].estimate_ms; }
    bool best_fits() const { return fits(best_ms()); }

private:
    struct Rung {
        std::optional<double> estimate_ms;
        bool made = false; // of this picture: the estimate is its time
    };
    bool fits(double ms) const;

    double budget_ms_;
    double bias_ = 1; // of times measured to those that probes said
    std::vector<Rung> rungs_;
    std::optional<size_t> best_;
    uint32_t upgrades_ = 0;
};
constexpr double kOverBudget = 0.1; // a picture may take so much more of the budget than all of it, and fits
constexpr uint32_t kMostUpgrades = 2;

} // namespace trimray
