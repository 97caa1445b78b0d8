// Where Newton's iterates may go, and how rounding moves a patch: what the tracers do and what is proved about a leaf
// (format/leaf_bend.h) share.
#if defined(TRIMRAY_SHARED_NEWTON_REACH_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_NEWTON_REACH_H
#undef TRIMRAY_SHARED_NEWTON_REACH_H
#else
#define TRIMRAY_SHARED_NEWTON_REACH_H
#endif

#include "shaders/shared/language.h"

SHARED_OPEN

// How far Newton's iterates may leave the leaf that they started in, in half sides from its middle: farther roots are
// other leaves' to find. And how far they may leave the patch, in uv_patch: a rational patch has poles outside.
const scalar kNewtonReach = 2.0f;
const scalar kNewtonOutside = 0.03125f;

// How far across the ray a point of a patch may lie from where it should, patch units, |q| <= 1: its control points are
// rounded to 2^-22 (2^-23 off at most), each of the degree_u + degree_v levels of its evaluation rounds twice, and a
// ray's plane four times; in two directions across.
FN scalar patch_rounding(int degree_u, int degree_v)
{
    return 1.4142136f * (2.0f + 2.0f * scalar(degree_u + degree_v) + 4.0f) * kRounding;
}

// What a certificate leaves open: whatever changes where a ray is moved by so many pixels, and a depth by so many of
// the hit's footprints, a pixel's width there.
const scalar kHairPx = 1e-3f;
const scalar kDepthPx = 0.1f;

// A rectangle's bend and noise below which it holds one root at most, with room for their own rounding
const scalar kOneRoot = 0.99f;

// What single precision loses of S_u, or S_v, of that degree in the reach of a leaf [lo, hi], length in the plane or
// across it. A bound is `most`, the whole patch's (PatchRecord::param). Where two points of the net meet at the share
// t, neither is heavier than the surface there by more than 1 / t or 1 / (1 - t): another is as much of what is lost
// between equal weights. The reach of a leaf that begins at lo > 0 begins at lo / 2 at least. of_point: patch_rounding.
FN scalar loss_of(scalar most, scalar of_point, int degree, scalar lo, scalar hi)
{
    scalar beside = max(0.5f * min(lo, 1.0f - hi), 1e-6f);
    return min(most, 4.0f * of_point * scalar(degree) / beside);
}

SHARED_CLOSE
#endif
