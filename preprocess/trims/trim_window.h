// Chains on a periodic surface -> closed loops in one window at most a period long.
//
// Even-odd makes both steps simple. A loop that leaves the window is walked again one period over, and every walk is
// pressed against the window's border where it leaves: the loop stays closed, and no crossing count inside the window
// changes. Loops that go once around are cut at the window's border, ordered across it and joined in pairs along it;
// one that is left over encloses a pole or an apex, and is joined with the border there. Where the surface has no end,
// such a loop cannot be right: it is closed along a straight line, as an open loop is.
#pragma once

#include "preprocess/trims/trim_chain.h"

namespace trimray {

/// Turns every chain into closed loops within `domain`, which becomes their window (periodic directions) and bounding
/// rectangle. What cannot be done is in report.failure. `surface` gives periods and natural bounds.
void close_and_wrap(std::vector<TrimChain>& chains, const CadSurface& surface, const TrimMetric& metric, Rect2d& domain,
                    ChainReport& report);

} // namespace trimray
