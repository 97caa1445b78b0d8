// The colours of maps drawn on surfaces (SurfaceMap, runtime/scene_look.h), from exact normals, curvatures and their
// changes from pixel to pixel. Linear light.
#if defined(TRIMRAY_SHARED_SURFACE_MAP_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_SURFACE_MAP_H
#undef TRIMRAY_SHARED_SURFACE_MAP_H
#else
#define TRIMRAY_SHARED_SURFACE_MAP_H
#endif

#include "shaders/frame_layout.h"
#include "shaders/shared/curvature.h"
#include "shaders/shared/derivatives.h"
#include "shaders/shared/language.h"
#include "shaders/shared/pixel_map.h"

SHARED_OPEN

// ---- changes from pixel to pixel -----------------------------------------------------------------------------------
// Of something at a hit, to the next pixel of the row and of the column
struct PixelSteps {
    real3 x;
    real3 y;
};

// The unit vector of v, which changes so with v. `per_length`: 1 / |v|, with the sign that `unit` has to v.
FN PixelSteps unit_steps(real3 unit, PixelSteps v, real per_length)
{
    PixelSteps steps;
    steps.x = (v.x - unit * dot(unit, v.x)) * per_length;
    steps.y = (v.y - unit * dot(unit, v.y)) * per_length;
    return steps;
}

// Seen so nearly edge-on a surface changes no faster: the sine of the angle between its parameter lines in the picture
const scalar kEdgeOn = 1e-6f;

// Of the normal S_u x S_v along the surface. With A = (du, dv) the pixels that a step of uv makes (PixelMap) the next
// pixel is a step A^-1 (1, 0), and the normal's derivatives are those of a product.
FN PixelSteps normal_steps(Derivatives s, PixelRows rows)
{
    real2 du = seen_step(rows, s.u);
    real2 dv = seen_step(rows, s.v);
    real det = du.x * dv.y - du.y * dv.x;
    real least = max(kEdgeOn * (length(du) * length(dv)), real(1e-30f));
    real per_det = 1.0f / select(abs(det) > least, det, least);
    real3 by_u = cross(s.uu, s.v) + cross(s.u, s.uv);
    real3 by_v = cross(s.uv, s.v) + cross(s.u, s.vv);
    PixelSteps steps;
    steps.x = (by_u * dv.y - by_v * du.y) * per_det;
    steps.y = (by_v * du.x - by_u * dv.x) * per_det;
    return steps;
}

// ---- angles --------------------------------------------------------------------------------------------------------
struct AngleSteps {
    real angle;  // between a unit vector and an axis, radians
    real change; // of it from pixel to pixel
};

// d angle = -(dv . axis) / sin angle, and never more than |dv|
FN AngleSteps angle_to(real3 v, PixelSteps steps, scalar3 axis)
{
    real3 along = real3(axis);
    real cosine = dot(v, along);
    real sine = length(cross(v, along));
    real x = dot(steps.x, along);
    real y = dot(steps.y, along);
    real most = sqrt(dot(steps.x, steps.x) + dot(steps.y, steps.y));
    AngleSteps a;
    a.angle = angle_of(cosine, sine);
    a.change = min(sqrt(x * x + y * y) / max(sine, real(1e-20f)), most);
    return a;
}

// The ray that the eye's is mirrored into, m = 2 (n.e) n - e, e to the eye; either side's normal gives the same.
struct Mirrored {
    real3 along;
    PixelSteps steps;
};
FN real3 mirrored_step(real3 n, real3 dn, real3 e, real3 de)
{
    return (n * (dot(dn, e) + dot(n, de)) + dn * dot(n, e)) * real(2.0f) - de;
}
FN Mirrored mirrored(real3 n, PixelSteps dn, real3 e, PixelSteps de)
{
    Mirrored m;
    m.along = n * (2.0f * dot(n, e)) - e;
    m.steps.x = mirrored_step(n, dn.x, e, de.x);
    m.steps.y = mirrored_step(n, dn.y, e, de.y);
    return m;
}

// ---- colours -------------------------------------------------------------------------------------------------------
// The share of a pixel in light bands, `stripes` light ones and as many dark ones over half a turn; a light one is
// around angle 0. A pixel is a box as wide as the angle changes in it; where it is wider than a band its share goes to
// a half, so that stripes which no pixel can show fade to grey.
FN real light_share(AngleSteps a, scalar stripes)
{
    real phase = a.angle * (stripes / kPi);
    real width = max(a.change * (stripes / kPi), real(1e-9f));
    real from_light = abs(phase - floor(phase + 0.5f));
    real inside = clamp((0.25f - from_light) / width, real(-0.5f), real(0.5f));
    return 0.5f + inside * clamp(2.0f - 2.0f * width, real(0.0f), real(1.0f));
}

FN real3 blend(real3 a, real3 b, real share_b)
{
    return a + (b - a) * share_b;
}

// Blue over white to red; -1, 0 and 1 are its ends and middle. ColorBrewer's RdBu of 5 classes, which the colour-blind
// tell apart: #0571b0 #92c5de #f7f7f7 #f4a582 #ca0020
FN real3 diverging_color(real t)
{
    mask below = t < 0.0f;
    real at = min(abs(t), real(1.0f));
    real3 white = real3(real(0.9301f), real(0.9301f), real(0.9301f));
    real3 pale = select(below, real3(real(0.2874f), real(0.5583f), real(0.7305f)),
                        real3(real(0.9047f), real(0.3763f), real(0.2232f)));
    real3 full = select(below, real3(real(0.0015f), real(0.1651f), real(0.4342f)),
                        real3(real(0.5906f), real(0.0f), real(0.0144f)));
    return select(at < 0.5f, blend(white, pale, 2.0f * at), blend(pale, full, 2.0f * at - 1.0f));
}

// Bluish green where the surface leaves the mould, yellow where it stands along the pull, vermilion where it is
// undercut: Okabe & Ito's colours, #009e73 #f0e442 #d55e00. Radians.
FN real3 draft_color(real draft, real change, scalar least_draft)
{
    real per_change = 1.0f / max(change, real(1e-9f));
    real in_order = clamp(0.5f + (draft - least_draft) * per_change, real(0.0f), real(1.0f));
    real undercut = clamp(0.5f - (draft + least_draft) * per_change, real(0.0f), real(1.0f));
    real3 steep = real3(real(0.8714f), real(0.7758f), real(0.0545f));
    real3 leaves = real3(real(0.0f), real(0.3419f), real(0.1714f));
    real3 caught = real3(real(0.6654f), real(0.1119f), real(0.0f));
    return blend(blend(steep, leaves, in_order), caught, undercut);
}

// ---- maps ----------------------------------------------------------------------------------------------------------
// A hit as maps see it, in the world
struct MapPoint {
    real3 normal; // unit, outward
    real3 to_eye; // unit
    PixelSteps normal_steps;
    PixelSteps to_eye_steps;
    Curvatures curvatures; // by the outward normal, 1/mm
};
struct MapColor {
    real3 color; // of the surface, or as it is seen (is_lit_map)
    real value;  // 1/mm^2, 1/mm or degrees; 0 for maps that measure nothing
};

// Whether the colour is that of a surface which is lit like any other. Bands of light in the surface are seen as they
// are.
FN bool is_lit_map(uint map)
{
    return map != kMapZebra && map != kMapIsophotes;
}
FN bool is_curvature_map(uint map)
{
    return map >= kMapGaussian && map <= kMapSmaller;
}

FN real map_curvature(uint map, Curvatures k)
{
    if (map == kMapGaussian)
        return k.larger * k.smaller;
    if (map == kMapMean)
        return 0.5f * (k.larger + k.smaller);
    return map == kMapLarger ? k.larger : k.smaller;
}

// Bands keep a little of the shape's shade, so that where they are wide it can still be read.
FN real3 band_color(real3 light, real3 dark, real share, MapPoint p)
{
    real facing = min(abs(dot(p.normal, p.to_eye)), real(1.0f));
    return blend(dark, light, share) * (0.4f + 0.6f * facing);
}

FN MapColor map_color(uint map, MapView look, MapPoint p)
{
    scalar3 axis = scalar3(look.direction[0], look.direction[1], look.direction[2]);
    MapColor out_color;
    out_color.value = real(0.0f);
    if (is_curvature_map(map)) {
        out_color.value = map_curvature(map, p.curvatures);
        out_color.color = diverging_color(out_color.value * look.per_range - look.range_middle);
    } else if (map == kMapZebra) {
        Mirrored m = mirrored(p.normal, p.normal_steps, p.to_eye, p.to_eye_steps);
        real share = light_share(angle_to(m.along, m.steps, axis), look.stripes);
        real3 light = real3(real(0.95f), real(0.95f), real(0.95f));
        real3 dark = real3(real(0.01f), real(0.01f), real(0.01f));
        out_color.color = band_color(light, dark, share, p);
    } else {
        AngleSteps a = angle_to(p.normal, p.normal_steps, axis);
        if (map == kMapIsophotes) {
            real3 light = real3(real(0.95f), real(0.95f), real(0.95f));
            real3 dark = real3(real(0.0f), real(0.1683f), real(0.4452f)); // Okabe & Ito's blue, #0072b2
            out_color.color = band_color(light, dark, light_share(a, look.stripes), p);
        } else {
            real draft = 0.5f * kPi - a.angle;
            out_color.value = draft * (180.0f / kPi);
            out_color.color = draft_color(draft, a.change, look.draft);
        }
    }
    return out_color;
}

SHARED_CLOSE
#endif
