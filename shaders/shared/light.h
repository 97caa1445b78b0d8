// What lights do at a point of a surface, and where the rays begin and go that find out what hides them.
#if defined(TRIMRAY_SHARED_LIGHT_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_LIGHT_H
#undef TRIMRAY_SHARED_LIGHT_H
#else
#define TRIMRAY_SHARED_LIGHT_H
#endif

#include "shaders/shared/language.h"
#include "shaders/shared/shading.h"

SHARED_OPEN

// Two unit vectors at right angles to the unit vector n and each other.
// Source: Duff et al., Building an Orthonormal Basis, Revisited (JCGT 2017)
struct Tangents {
    real3 u;
    real3 v;
};
FN Tangents tangents_of(real3 n)
{
    real side = select(n.z < 0.0f, real(-1.0f), real(1.0f));
    real a = -1.0f / (side + n.z);
    real b = n.x * n.y * a;
    Tangents t;
    t.u = real3(1.0f + side * n.x * n.x * a, side * b, -side * n.x);
    t.v = real3(b, side + n.y * n.y * a, -n.y);
    return t;
}

// The direction over the point (x, y) of the unit disc on the half sphere around n: evenly many rays there are as many
// as the cosine weighs (Malley)
FN real3 cosine_direction(real3 n, real x, real y)
{
    Tangents t = tangents_of(n);
    return t.u * x + t.v * y + n * sqrt(max(1.0f - x * x - y * y, real(0.0f)));
}

// How far from its surface a ray begins that leaves a hit at `place`, in the top tree's units. On both sides of that
// there is only rounding: of the hit along its ray (`slack`), which Newton may also leave so far off the surface, and
// of the ray in the spaces on its way to a patch, each some 2^-24 of the scene.
const scalar kStartRoundings = 40.0f;
FN real start_distance(real3 place, real slack)
{
    return slack + (kStartRoundings * kRounding) * (1.0f + length(place)); // the scene reaches about 1
}

// Rounding of s where such a ray meets a patch: `speed` is the length of its direction in the patch's units, `nearest`
// how far it passes from the patch's middle in these, `from` its s there
FN real free_rounding(real nearest, real speed, real from, real place)
{
    return (8.0f * kRounding) * ((1.0f + nearest) / speed + abs(from) + place);
}

// The light that reaches every point: from all around and, more, from above. normal and to_eye unit
FN real sky_light(real3 normal, real3 to_eye)
{
    real up = select(dot(normal, to_eye) < 0.0f, -normal.z, normal.z);
    return kAmbient + kSky * (0.5f + 0.5f * up);
}

// The point of a sample's disc that a pixel takes: turned by one of kTurns angles
FN real2 turned_sample(real2 at, real cosine, real sine)
{
    return real2(cosine * at.x - sine * at.y, sine * at.x + cosine * at.y);
}

// The way from a ray's origin to a light, of any length: to the middle of its disc, or to a sample's point of it
FN real3 way_to_disc(real3 middle, scalar radius, real2 at)
{
    Tangents across = tangents_of(middle * (1.0f / max(length(middle), real(1e-20f))));
    return middle + (across.u * at.x + across.v * at.y) * real(radius);
}

// What of a light of strength 1 leaves towards the eye. All unit; the normal on the eye's side.
FN real3 lit_by(real3 color, real specular, real3 normal, real3 to_eye, real3 to_light)
{
    real facing = max(dot(normal, to_light), real(0.0f));
    real3 half_way = to_eye + to_light;
    real size = length(half_way);
    real cosine = max(dot(normal, half_way), real(0.0f)) / select(size > 0.0f, size, real(1.0f));
    real f2 = cosine * cosine;
    real f4 = f2 * f2;
    real f8 = f4 * f4;
    real f16 = f8 * f8;
    real highlight = select(facing > 0.0f, specular * f16 * f16, real(0.0f));
    real diffuse = kDiffuse * facing;
    return color * diffuse + real3(highlight, highlight, highlight);
}

SHARED_CLOSE
#endif
