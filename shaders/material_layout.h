// What faces are made of (runtime/materials.h), and what is kept of a pixel whose light comes from several surfaces.
// Scalar block layout, 4-byte fields.
#ifndef TRIMRAY_MATERIAL_LAYOUT_H
#define TRIMRAY_MATERIAL_LAYOUT_H

#include "format/pack_layout.h"

#ifdef __cplusplus
namespace trimray {
#endif

struct MaterialRecord {
    float color[3];  // linear light
    float has_color; // 1; 0: the pack's colour
    float opacity;   // [0, 1]
    float mirror;    // [0, 1]
    float specular;  // [0, 1]
    float reserved;  // zero
};

// The buffer of a MaterialTable: this head, its materials, and from the words that the head names its arrays
struct MaterialHead {
    uint face_classes;
    uint of_classes; // words from the buffer's begin
    uint instance_class;
    uint face_class;
};

// Along a pixel's ray through surfaces that let light through, and through mirrors from each of them
struct PathState {
    float begin;       // `past` where the next layer may begin; kHuge: there is none
    float left;        // share of what lies behind
    float layers[3];   // what has arrived from layers so far
    float mirror;      // of the surface at hand
    float weight;      // share of what the mirrors at hand show
    float mirrored[3]; // what has arrived through mirrors of the layer at hand
};

TRIMRAY_CONST float kLeastLeft = 0.0009765625f; // what shines through less is not followed
TRIMRAY_CONST uint kMostLayers = 256u;

#ifdef __cplusplus
static_assert(sizeof(MaterialRecord) == 32);
static_assert(sizeof(MaterialHead) == 16);
static_assert(sizeof(PathState) == 40);
} // namespace trimray
#endif

#endif
