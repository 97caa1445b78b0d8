// From a patch's parameters to its face's. Included once per target.
#if defined(TRIMRAY_FACE_UV_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_FACE_UV_H
#undef TRIMRAY_FACE_UV_H
#else
#define TRIMRAY_FACE_UV_H
#endif

#include "format/pack_layout.h"
#include "shaders/shared/language.h"

SHARED_OPEN

/// But for the torus' second angle, which is not unwrapped.
FN real2 face_uv(const PatchRecord& patch, real2 uv_patch)
{
    return real2(patch.uv_offset[0] + patch.uv_scale[0] * uv_patch.x,
                 patch.uv_offset[1] + patch.uv_scale[1] * uv_patch.y);
}

/// Of a torus: its v is unwrapped upwards (pack_layout.h).
FN real2 unwrapped(const PatchRecord& torus, real2 uv)
{
    const float half_turn = kPi * torus.uv_scale[1];
    return real2(uv.x, select(uv.y < 0.5f - half_turn, uv.y + 2.0f * half_turn, uv.y));
}

/// Whether a hit belongs to its face's domain.
FN mask in_slack_domain(real2 uv)
{
    return abs(uv.x - 0.5f) <= 0.5f + kDomainSlack && abs(uv.y - 0.5f) <= 0.5f + kDomainSlack;
}

FN real2 clamp_to_domain(real2 uv)
{
    return real2(clamp(uv.x, real(0.0f), real(kUvBelowOne)), clamp(uv.y, real(0.0f), real(kUvBelowOne)));
}

SHARED_CLOSE
#endif
