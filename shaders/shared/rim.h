// Rims: where faces of a closed shell meet at an angle, each reaches beyond the other by what its border was moved
// outwards, and there a ray from outside of the shell could meet its back. Such a hit is no surface. From within a
// shell, and of a face of an open one, backs are seen up to the border.
#if defined(TRIMRAY_SHARED_RIM_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_RIM_H
#undef TRIMRAY_SHARED_RIM_H
#else
#define TRIMRAY_SHARED_RIM_H
#endif

#include "format/pack_layout.h"
#include "shaders/shared/language.h"

SHARED_OPEN

// How near its border a hit may lie in the rim, uv_face. It does if one of the corners so far around it is outside of
// the face: along a border that is straight for so short a way, a point within `width` of it along u and v has one of
// them beyond it. Domain: a face with kFaceRims
FN scalar2 rim_width(uint face_flags)
{
    uint k_u = face_flags >> kFaceRimBit & kFaceRimMask;
    uint k_v = face_flags >> (kFaceRimBit + kFaceRimBits) & kFaceRimMask;
    return scalar2(1.0f / scalar(1u << k_u), 1.0f / scalar(1u << k_v));
}

// The corners (0 to 3) of the rectangle around uv with half sides `width`
const int kCornerCount = 4;
FN real2 corner_around(real2 uv, real2 width, int corner)
{
    return real2(uv.x + ((corner & 1) != 0 ? width.x : -width.x), uv.y + ((corner & 2) != 0 ? width.y : -width.y));
}
FN mask in_domain(real2 uv)
{
    return abs(uv.x - 0.5f) <= 0.5f && abs(uv.y - 0.5f) <= 0.5f;
}

SHARED_CLOSE
#endif
