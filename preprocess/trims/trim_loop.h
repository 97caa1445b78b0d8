// Pcurves -> closed loops of monotone pieces with shared end values, in uv_face, simplified to a tolerance.
#pragma once

#include "format/result.h"
#include "preprocess/trims/trim_check.h"

#include <cstdint>
#include <string>
#include <vector>

namespace trimray {

struct TrimOptions {
    double tolerance =
        1e-6; // largest deviation of a piece from its pcurve, relative to the domain's longer side on the surface
    bool grow = true; // move borders outwards by what neighbours may miss each other by (trim_grow.h)
};

/// The trims of one face. An empty piece list with natural_border = true: the domain rectangle is the trim.
struct TrimLoops {
    Rect2d domain;                // uv_file; the loops' bounding rectangle after unwrapping periods
    bool natural_border = false;  // the loops run along the domain's rectangle and nothing else
    uint32_t border_classes = 0;  // of a natural border, as in FaceRecord
    std::vector<float> points;    // u, v pairs in uv_face; chains of loops
    std::vector<uint32_t> pieces; // pack_layout.h TrimPiece words
    uint32_t loop_count = 0;
    bool had_open_loop = false;   // a gap above the tolerance was closed by a segment
    double largest_gap = 0;       // closed gap, relative to the domain
    double largest_deviation = 0; // of the simplification, relative to the domain
    std::vector<TrimFinding> findings;
    double largest_growth_mm = 0; // that a piece was moved outwards by
};

/// Fails: InvalidTrim with the reason (no area, not finite, ...).
Result<TrimLoops> build_trim_loops(const CadFace& face, const TrimOptions& options);

} // namespace trimray
