// What lights, occlusion, mirrors and caps need of a frame, made by the host for both tracers (runtime/light_view.h).
// Scalar block layout, 4-byte fields. Rays that do not begin at the eye live in the top tree's units (the world's
// origin and scale as the pack has them), so nothing depends on the model's unit; in all of them s counts such units.
#ifndef TRIMRAY_LIGHT_LAYOUT_H
#define TRIMRAY_LIGHT_LAYOUT_H

#include "format/pack_layout.h"

#ifdef __cplusplus
namespace trimray {
#endif

TRIMRAY_CONST uint kTurns = 16u; // samples are turned by pixel, alike in every 4 x 4

// Where hits of the eye's rays are.
struct PlaceView {
    // a hit at `past` (mm of tau - tau_ref) on the ray of pixel (x, y) from the picture's middle lies at
    // place + x place_x + y place_y + past (along + x along_x + y along_y)
    float place[3];
    float place_x[3];
    float place_y[3];
    float along[3];
    float along_x[3];
    float along_y[3];
    float tau_ref; // mm
    float pixel;   // a pixel's width where tau is 1 mm
    float per_mm;  // the top tree's units
};

struct LightView {
    float error_px;
    uint light_count;
    uint light_samples;
    uint occlusion_samples;
    float occlusion_reach; // kHuge: no bound
    uint mirror_depth;
    float sky;           // strength of the light from all around
    float background[3]; // what rays that meet nothing see in mirrors
    float turn_cos[16];  // of each of kTurns
    float turn_sin[16];
};

TRIMRAY_CONST uint kMostLights = 16u;

// LightRecord::kind, and kLightShadows beside it
TRIMRAY_CONST uint kLightEye = 0u;
TRIMRAY_CONST uint kLightDirectional = 1u;
TRIMRAY_CONST uint kLightPoint = 2u;
TRIMRAY_CONST uint kLightShadows = 4u;
TRIMRAY_CONST uint kLightSoft = 8u; // many rays, to points of a disc around it

struct LightRecord {
    uint kind;
    float place[3]; // Directional: unit, towards the light; Point: where it is
    float radius;   // of its disc, at distance 1 (Directional) or where it is (Point)
    float color[3]; // linear
};

// Where a ray in the top tree's units is in a part's: row . (p - centre of the part)
struct WorldToPart {
    float row_x[3];
    float row_y[3];
    float row_z[3];
    float offset[3]; // of the top tree's origin, part units
    float scale;     // part units per unit of the top tree
};

// A hit as lights find it, kept while its light is gathered.
struct LitPixel {
    float place[3];
    float normal[3]; // unit, on the eye's side
    float to_eye[3]; // unit
    float color[3];
    float specular;
    float pixel; // a pixel's width there; 0: the ray met nothing
};

#ifdef __cplusplus
static_assert(sizeof(LitPixel) == 56);
static_assert(sizeof(PlaceView) == 84);
static_assert(sizeof(LightView) == 4 * 42);
static_assert(sizeof(LightRecord) == 32);
static_assert(sizeof(WorldToPart) == 52);
} // namespace trimray
#endif

#endif
