// Normals of patches, and their way into the world. Included once per target.
#if defined(TRIMRAY_PATCH_NORMAL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_PATCH_NORMAL_H
#undef TRIMRAY_PATCH_NORMAL_H
#else
#define TRIMRAY_PATCH_NORMAL_H
#endif

#include "format/pack_layout.h"
#include "runtime/cpu_view.h"
#include "shaders/shared/bezier.h"
#include "shaders/shared/language.h"

SHARED_OPEN

/// S_u x S_v at uv, where the patch's point is s, for the lanes `asked`; beyond a side the one at the side, and at
/// a pole or along a degenerate side the one a little way inside.
template <class EvaluateAt>
FN real3 bezier_normal(EvaluateAt evaluate, SurfacePoint s, real2 uv, mask asked)
{
    const real2 within(clamp(uv.x, real(0.0f), real(1.0f)), clamp(uv.y, real(0.0f), real(1.0f)));
    // beyond a side that is one point the patch is turned inside out
    const mask beyond = asked && !(within.x == uv.x && within.y == uv.y);
    if (any_lane(beyond)) {
        const SurfacePoint side = evaluate(within);
        s.du = select(beyond, side.du, s.du);
        s.dv = select(beyond, side.dv, s.dv);
    }
    const real3 normal = cross(s.du, s.dv);
    const mask flat = dot(normal, normal) <= 1e-10f * dot(s.du, s.du) * dot(s.dv, s.dv) ||
                      dot(s.du, s.du) <= 1e-10f * dot(s.dv, s.dv) || dot(s.dv, s.dv) <= 1e-10f * dot(s.du, s.du);
    if (!any_lane(asked && flat))
        return normal;
    constexpr float kInwards = 1.0f / 2048;
    const SurfacePoint inside = evaluate(within + real2(0.5f - within.x, 0.5f - within.y) * real(kInwards));
    return select(flat, cross(inside.du, inside.dv), normal);
}

/// 1, or -1 where the outward normal is opposite to the patch's S_u x S_v in right-handed axes.
static inline float outward_turn(const CpuScene& scene, uint patch_id)
{
    const FaceRecord& face = scene.image.faces[scene.image.patches[patch_id].face];
    return ((face.flags & kFaceReversed) != 0) != (scene.left_handed[patch_id] != 0) ? -1.0f : 1.0f;
}

FN real3 to_world(const float (&m)[3][3], real3 n)
{
    return real3(m[0][0] * n.x + m[0][1] * n.y + m[0][2] * n.z, m[1][0] * n.x + m[1][1] * n.y + m[1][2] * n.z,
                 m[2][0] * n.x + m[2][1] * n.y + m[2][2] * n.z);
}

SHARED_CLOSE
#endif
