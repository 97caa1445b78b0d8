// The records of the kd-tree baseline, declared once for C++ and GLSL. They are built at load and are in no pack.
//
// A face's tree divides [0,1)^2 of its uv_face by planes of constant u or v down to leaves that are out, in, or crossed
// by runs. A run is a stretch of consecutive pieces of one loop, all lines or all cubics, monotone together: v never
// falls along it, and u does not turn. Consecutive pieces share their end, so a run of n pieces has n + 1 points or
// 3 n + 1. A leaf's runs hold every piece that meets the leaf's rectangle. A ray from q = (u, v) along +u ends at the
// rectangle's right side; the class there is the leaf's, where the runs that leave through that side are thought to go
// on vertically from their end beyond it:
//   inside = leaf's class  XOR over its runs of  crossed(run)
//   crossed(run) = v < va ? goes on below : v >= vb ? goes on above : u < P(v)       (ends (ua, va), (ub, vb), va <=
//   vb)
#ifndef TRIMRAY_KD_LAYOUT_H
#define TRIMRAY_KD_LAYOUT_H

#include "format/pack_layout.h"

#ifdef __cplusplus
namespace trimray {
#endif

// Node word: kind | kKdInside | number << 3. Children lie side by side: the second takes what is on the plane.
TRIMRAY_CONST uint kKdSplitU = 0u;   // number: first child;    data: the plane, a float
TRIMRAY_CONST uint kKdSplitV = 1u;   // likewise
TRIMRAY_CONST uint kKdLeafRun = 2u;  // number: pieces of its only run, 0: none;    data: that run's word
TRIMRAY_CONST uint kKdLeafRuns = 3u; // number: runs;    data: the first of them
TRIMRAY_CONST uint kKdKindMask = 3u;
TRIMRAY_CONST uint kKdLeaf = 2u; // set in both kinds of leaf
TRIMRAY_CONST uint kKdInside = 4u;
TRIMRAY_CONST uint kKdNumberShift = 3u;
TRIMRAY_CONST uint kMaxKdDepth = 48u; // nodes on a path from root to leaf

// Run word: first point << 3 | flags
TRIMRAY_CONST uint kKdRunCubic = 1u;
TRIMRAY_CONST uint kKdRunBelow = 2u; // goes on below its lower end
TRIMRAY_CONST uint kKdRunAbove = 4u; // goes on above its upper end
TRIMRAY_CONST uint kKdPointShift = 3u;

struct KdNode {
    uint word;
    uint data;
};

struct KdRun {
    uint word;
    uint piece_count;
};

// Where a face's tree lies; all its numbers are relative to these.
struct KdFace {
    uint first_node; // the root
    uint first_run;
    uint first_point;
};

#ifdef __cplusplus
static_assert(sizeof(KdNode) == 8);
static_assert(sizeof(KdRun) == 8);
static_assert(sizeof(KdFace) == 12);
} // namespace trimray
#endif

#endif
