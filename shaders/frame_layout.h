// What passes between the host and the shaders beside the pack's own arrays: the view, the instances seen from it, a
// pixel's result and the work counts. Scalar block layout, 4-byte fields.
//
// Pixel (x, y) looks along w = w0 + dx step_x + dy step_y, where dx, dy are pixels from the picture's middle and
// |w0| = 1 in the world; a point of its ray is eye + tau w in every space, and its distance is tau |w in the world|
// (shaders/shared/precision.h).
#ifndef TRIMRAY_FRAME_LAYOUT_H
#define TRIMRAY_FRAME_LAYOUT_H

#include "format/pack_layout.h"

#ifdef __cplusplus
namespace trimray {
#endif

// Push constants. Vectors are the world's; the top tree's ray is top_origin + (tau - top_tau) w0 / world_scale + ...
struct FrameView {
    float top_origin[3]; // eye + top_tau w0, in the top tree's units: the part of the view's axis near the scene
    float top_tau;
    float per_world_scale; // the top tree's units per mm
    float w0[3];
    float step_x[3];
    float step_y[3];
    float middle[2]; // dx = x + 0.5 - middle
    uint width;
    uint height;    // of the whole picture
    uint first_row; // of this band
    uint row_count;
    float error_px;      // Newton stops at this share of a pixel's footprint
    float tau_ref;       // mm; hits are kept relative to it
    float line_width_px; // of lines along borders; the rest as in EdgeQuery (runtime/frame_effects.h)
    float line_reach_px;
    float border_reach_px;
    uint line_classes; // bit kEdge...
    float start[2];    // with kFeatureStochastic: start_of_frame (runtime/stochastic_frames.h)
    uint alone;        // 1: each workgroup traces pixel retries[workgroup] of the band, with one of its invocations
    // of primary.comp and blend.comp: the layer's number; of mirror.comp: the reflection's;
    // of light.comp: what is gathered, a light's number or kGatherSky, and samples [first_sample, end_sample) of it; of
    // caps.comp: the question's number.
    // With kFeatureLate the samples are kFeature bits, and kMap | kTrimBy << 8
    uint gathered;
    uint first_sample;
    uint end_sample;
};

// An instance seen from the eye, in its part's units.
struct FrameInstance {
    float eye_hi[3]; // eye = hi + lo
    float eye_lo[3];
    float w0_hi[3];
    float w0_lo[3];
    float step_x[3];
    float step_y[3];
    // the part of the ray near the part: node_origin + (tau - node_tau) w, node_origin = eye + node_tau w0
    float node_origin[3];
    float node_tau;
    float normal_x[3]; // world normal = columns (normal_x, normal_y, normal_z) times the part's; inverse transpose
    float normal_y[3];
    float normal_z[3];
    float footprint; // a pixel's width at tau = 1, part units
    uint first_node; // of the part, in all parts' nodes
    uint first_leaf;
    uint color_rgba; // sRGB bytes; alpha 0: the default
    uint outside;    // 1: rims of the part's faces show no backs (seen_from_outside)
};

struct FramePixel {
    float depth_mm; // along the ray; kNoDepth: a miss
    float normal[3];
    float uv_face[2];
    uint face;
    uint instance;
    uint status; // kPixel flags
    float rgba[4];
};
TRIMRAY_CONST uint kPixelHit = 1u;
TRIMRAY_CONST uint kPixelCertified = 2u;
TRIMRAY_CONST uint kPixelStopped = 4u; // the driver's loop limit was near, so the walk was ended

// What a pixel keeps from frame to frame: Hit (shaders/leaf_hit.glsl)
struct KeptHit {
    float past; // kHuge: none yet
    float t;
    float uv_face[2];
    float uv_patch[2];
    uint leaf;
    uint instance;
};

// What a picture leaves for the next one to begin from (shaders/last_hits.glsl)
struct LastHit {
    float point[3]; // the top tree's units; only hints at where to look
    uint leaf;      // kNoLeaf: the ray met nothing, or there was no picture
    uint instance;
};
TRIMRAY_CONST uint kNoLeaf = 0xffffffffu;

// What is drawn on surfaces (SurfaceMap, runtime/scene_look.h; surface_map.cpp checks that they are the same numbers)
TRIMRAY_CONST uint kMapNone = 0u;
TRIMRAY_CONST uint kMapZebra = 1u;
TRIMRAY_CONST uint kMapIsophotes = 2u;
TRIMRAY_CONST uint kMapGaussian = 3u;
TRIMRAY_CONST uint kMapMean = 4u;
TRIMRAY_CONST uint kMapLarger = 5u;
TRIMRAY_CONST uint kMapSmaller = 6u;
TRIMRAY_CONST uint kMapDraft = 7u;

// A map's settings.
struct MapView {
    float direction[3]; // unit, world
    float stripes;      // pairs of bands over half a turn
    float per_range;    // a curvature's colour is at value * per_range - range_middle of the scale from -1 to 1
    float range_middle;
    float draft; // radians
};

// Sums over a frame as pairs of words, low word first; kCount is the pair.
TRIMRAY_CONST uint kCountRays = 0u;
TRIMRAY_CONST uint kCountNodes = 1u;
TRIMRAY_CONST uint kCountLeaves = 2u;
TRIMRAY_CONST uint kCountNewton = 3u;
TRIMRAY_CONST uint kCountCurves = 4u;
TRIMRAY_CONST uint kCountEdges = 5u;
TRIMRAY_CONST uint kCountFreeRays = 6u;
TRIMRAY_CONST uint kCountFreeLeaves = 7u;
TRIMRAY_CONST uint kFrameCounts = 8u;

// Specialisation constants of the shaders, by constant_id
TRIMRAY_CONST uint kSpecTrimMode = 0u; // kTrimBy
TRIMRAY_CONST uint kSpecKinds = 1u;    // bit kKind...: the pack holds such patches
TRIMRAY_CONST uint kSpecFeatures = 2u; // kFeature bits
TRIMRAY_CONST uint kSpecStackSize = 3u;
TRIMRAY_CONST uint kSpecLocalFloats = 4u; // control points are copied into an array of so many floats; 0: they are not
TRIMRAY_CONST uint kSpecIterationLimit = 5u; // loop iterations a subgroup may run; 0: no limit
TRIMRAY_CONST uint kSpecMap = 6u;            // kMap
TRIMRAY_CONST uint kSpecDegreeU = 7u;        // of all Bezier patches; 0: they differ
TRIMRAY_CONST uint kSpecDegreeV = 8u;
TRIMRAY_CONST uint kSpecLargestDegree = 9u; // ... in either direction
TRIMRAY_CONST uint kFrameSpecs = 10u;

TRIMRAY_CONST uint kTrimByCells = 0u;
TRIMRAY_CONST uint kTrimByTexture = 1u;
TRIMRAY_CONST uint kTrimByBoth = 2u; // the cell's class, the texture outside its band, the pieces inside
TRIMRAY_CONST uint kTrimByKd = 3u;

TRIMRAY_CONST uint kFeatureTrims = 1u;    // some face has trims
TRIMRAY_CONST uint kFeatureRational = 2u; // some Bezier patch is rational
TRIMRAY_CONST uint kFeatureShade = 4u;
TRIMRAY_CONST uint kFeatureCount = 8u;       // work counts are wanted
TRIMRAY_CONST uint kFeatureEdges = 16u;      // edge words of each pixel are wanted
TRIMRAY_CONST uint kFeatureRims = 32u;       // some face has a rim
TRIMRAY_CONST uint kFeatureStochastic = 64u; // ClosestPolicy::Stochastic
TRIMRAY_CONST uint kFeatureKept = 128u;      // ... in more frames than one
TRIMRAY_CONST uint kFeatureReuse = 256u;     // RenderOptions::reuse_last

TRIMRAY_CONST uint kFeatureLights = 512u; // SceneLook's lights: the pixels' LitPixels are kept
TRIMRAY_CONST uint kFeatureCut = 1024u;   // SceneLook's section planes
TRIMRAY_CONST uint kFeatureMaterials = 2048u;
TRIMRAY_CONST uint kFeatureLayers = 4096u; // some material lets light through
TRIMRAY_CONST uint kFeatureMirrors = 8192u;
TRIMRAY_CONST uint kFeatureEnvironment = 16384u;
// Camera::orthographic_mm: pixel (x, y) looks along w0 from eye + dx step_x + dy step_y, steps in mm
TRIMRAY_CONST uint kFeatureParallel = 32768u;

// primary.comp is not specialised to what the view's samples say (RenderOptions::specialise)
TRIMRAY_CONST uint kFeatureLate = 0x80000000u;

TRIMRAY_CONST uint kGatherSky = 0xffffffffu; // FrameView::gathered, of light.comp
TRIMRAY_CONST uint kBlendAll = 0xffffffffu;  // ... of blend.comp: all layers are there

TRIMRAY_CONST uint kGroupSide = 8u; // workgroups are 8 x 8 pixels

// Bindings of the shaders. What neither the pack nor the picture has is not there: nothing is bound in its place
TRIMRAY_CONST uint kBindInstances = 0u;
TRIMRAY_CONST uint kBindTopNodes = 1u;
TRIMRAY_CONST uint kBindPartNodes = 2u;
TRIMRAY_CONST uint kBindLeaves = 3u;
TRIMRAY_CONST uint kBindPatches = 4u;
TRIMRAY_CONST uint kBindControlPoints = 5u;
TRIMRAY_CONST uint kBindFaces = 6u;
TRIMRAY_CONST uint kBindCells = 7u;
TRIMRAY_CONST uint kBindCellEntries = 8u;
TRIMRAY_CONST uint kBindTrimPoints = 9u;
TRIMRAY_CONST uint kBindSdfWords = 10u;
TRIMRAY_CONST uint kBindPixels = 11u;
TRIMRAY_CONST uint kBindCounts = 12u;
TRIMRAY_CONST uint kBindRetries = 13u;
TRIMRAY_CONST uint kBindBorders = 14u; // BorderCells (runtime/border_cells.h)
TRIMRAY_CONST uint kBindEdges = 15u;   // two edge words a pixel: line, border
TRIMRAY_CONST uint kBindKdNodes = 16u;
TRIMRAY_CONST uint kBindKdRuns = 17u;
TRIMRAY_CONST uint kBindKdPoints = 18u;
TRIMRAY_CONST uint kBindKdFaces = 19u;
TRIMRAY_CONST uint kBindKept = 20u; // a KeptHit a pixel of the picture
// a LastHit a pixel of the picture
TRIMRAY_CONST uint kBindLastHits = 21u;    // the last picture's
TRIMRAY_CONST uint kBindNextHits = 22u;    // this one's, for the next
TRIMRAY_CONST uint kBindLook = 23u;        // LookFrame and light samples (look_layout.h)
TRIMRAY_CONST uint kBindToPart = 24u;      // a WorldToPart an instance
TRIMRAY_CONST uint kBindLitPixels = 25u;   // a LitPixel a pixel of the band
TRIMRAY_CONST uint kBindStopped = 26u;     // pixels of the band to cast free rays from again: how many, and which
TRIMRAY_CONST uint kBindCaps = 27u;        // a CapState a pixel of the band
TRIMRAY_CONST uint kBindMapValues = 28u;   // a float a pixel of the band, where a map measures
TRIMRAY_CONST uint kBindMaterials = 29u;   // MaterialHead and what it names (material_layout.h)
TRIMRAY_CONST uint kBindEnvironment = 30u; // width, height, 3 floats a pixel
TRIMRAY_CONST uint kBindPaths = 31u;       // a PathState a pixel of the band
TRIMRAY_CONST uint kFrameBindings = 32u;   // what common drivers allow

#ifdef __cplusplus
static_assert(sizeof(FrameView) == 128); // what every device takes
static_assert(sizeof(FrameInstance) == 144);
static_assert(sizeof(FramePixel) == 52);
static_assert(sizeof(KeptHit) == 32);
static_assert(sizeof(LastHit) == 20);
static_assert(sizeof(MapView) == 28);
} // namespace trimray
#endif

#endif
