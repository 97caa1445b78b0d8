#include "preprocess/trims/trim_report.h"

#include <algorithm>

namespace trimray {

DeviationReport gather_deviations(const CadModel& model)
{
    DeviationReport report;
    std::vector<PcurveDeviation> above;
    for (size_t part = 0; part < model.parts.size(); ++part)
        for (const CadFace& face : model.parts[part].faces)
            for (const CadLoop& loop : face.loops)
                for (const CadEdgeUse& use : loop) {
                    report.largest_mm = std::max(report.largest_mm, use.deviation_mm);
                    const double tolerance_mm = model.parts[part].edges[use.edge].tolerance_mm;
                    if (use.state == PcurveState::WithinTolerance)
                        continue;
                    report.rebuilt += use.state == PcurveState::Rebuilt;
                    above.push_back({static_cast<uint32_t>(part), face.face_in_part, use.edge, use.deviation_mm,
                                     tolerance_mm, use.file_deviation_mm, use.state});
                }
    report.above_tolerance = above.size();
    std::stable_sort(above.begin(), above.end(), [](const PcurveDeviation& a, const PcurveDeviation& b) {
        return std::max(a.deviation_mm, a.file_deviation_mm) > std::max(b.deviation_mm, b.file_deviation_mm);
    });
    above.resize(std::min(above.size(), kMostDeviations));
    report.worst = std::move(above);
    return report;
}

} // namespace trimray
