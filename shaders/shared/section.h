// Section planes against rays, and how their caps look.
#if defined(TRIMRAY_SHARED_SECTION_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_SECTION_H
#undef TRIMRAY_SHARED_SECTION_H
#else
#define TRIMRAY_SHARED_SECTION_H
#endif

#include "shaders/section_layout.h"
#include "shaders/shared/language.h"

SHARED_OPEN

// What of a ray is left: [begin, end], and which plane it begins at
struct CutSpan {
    real begin;
    real end;
    integer plane; // kNoPlane: none
};
const uint kNoPlane = 0xffffffffu;

// The span where also height + rise s <= 0 holds
FN CutSpan cut_by(CutSpan span, real height, real rise, uint plane)
{
    real s = -height / select(abs(rise) > 0.0f, rise, real(1.0f));
    mask enters = rise < 0.0f && s > span.begin;
    mask outside = !(abs(rise) > 0.0f) && height > 0.0f;
    CutSpan left;
    left.begin = select(enters, s, span.begin);
    left.plane = select(enters, integer(plane), span.plane);
    left.end = select(rise > 0.0f, min(s, span.end), select(outside, real(-kHuge), span.end));
    return left;
}

// Where a ray that begins in what is left leaves it, if that is before `reach`
FN real cut_reach(real height, real rise, real reach)
{
    return select(rise > 0.0f, min(max(-height, real(0.0f)) / max(rise, real(1e-20f)), reach), reach);
}

// Directions that are asked whether a point is inside: no two opposite, none along an axis, a diagonal or in a
// coordinate plane, where models have their faces
FN scalar3 inside_direction(uint question)
{
    return question == 1u ? scalar3(0.8427f, -0.4613f, 0.2776f) : scalar3(-0.3179f, 0.5541f, -0.7694f);
}

const scalar kHatchDarkens = 0.7f; // share of a cap's colour that a hatch takes

// How much of a hatch there is at (x, y), 0 to 1: lines at a distance of 1 from each other, a fifth of it wide, at 45
// degrees one way or the other. `width`: a pixel's
FN real hatch_at(real x, real y, mask other_way, real width)
{
    real along = (x + select(other_way, -y, y)) * 0.70710678f;
    real off = abs(along - floor(along) - 0.5f); // from the middle between two lines
    real edge = (off - 0.4f) / max(width, real(1e-6f)) + 0.5f;
    real line = clamp(edge, real(0.0f), real(1.0f));
    // lines that are too close to be told apart are as dark as they are on average
    real blurred = clamp(4.0f * width - 1.0f, real(0.0f), real(1.0f));
    return line + (0.2f - line) * blurred;
}

SHARED_CLOSE
#endif
