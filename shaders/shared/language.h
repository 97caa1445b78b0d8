// The common language of the formulas in this folder, which are GLSL and C++ alike.
//
//   name       GLSL     C++
//   scalar     float    float: one value for all rays (a leaf's constants)
//   scalar2, 3 vec2, 3  struct of floats
//   real       float    16 lanes, one a ray, in one AVX-512, two AVX2 or four SSE registers
//   real2, 3   vec2, 3  struct of reals
//   integer    uint     16 lanes of uint32
//   mask       bool     16 lanes
//   select(m, a, b)     m ? a : b, lane by lane; both sides are computed
//   any_lane(m)         m in GLSL; true if any of the 16 lanes is, so `any_lane` may end a loop but not choose a value
//
// C++ that defines TRIMRAY_ONE_RAY before it includes anything has one ray instead of 16 lanes: its types are GLSL's.
//
// A scalar goes wherever a real does. The 16 lanes are the same on every instruction set and nothing is fused or
// approximated, so the CPU tracer gives the same bits on all of them. PRECISE stands before a value that a comparison
// decides on: GLSL must not fuse or reorder it either. No trigonometry on a path that decides: see angle_of.
//
// FN opens a function; FN_LARGE one that C++ must not inline, for it is long and called often.
// STOP_PAST_DEGREES(i); ends a loop that `i` counts up to a degree, for drivers unroll loops whose longest is known
// when they compile; C++ has functions of their own for common degrees (runtime/common_degrees.h). FETCH_PARAM and
// FETCH_PASS carry the source of fetch_* functions: an argument in C++, buffers in GLSL, nothing there.
#if defined(TRIMRAY_SHARED_LANGUAGE_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_LANGUAGE_H
#undef TRIMRAY_SHARED_LANGUAGE_H
#else
#define TRIMRAY_SHARED_LANGUAGE_H
#endif

#ifdef __cplusplus
#ifdef TRIMRAY_ONE_RAY
#include "shaders/shared/language_one_ray.h"
#else
#include "shaders/shared/language_lanes.h"
#endif
#else

#define SHARED_OPEN
#define SHARED_CLOSE
#define FN
#define FN_LARGE
#define PRECISE precise
#define STOP_PAST_DEGREES(i)                                                                                           \
    if (i > int(largest_degree))                                                                                       \
    break
#define FETCH_PARAM
#define FETCH_PASS
#define INOUT_ARRAY(name, count) inout float name[count]
#define scalar float
#define scalar2 vec2
#define scalar3 vec3
#define real float
#define real2 vec2
#define real3 vec3
#define integer uint
#define mask bool

bool any_lane(bool m)
{
    return m;
}
float select(bool m, float a, float b)
{
    return m ? a : b;
}
vec2 select(bool m, vec2 a, vec2 b)
{
    return m ? a : b;
}
vec3 select(bool m, vec3 a, vec3 b)
{
    return m ? a : b;
}
uint select(bool m, uint a, uint b)
{
    return m ? a : b;
}
bool select(bool m, bool a, bool b)
{
    return m ? a : b;
}
bool differ(bool a, bool b)
{
    return a != b;
}
uint to_integer(float x)
{
    return uint(x);
} // x >= 0, cut off
float to_real(uint x)
{
    return float(x);
}
float scalar_pow(float x, float y)
{
    return pow(x, y);
}
float bits_to_scalar(uint bits)
{
    return uintBitsToFloat(bits);
}

#endif

SHARED_OPEN

// 2^-24: half the distance from 1 to its neighbour, the rounding of one operation
const scalar kRounding = 5.9604645e-8f;
const scalar kPi = 3.14159265f;
const scalar kHuge = 1e30f; // beyond every distance; not infinity, so that differences stay numbers

// (x, y, z) of the matrix with these columns times v, and of its transpose times v
FN real3 combine(scalar3 axis_x, scalar3 axis_y, scalar3 axis_z, real3 v)
{
    return real3(axis_x.x * v.x + axis_y.x * v.y + axis_z.x * v.z, axis_x.y * v.x + axis_y.y * v.y + axis_z.y * v.z,
                 axis_x.z * v.x + axis_y.z * v.y + axis_z.z * v.z);
}
FN real3 project(scalar3 axis_x, scalar3 axis_y, scalar3 axis_z, real3 v)
{
    return real3(axis_x.x * v.x + axis_x.y * v.y + axis_x.z * v.z, axis_y.x * v.x + axis_y.y * v.y + axis_y.z * v.z,
                 axis_z.x * v.x + axis_z.y * v.y + axis_z.z * v.z);
}

// The angle of (x, y) in [-pi, pi], within 3e-7; 0 at the origin. Polynomial of atan on [0, tan(pi/8)], as Cephes
// atanf, with one division: atan(a) = pi/4 + atan((a - 1) / (a + 1)).
FN real angle_of(real x, real y)
{
    PRECISE real ax = abs(x);
    PRECISE real ay = abs(y);
    PRECISE real small = min(ax, ay);
    PRECISE real large = max(ax, ay);
    mask upper = small > 0.41421356f * large;
    PRECISE real numerator = select(upper, small - large, small);
    PRECISE real denominator = select(upper, small + large, large);
    PRECISE real a = numerator / select(denominator > 0.0f, denominator, real(1.0f));
    PRECISE real z = a * a;
    PRECISE real p = ((8.05374449538e-2f * z - 1.38776856032e-1f) * z + 1.99777106478e-1f) * z - 3.33329491539e-1f;
    PRECISE real angle = p * z * a + a;
    angle = select(upper, 0.78539816f + angle, angle);
    angle = select(ay > ax, 1.57079633f - angle, angle);
    angle = select(x < 0.0f, kPi - angle, angle);
    return select(y < 0.0f, -angle, angle);
}

SHARED_CLOSE
#endif
