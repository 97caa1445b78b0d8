// What is wrong or doubtful about a model's trims, for reports: pcurves that run beside their edges.
#pragma once

#include "preprocess/import/cad_model.h"

#include <cstdint>
#include <vector>

namespace trimray {

/// A pcurve that lies, or lay in the file, farther from its edge's curve than the edge's tolerance, or may do so.
struct PcurveDeviation {
    uint32_t part = 0, face_in_part = 0;
    uint32_t edge = 0; // index into CadPart::edges
    double deviation_mm = 0, tolerance_mm = 0;
    double file_deviation_mm = 0; // rebuilt: of the file's pcurve
    PcurveState state = PcurveState::OffSurface;
};

struct DeviationReport {
    double largest_mm = 0;              // of all pcurves
    size_t above_tolerance = 0;         // how many there are
    size_t rebuilt = 0;                 // of those
    std::vector<PcurveDeviation> worst; // of those, largest first, at most kMostDeviations
};
inline constexpr size_t kMostDeviations = 32;

/// Gathers the deviations of all edge uses.
DeviationReport gather_deviations(const CadModel& model);

} // namespace trimray
