// `render --time-budget`: time_budget.h's search with a tracer and a clock.
#pragma once

#include "runtime/command_json.h"
#include "runtime/time_budget.h"
#include "runtime/tracer.h"

#include <cstdint>
#include <string>
#include <vector>

namespace trimray {

struct BudgetReport {
    double budget_ms = 0;
    // A frame's tracing and shading (the median of RenderOptions::frames), and averaging its samples and enlarging it
    double measured_ms = 0;
    bool fits = false;
    Effort made; // what the picture is made with
    std::vector<GivenUp> gave_up;
};

/// {ms, measured_ms, fits, gave_up: [{what, from, to}]}
Json to_json(const BudgetReport& report);

/// The same in a sentence.
std::string to_text(const BudgetReport& report);

/// Pictures of one request from different cameras.
class BudgetedPictures {
public:
    /// `options` and `samples` say what is asked for; the camera may change. Pictures that are enlarged have colours
    /// alone where `colors_alone`. The tracer must outlive this.
    BudgetedPictures(Tracer& tracer, const RenderOptions& options, uint32_t samples, bool colors_alone,
                     double budget_ms);

    /// Traces with as much of what is asked for as fits, at the asked size; bit for bit what trace_picture() gives
    /// where all of it fits. The first picture is preceded by small ones that are timed, later ones begin with what
    /// the ones before took. Fails: as Tracer::render.
    Result<Frame> trace(const RenderOptions& options, RenderStats& stats, BudgetReport& report);

private:
    struct Made {
        Frame frame;
        RenderStats stats;
        double finishing_ms = 0; // averaging samples and enlarging
    };
    Result<Made> make(const RenderOptions& traced, const Effort& effort, const RenderOptions& options) const;
    Result<double> probe_ms(const RenderOptions& options, const Effort& effort) const;

    Tracer& tracer_;
    bool colors_alone_;
    std::vector<Effort> ladder_;
    double budget_ms_;
    BudgetSearch search_;
};

} // namespace trimray
