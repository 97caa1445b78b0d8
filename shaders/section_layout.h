// The section planes of a frame, made by the host for both tracers (runtime/section_view.h). Scalar block layout,
// 4-byte fields. What lies where a plane's height is above 0 is cut away.
#ifndef TRIMRAY_SECTION_LAYOUT_H
#define TRIMRAY_SECTION_LAYOUT_H

#include "format/pack_layout.h"

#ifdef __cplusplus
namespace trimray {
#endif

TRIMRAY_CONST uint kMostSectionPlanes = 6u;

struct SectionPlaneView {
    // the height of a point of pixel (x, y)'s ray at `past` is at + x at_x + y at_y + past (rise + x rise_x + y rise_y)
    float at;
    float at_x;
    float at_y;
    float rise;
    float rise_x;
    float rise_y;
    float normal[3]; // unit, world
    float offset;    // the top tree's units: the height of a point p is normal . p - offset
    float across[3]; // unit, along the plane; hatches count along these
    float along[3];
};

struct SectionView {
    uint count;
    uint caps; // CapStyle
    uint has_color;
    float color[3]; // of caps, linear
    float hatch;    // distance of hatches, the top tree's units
    SectionPlaneView planes[6];
};
TRIMRAY_CONST uint kCapsNone = 0u;
TRIMRAY_CONST uint kCapsFilled = 1u;
TRIMRAY_CONST uint kCapsHatched = 2u;

// A cap's pixel has face kCapFace - its plane's number, as a signed number -2, -3, ...
TRIMRAY_CONST uint kCapFace = 0xfffffffeu;

// A surface that a ray crosses: the instance << 1, and 1 where it leaves
TRIMRAY_CONST uint kCrossingLeaves = 1u;
TRIMRAY_CONST uint kMostCrossings = 48u; // of one ray; with more, what is inside is not certain

TRIMRAY_CONST uint kInsideQuestions = 3u; // directions that are asked whether a point is inside, the last where the
                                          // first two disagree

TRIMRAY_CONST uint kCapUnsure = 8u;

// What is known of a pixel's cap while caps.comp asks its questions
struct CapState {
    uint inside;   // bit i: question i said so; kCapUnsure: a ray crossed more than kMostCrossings
    uint instance; // whose inside it is, and the leaf that the ray leaves it through; kNoLeaf: not known
    uint leaf;
};

#ifdef __cplusplus
static_assert(sizeof(CapState) == 12);
static_assert(sizeof(SectionPlaneView) == 64);
static_assert(sizeof(SectionView) == 28 + 6 * 64);
} // namespace trimray
#endif

#endif
