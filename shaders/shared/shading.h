// One light at the eye and a little from above, the same on both sides of a face: good enough to read any shape, and
// never black. Colours in linear light.
#if defined(TRIMRAY_SHARED_SHADING_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_SHADING_H
#undef TRIMRAY_SHARED_SHADING_H
#else
#define TRIMRAY_SHARED_SHADING_H
#endif

#include "shaders/shared/language.h"

SHARED_OPEN

const scalar kAmbient = 0.14f;
const scalar kSky = 0.10f;
const scalar kDiffuse = 0.72f;
const scalar kSpecular = 0.12f;

// normal and to_eye unit; up: the world's z of the normal is what the sky lights
FN real3 shade(real3 color, real3 normal, real3 to_eye)
{
    real facing = min(abs(dot(normal, to_eye)), real(1.0f));
    real up = select(dot(normal, to_eye) < 0.0f, -normal.z, normal.z);
    real light = kAmbient + kSky * (0.5f + 0.5f * up) + kDiffuse * facing;
    real f2 = facing * facing;
    real f4 = f2 * f2;
    real f8 = f4 * f4;
    real f16 = f8 * f8;
    real highlight = kSpecular * f16 * f16; // the light is at the eye, so the half vector is the direction to it
    return color * light + real3(highlight, highlight, highlight);
}

// One channel, 0..1: sRGB to linear light (IEC 61966-2-1), for constants
FN scalar linear_of_srgb(scalar c)
{
    return c <= 0.04045f ? c / 12.92f : scalar_pow((c + 0.055f) / 1.055f, 2.4f);
}

// The grey of what has no colour, as sRGB bytes r | g << 8 | b << 16 | a << 24
const uint kDefaultColor = 0xffb4b0acu;

SHARED_CLOSE
#endif
