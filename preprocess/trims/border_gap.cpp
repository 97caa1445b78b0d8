#include "preprocess/trims/border_gap.h"

#include <algorithm>

namespace trimray {
namespace {

/// The two largest of what the uses of an edge are off by; the first one's use.
struct Largest {
    double first = 0, second = 0;
    const CadEdgeUse* of_first = nullptr;

    void add(double x, const CadEdgeUse& use)
    {
        if (!of_first || x > first) {
            second = first;
            first = x;
            of_first = &use;
        } else {
            second = std::max(second, x);
        }
    }
    double of_others(const CadEdgeUse& use) const { return &use == of_first ? second : first; }
};

template <class Visit>
void visit_uses(CadPart& part, Visit visit)
{
    for (CadFace& face : part.faces)
        for (CadLoop& loop : face.loops)
            for (CadEdgeUse& use : loop)
                if (!use.seam && !use.degenerate)
                    visit(face, use);
}

} // namespace

void measure_border_gaps(CadPart& part, double size_mm)
{
    struct OffBy {
        Largest pcurve, surface;
    };
    std::vector<OffBy> edges(part.edges.size());
    visit_uses(part, [&](const CadFace& face, const CadEdgeUse& use) {
        edges[use.edge].pcurve.add(use.deviation_mm, use);
        edges[use.edge].surface.add(face.surface.deviation_mm, use);
    });
    visit_uses(part, [&](const CadFace& face, CadEdgeUse& use) {
        const OffBy& edge = edges[use.edge];
        use.gap_mm = std::min(use.deviation_mm + edge.pcurve.of_others(use),
                              std::max(part.edges[use.edge].tolerance_mm, kUnstatedGap * size_mm)) +
                     face.surface.deviation_mm + edge.surface.of_others(use);
    });
}

} // namespace trimray
