// What is drawn over a traced frame: lines along borders and silhouettes, and anti-aliased borders. A tracer notes for
// each pixel where the nearest border of its face is (EdgeMap); a pass over the frame, the same for both tracers, draws
// from these notes, the depths and the normals. It changes colours alone. Where lines along borders are all that is
// asked for, a tracer may draw each line's share of its own pixel itself: the pass then reads the frame at outlines
// only.
//
// A border belongs to both of its faces, and each pixel's face draws its side of a line. Where nothing borders on the
// other side (the line is an outline, before a farther surface or the background), the pixels there get the other half
// from their neighbour, so that lines are as wide everywhere.
#pragma once

#include "runtime/edge_map.h"
#include "runtime/face_colors.h"
#include "runtime/tracer.h"

#include <cstdint>
#include <functional>

namespace trimray {

/// What a tracer must find out about borders for the effects of a request.
struct EdgeQuery {
    uint32_t line_classes = 0; // bit kEdge...: such borders go to EdgeMap::line
    float line_width_px = 0;   // 0: no lines along borders
    float line_reach_px = 0;   // as far as lines need to be known
    float border_reach_px = 0; // as far as borders of any class need to be known (EdgeMap::border); 0: not at all
    bool any() const { return line_reach_px > 0 || border_reach_px > 0; }
    /// Bits kEdge... of the borders that anything is asked about.
    uint32_t classes() const { return border_reach_px > 0 ? ~(1u << kEdgeSeam) & 15u : line_classes; }
    float reach_px() const { return line_reach_px > border_reach_px ? line_reach_px : border_reach_px; }
};
EdgeQuery edge_query(const RenderOptions& options);

/// Whether a request's effects make sense. Fails: Usage.
Status check_effects(const RenderOptions& options);

/// Whether a tracer may draw a line's share of its own pixel as it traces it: where nothing else changes that pixel's
/// colour before, so that the pass has only outlines left, and what is hit is opaque.
bool own_halves_alone(const RenderOptions& options);

/// Runs body(i) for i in [0, count), at once where threads allow.
using RunEach = std::function<void(uint32_t count, const std::function<void(uint32_t)>& body)>;

/// Whether `options` asks for anything that draw_effects does.
bool has_effects(const RenderOptions& options);

/// Draws the effects of `options` into frame.rgba. `map` is what the tracer noted for edge_query(options).
/// The result does not depend on how `run_each` orders its calls.
void draw_effects(const FaceColors& colors, const RenderOptions& options, const RunEach& run_each, EdgeMap& map,
                  Frame& frame);

} // namespace trimray
