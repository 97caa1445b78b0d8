// The C++ side of language.h for one ray: a real is a float, as in GLSL. For a translation unit that defines
// TRIMRAY_ONE_RAY; all that it makes of the shared formulas is in the namespace one_ray.
#ifndef TRIMRAY_SHARED_LANGUAGE_ONE_RAY_H
#define TRIMRAY_SHARED_LANGUAGE_ONE_RAY_H

#include <cstddef>
#include <cstdint>
#include <cstring>

#define SHARED_OPEN                                                                                                    \
    namespace trimray {                                                                                                \
    namespace one_ray {
#define SHARED_CLOSE                                                                                                   \
    }                                                                                                                  \
    }
#define FN [[maybe_unused]] static inline __attribute__((always_inline))
#define FN_LARGE [[maybe_unused]] static __attribute__((noinline))
#define PRECISE // the C++ side is compiled with -ffp-contract=off
#define STOP_PAST_DEGREES(i)
#define FETCH_PARAM const FetchSource &source,
#define FETCH_PASS source,
#define INOUT_ARRAY(name, count) real(&name)[count]

SHARED_OPEN

using uint = std::uint32_t;
using scalar = float;
using real = float;
using integer = uint;
using mask = bool;

struct real2 {
    real x, y;
    real2() = default;
    constexpr real2(real x_, real y_) : x(x_), y(y_) {}
};
struct real3 {
    real x, y, z;
    real3() = default;
    constexpr real3(real x_, real y_, real z_) : x(x_), y(y_), z(z_) {}
};
using scalar2 = real2;
using scalar3 = real3;

FN bool any_lane(mask m)
{
    return m;
}
FN mask differ(mask a, mask b)
{
    return a != b;
}
FN real select(mask m, real a, real b)
{
    return m ? a : b;
}
FN integer select(mask m, integer a, integer b)
{
    return m ? a : b;
}
FN mask select(mask m, mask a, mask b)
{
    return m ? a : b;
}
FN real2 select(mask m, real2 a, real2 b)
{
    return m ? a : b;
}
FN real3 select(mask m, real3 a, real3 b)
{
    return m ? a : b;
}

FN real abs(real a)
{
    return __builtin_fabsf(a);
}
FN real sqrt(real a)
{
    return __builtin_sqrtf(a);
}
FN real floor(real a)
{
    return __builtin_floorf(a);
}
// of NaN and a number: the second argument, as of lanes
FN real min(real a, real b)
{
    return a < b ? a : b;
}
FN real max(real a, real b)
{
    return b < a ? a : b;
}
FN integer min(integer a, integer b)
{
    return a < b ? a : b;
}
FN integer max(integer a, integer b)
{
    return a > b ? a : b;
}
FN real clamp(real x, real lo, real hi)
{
    return min(max(x, lo), hi);
}
FN scalar scalar_pow(scalar x, scalar y)
{
    return __builtin_powf(x, y);
}
FN real gather(const float* base, integer index)
{
    return base[index];
}
FN integer gather(const uint* base, integer index)
{
    return base[index];
}
FN integer gather_bytes(const uint* base, integer at)
{
    integer word;
    std::memcpy(&word, reinterpret_cast<const unsigned char*>(base) + at, sizeof word);
    return word;
}
FN scalar bits_to_scalar(uint bits)
{
    scalar x;
    std::memcpy(&x, &bits, sizeof x);
    return x;
}

FN real2 operator+(real2 a, real2 b)
{
    return real2(a.x + b.x, a.y + b.y);
}
FN real2 operator-(real2 a, real2 b)
{
    return real2(a.x - b.x, a.y - b.y);
}
FN real2 operator*(real2 a, real b)
{
    return real2(a.x * b, a.y * b);
}
FN real3 operator+(real3 a, real3 b)
{
    return real3(a.x + b.x, a.y + b.y, a.z + b.z);
}
FN real3 operator-(real3 a, real3 b)
{
    return real3(a.x - b.x, a.y - b.y, a.z - b.z);
}
FN real3 operator*(real3 a, real b)
{
    return real3(a.x * b, a.y * b, a.z * b);
}
FN real3 operator*(real a, real3 b)
{
    return b * a;
}
FN real dot(real2 a, real2 b)
{
    return a.x * b.x + a.y * b.y;
}
FN real dot(real3 a, real3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
FN real3 cross(real3 a, real3 b)
{
    return real3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
FN real length(real2 a)
{
    return sqrt(dot(a, a));
}
FN real length(real3 a)
{
    return sqrt(dot(a, a));
}

SHARED_CLOSE
#endif
