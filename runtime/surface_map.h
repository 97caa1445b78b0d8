// Maps drawn on surfaces: their names, whether a request for one makes sense, and its settings as the tracers take
// them. Colours and formulas: shaders/shared/surface_map.h.
#pragma once

#include "format/pack_image.h"
#include "format/result.h"
#include "runtime/scene_look.h"
#include "runtime/tracer.h"
#include "shaders/frame_layout.h"

#include <array>

namespace trimray {

/// The name of a map on the command line and in the effect plan: zebra, isophotes, curvature-gaussian, curvature-mean,
/// curvature-max, curvature-min, draft; none.
const char* surface_map_name(SurfaceMap map);

/// Whether a map measures something: curvatures and draft do.
bool measures(SurfaceMap map);

/// Whether a picture computes its map: where it is drawn or measures something.
bool has_map(const RenderOptions& options);

/// What the ends of a curvature's scale stand for where nobody says: +-kCurvatureRange over the diagonal of the pack's
/// bounds, Gaussian curvature +- the square of it: a ball whose radius is a kCurvatureRange-th of the model has full
/// colour.
inline constexpr double kCurvatureRange = 10;

/// The curvatures that the ends of the scale stand for, 1/mm or 1/mm^2. Domain: a map of curvatures.
std::array<double, 2> curvature_range(const PackImage& image, const SurfaceMapLook& look);

/// Whether a map is one of the four curvatures.
bool is_curvature(SurfaceMap map);

inline constexpr uint32_t kMostStripes = 10000;

/// Whether a map can be drawn on this pack. Fails: Usage, for a direction of no length, no stripes or more than
/// kMostStripes, a range without width, a draft outside of [0, 90) degrees; UnsupportedPackFeature, for curvatures
/// where a placement is not a turn, a mirroring and one scale: there the part's curvatures are not the world's.
Status check_map(const PackImage& image, const SurfaceMapLook& look);

/// Domain: check_map allows it, and the map is not none.
MapView map_view(const PackImage& image, const SurfaceMapLook& look);

} // namespace trimray
