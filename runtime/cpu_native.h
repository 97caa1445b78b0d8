// Derivatives of native surfaces by their kind, for the CPU tracer. Included once per target.
#if defined(TRIMRAY_CPU_NATIVE_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_CPU_NATIVE_H
#undef TRIMRAY_CPU_NATIVE_H
#else
#define TRIMRAY_CPU_NATIVE_H
#endif

#include "format/pack_layout.h"
#include "shaders/shared/derivatives.h"
#include "shaders/shared/language.h"
#include "shaders/shared/torus.h"

SHARED_OPEN

/// At p of patch space, by uv_patch.
FN Derivatives native_derivatives(const PatchRecord& patch, real3 p)
{
    const scalar r = patch.param[0], second = patch.param[1];
    switch (patch.shape & 0xffu) {
    case kKindCylinder:
        return cylinder_derivatives(p);
    case kKindCone:
        return cone_derivatives(r, second, p);
    case kKindSphere:
        return sphere_derivatives(p);
    case kKindTorus:
        return torus_derivatives(r, torus_side(r, second, p), p);
    default:
        return plane_derivatives();
    }
}

SHARED_CLOSE
#endif
