// Where a direction looks in an equirectangular picture: the row's middle along +x, its right half turning to -y, the
// top row at +z.
#if defined(TRIMRAY_SHARED_ENVIRONMENT_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_ENVIRONMENT_H
#undef TRIMRAY_SHARED_ENVIRONMENT_H
#else
#define TRIMRAY_SHARED_ENVIRONMENT_H
#endif

#include "shaders/shared/language.h"

SHARED_OPEN

// The four texels around, column + width * row, and how they are blended: a, b are in one row, c, d in the next
struct EnvironmentTexels {
    integer a;
    integer b;
    integer c;
    integer d;
    real across; // weight of b and d
    real down;   // weight of c and d
};

// Domain: width, height >= 1
FN EnvironmentTexels environment_texels(real3 direction, uint width, uint height)
{
    real level = sqrt(direction.x * direction.x + direction.y * direction.y);
    real u = 0.5f - angle_of(direction.x, direction.y) * (0.5f / kPi);
    real v = angle_of(direction.z, level) * (1.0f / kPi);
    // texels' middles are at +0.5; a column more on the left, so that what is cut off is not below 0
    real x = u * scalar(width) + (scalar(width) - 0.5f);
    real y = clamp(v * scalar(height) - 0.5f, real(0.0f), real(scalar(height) - 1.0f));
    integer column = to_integer(x);
    integer row = min(to_integer(y), integer(height - 1u));
    EnvironmentTexels at;
    at.across = x - to_real(column);
    at.down = y - to_real(row);
    // x lies in [width - 0.5, 2 width - 0.5], give or take rounding
    integer left = min(column, integer(2u * width - 1u)) - integer(width);
    left = select(column < integer(width), integer(width - 1u), left);
    integer right = select(left < integer(width - 1u), left + integer(1u), integer(0u));
    integer below = min(row + integer(1u), integer(height - 1u));
    at.a = left + row * integer(width);
    at.b = right + row * integer(width);
    at.c = left + below * integer(width);
    at.d = right + below * integer(width);
    return at;
}

SHARED_CLOSE
#endif
