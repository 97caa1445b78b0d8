// How far apart the borders of neighbouring faces may be along the edge that they share.
#pragma once

#include "preprocess/import/cad_model.h"

namespace trimray {

/// Sets CadEdgeUse::gap_mm of every use in the part: its own pcurve's deviation from the edge and the largest of the
/// edge's other uses', and what approximated surfaces on both sides are off by. 0 for seams and poles.
/// The pcurves' share is at most the edge's tolerance or kUnstatedGap of `size_mm`, the part's diagonal: many files
/// give every edge the kernel's least tolerance, whatever their curves are. What is wider is the file's gap, and stays.
void measure_border_gaps(CadPart& part, double size_mm);

inline constexpr double kUnstatedGap = 2e-5;

} // namespace trimray
