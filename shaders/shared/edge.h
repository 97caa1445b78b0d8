// Where a face's borders lie beside a hit, in pixels: the map from uv_face to the picture and the nearest point of a
// piece under it.
//
// Near a hit the picture of the surface is linear: a point at uv + duv is seen at the pixel + A duv, A =
// d(pixel)/d(uv). A is the inverse of the uv-to-pixel Jacobian that a texture's distances are divided by, and unlike it
// A exists at every slant: distances measured after A are pixels, so what is drawn with them is as wide edge-on as it
// is face-on. Source: the paper, eq. 6 (a point is on the border where its distance is below a bound) and 7 (a smooth
// blend).
#if defined(TRIMRAY_SHARED_EDGE_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_EDGE_H
#undef TRIMRAY_SHARED_EDGE_H
#else
#define TRIMRAY_SHARED_EDGE_H
#endif

#include "format/pack_layout.h"
#include "shaders/shared/derivatives.h"
#include "shaders/shared/language.h"
#include "shaders/shared/pixel_map.h"

SHARED_OPEN

// Where a point of the surface is seen, from a pixel's middle; kHuge away where the surface has turned round on the way
// there: beyond a rim nothing is seen of it.
FN real2 unless_turned(PixelRows rows, PixelMap here, real3 su, real3 sv, real2 offset)
{
    real2 du = seen_step(rows, su);
    real2 dv = seen_step(rows, sv);
    real facing = (du.x * dv.y - du.y * dv.x) * (here.du.x * here.dv.y - here.du.y * here.dv.x);
    return real2(select(facing > 0.0f, offset.x, real(kHuge)), offset.y);
}

// Of a native surface, the point at uv_patch + step, to the second order: near a rim the first order is next to
// nothing, and what lies round the bend would seem to be at hand. uv_scale > 0 and does not change a sign.
FN real2 seen_bent(PixelRows rows, PixelMap here, Derivatives s, real2 step)
{
    real3 bent_u = s.uu * step.x + s.uv * step.y;
    real3 bent_v = s.uv * step.x + s.vv * step.y;
    real3 dq = (s.u + bent_u * real(0.5f)) * step.x + (s.v + bent_v * real(0.5f)) * step.y;
    return unless_turned(rows, here, s.u + bent_u, s.v + bent_v, seen_step(rows, dq));
}

FN real2 to_pixels(PixelMap map, real2 duv)
{
    return map.du * duv.x + map.dv * duv.y;
}

// Half sides of the box in uv_face around the points that are seen within `radius` pixels; kHuge edge-on
FN real2 reach_in_uv(PixelMap map, scalar radius)
{
    // rows of A^-1 = ((dv.y, -dv.x), (-du.y, du.x)) / det
    real det = abs(map.du.x * map.dv.y - map.du.y * map.dv.x);
    real per_det = radius / max(det, real(1e-30f));
    real u = length(map.dv) * per_det;
    real v = length(map.du) * per_det;
    return real2(min(u, real(kHuge)), min(v, real(kHuge)));
}

// Borders are looked for so many cells (of columns x rows) around a hit at most: where a face is seen edge-on, all of
// it is within a pixel.
const scalar kMostCellsAround = 4.0f;
FN real2 reach_in_cells(real2 reach, scalar columns, scalar rows)
{
    return real2(min(reach.x, real(kMostCellsAround / columns)), min(reach.y, real(kMostCellsAround / rows)));
}

// How wide the face's whole domain is seen across its thinner direction, pixels
FN real seen_thickness(PixelMap map)
{
    real det = abs(map.du.x * map.dv.y - map.du.y * map.dv.x);
    real longer = sqrt(max(dot(map.du, map.du), dot(map.dv, map.dv)));
    return det / max(longer, real(1e-30f));
}

// ---- nearest points ------------------------------------------------------------------------------------------------
// All in pixels from the pixel's centre, which is the origin.

// The parameter of the nearest point of the segment a b
FN real nearest_on_line(real2 a, real2 b)
{
    real2 along = b - a;
    real t = -dot(a, along) / max(dot(along, along), real(1e-30f));
    return clamp(t, real(0.0f), real(1.0f));
}

struct CurvePoint {
    real2 p;
    real2 third; // of the derivative
};
// de Casteljau: the last two points give the place and the derivative
FN CurvePoint cubic_at(real2 a, real2 b, real2 c, real2 d, real t)
{
    real2 ab = a + (b - a) * t;
    real2 bc = b + (c - b) * t;
    real2 cd = c + (d - c) * t;
    real2 abc = ab + (bc - ab) * t;
    real2 bcd = bc + (cd - bc) * t;
    CurvePoint at;
    at.third = bcd - abc;
    at.p = abc + at.third * t;
    return at;
}

// The parameter of the nearest point of the cubic Bezier a b c d, for a point that is near it against its radius of
// curvature: Gauss-Newton on |P(t)|^2 from the chord's nearest point. A piece is monotone, so its chord runs along it.
const int kNearestSteps = 4;
FN_LARGE real nearest_on_cubic(real2 a, real2 b, real2 c, real2 d)
{
    real t = nearest_on_line(a, d);
    for (int i = 0; i < kNearestSteps; ++i) {
        CurvePoint at = cubic_at(a, b, c, d, t);
        real step = dot(at.p, at.third) / max(3.0f * dot(at.third, at.third), real(1e-30f));
        t = clamp(t - step, real(0.0f), real(1.0f));
    }
    return t;
}

// ---- the border of a distance texture ------------------------------------------------------------------------------
// Eq. 6: where a signed distance d is 0, to the first order: against its gradient g = grad d in pixels, at
// -d g / |g|^2. `by_uv` is the gradient by uv_face; in pixels it is A^-T by_uv. kHuge away where the distance is level.
FN real2 level_offset(PixelMap map, real d, real2 by_uv)
{
    real det = map.du.x * map.dv.y - map.du.y * map.dv.x;
    real gx = map.dv.y * by_uv.x - map.du.y * by_uv.y; // times det
    real gy = map.du.x * by_uv.y - map.dv.x * by_uv.x;
    real square = gx * gx + gy * gy;
    mask slopes = square > 1e-30f;
    real scale = -d * det / select(slopes, square, real(1.0f));
    return real2(select(slopes, gx * scale, real(kHuge)), select(slopes, gy * scale, real(kHuge)));
}

// The pieces know what kind of edge is near, the texture where the face that it trims ends. They differ by the
// texture's error; where by more pixels than this, the texture has no such border (at the domain's, nor of what is
// below a texel), and the piece stays.
const scalar kTextureAgrees = 2.0f;
FN mask agrees(real2 of_texture, real2 of_piece)
{
    real2 apart = of_texture - of_piece;
    return dot(apart, apart) <= kTextureAgrees * kTextureAgrees;
}

// Within a texel of the domain's border a texture goes on as it is, and has no border there.
FN mask in_texture(real2 uv, scalar2 texel)
{
    return abs(uv.x - 0.5f) < 0.5f - texel.x && abs(uv.y - 0.5f) < 0.5f - texel.y;
}

// ---- what a pixel keeps of it --------------------------------------------------------------------------------------
// One word: the offset to the nearest border, x | y << 14, each (pixels + 32) * 256, and a strength << 28, 1 to 15; 0:
// none is near.
const scalar kEdgeWordReach = 31.0f; // pixels: the largest offset
const scalar kEdgeWordLeast = 2.0f / 256.0f;

// Domain: |offset| <= kEdgeWordReach, strength in [0, 1]. A border through the pixel's centre keeps its direction: it
// is moved off it by two steps.
FN integer edge_word(real2 offset, real strength)
{
    real2 kept = offset * max(kEdgeWordLeast / max(length(offset), real(1e-20f)), real(1.0f));
    integer x = to_integer((kept.x + 32.0f) * 256.0f + 0.5f);
    integer y = to_integer((kept.y + 32.0f) * 256.0f + 0.5f);
    integer full = to_integer(strength * 14.0f + 1.5f);
    return x | (y << integer(14u)) | (full << integer(28u));
}

// Lines never cover more of a face than this share of its width: from afar a face of two pixels is shaded, not black.
const scalar kLargestShare = 0.5f;

// How strongly a face's lines of this width are drawn where it is seen so thin, 0 to 1. Two borders take one width.
FN real line_strength(real thickness, scalar width)
{
    return min(thickness * (kLargestShare / width), real(1.0f));
}

SHARED_CLOSE
#endif
