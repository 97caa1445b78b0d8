// The figures of `bench speed`, one line a model and view: as a table that is stored (tests/baseline.csv), and held
// against a stored one.
#pragma once

#include "format/result.h"
#include "runtime/command_json.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace trimray {

/// What is the same for any instruction set and number of threads.
struct SpeedCounts {
    using Count = std::optional<uint64_t>; // none: not counted
    Count width, height;
    // of the pack; bytes as `info` gives them, in memory and of the file
    Count faces, patches, leaves, geometry_bytes, bvh_bytes, trim_exact_bytes, trim_sdf_bytes, file_bytes;
    Count pcurve_deviation_nm; // the largest, as trimray-pack reports it; none: the model was a pack
    // of one frame, as WorkCounts
    Count rays, node_visits, leaf_visits, newton_steps, curve_tests, uncertified_pixels;
    Count missing, extra, wrong_depth; // pixels beside the reference in double, as ClosestErrors

    bool operator==(const SpeedCounts&) const = default;
};

/// Spreads are (third quartile - first) / median, and need three rounds.
struct SpeedTimes {
    using Time = std::optional<double>; // none: not measured
    Time picture_ms, picture_ms_spread; // median over the rounds
    // baseline's time over the picture's in the same round, median
    Time speed_to_one_ray, speed_to_one_ray_spread, speed_to_mesh, speed_to_mesh_spread;
};

struct SpeedLine {
    std::string model, view;
    SpeedCounts counts;
    std::string device; // what the times are of
    SpeedTimes times;
};
using SpeedTable = std::vector<SpeedLine>;

/// All of a line by column, but model and view.
Json to_json(const SpeedLine& line);

/// With a line of column names. Times have four digits.
std::string speed_csv(const SpeedTable& table);

/// Fails: InvalidBaseline, at "line N": other columns, a field that is no number, a model's view twice.
Result<SpeedTable> parse_speed_csv(std::string_view text);

struct ChangedCount {
    std::string model, view, count;
    uint64_t stored = 0, now = 0;
};

enum class SpeedVerdict {
    Same, // the change is within the spreads of both
    Faster,
    Slower,
    Open, // fewer than three rounds in one of them
};

/// A speed of the run over the stored one.
struct ChangedSpeed {
    std::string model, view, baseline; // "one_ray" or "mesh"
    double stored = 0, now = 0;
    double noise = 0; // the sum of both spreads; 0: open
    SpeedVerdict verdict = SpeedVerdict::Open;
};

struct SpeedComparison {
    std::vector<ChangedCount> changed;
    std::vector<std::string> not_compared;                                // counts that one of the two has not
    std::vector<std::pair<std::string, std::string>> not_stored, not_run; // model and view that the other has not
    std::vector<ChangedSpeed> speeds;                                     // of lines that the same device timed
    std::string other_device; // a stored line's, whose times were not compared; "": none

    /// Whether the stored table says what the run does, but for times.
    bool agrees() const { return changed.empty() && not_stored.empty() && not_run.empty(); }
    /// Geometric mean of now / stored over the speeds to `baseline`; none: there are none.
    std::optional<double> mean_change(const std::string& baseline) const;
};

SpeedComparison compare_speeds(const SpeedTable& stored, const SpeedTable& now);
Json to_json(const SpeedComparison& comparison);

} // namespace trimray
