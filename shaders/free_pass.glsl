// What the passes that cast free rays have in common: the formulas, the band's pixels, and the counts. Where
// TRIMRAY_COLLECTS is defined all crossings of a ray are kept (crossings.glsl).
#include "format/kd_layout.h"
#include "shaders/frame_layout.h"
#include "shaders/light_layout.h"
#include "shaders/material_layout.h"
#include "shaders/section_layout.h"
// first: the formulas fetch through it, and they make `scalar`, a layout there, a type
#include "shaders/scene_buffers.glsl"

#include "shaders/shared/bezier.h"
#include "shaders/shared/bvh_node.h"
#include "shaders/shared/environment.h"
#include "shaders/shared/language.h"
#include "shaders/shared/leaf_box.h"
#include "shaders/shared/leaf_proof.h"
#include "shaders/shared/leaf_start.h"
#include "shaders/shared/light.h"
#include "shaders/shared/precision.h"
#include "shaders/shared/quadric.h"
#include "shaders/shared/rim.h"
#include "shaders/shared/section.h"
#include "shaders/shared/torus.h"
#include "shaders/shared/trim_kd.h"
#include "shaders/shared/trim_lookup.h"

#include "shaders/materials.glsl"
#include "shaders/ray_types.glsl"
#include "shaders/free_rays.glsl"
#ifdef TRIMRAY_COLLECTS
#include "shaders/crossings.glsl"
#endif
#include "shaders/patch_point.glsl"
#include "shaders/leaf_hit.glsl"
#include "shaders/walk.glsl"
#include "shaders/places.glsl"
#include "shaders/normals.glsl"
#include "shaders/environment.glsl"
#include "shaders/light.glsl"
#include "shaders/section.glsl"
#include "shaders/band_pixels.glsl"
#include "shaders/work_counts.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

uint free_ray_count = 0u;

// Has the pixel's rays cast again, alone: the driver's loop limit would have cut them short
void cast_again(uint band_pixel)
{
    stopped[atomicAdd(stopped_count, 1u)] = band_pixel;
}

void tally_free_work()
{
    if (!has_feature(kFeatureCount))
        return;
    tally(kCountNodes, node_visits);
    tally(kCountFreeRays, free_ray_count);
    tally(kCountFreeLeaves, leaf_visits);
    tally(kCountNewton, newton_steps);
    tally(kCountCurves, curve_tests);
}
