// Primary rays, one an invocation: walks the top tree and the parts' trees, nearest child first, meets leaves, and
// shades the nearest hit. A frame is traced in bands of rows; each band is one dispatch.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_basic : require

#include "format/kd_layout.h"
#include "shaders/frame_layout.h"
#include "shaders/light_layout.h"
#include "shaders/section_layout.h"
// first: the formulas fetch through it, and they make `scalar`, a layout there, a type
#include "shaders/scene_buffers.glsl"

#include "shaders/shared/bezier.h"
#include "shaders/shared/bezier_derivatives.h"
#include "shaders/shared/bvh_node.h"
#include "shaders/shared/edge.h"
#include "shaders/shared/language.h"
#include "shaders/shared/leaf_box.h"
#include "shaders/shared/leaf_proof.h"
#include "shaders/shared/leaf_start.h"
#include "shaders/shared/light.h"
#include "shaders/shared/precision.h"
#include "shaders/shared/quadric.h"
#include "shaders/shared/rim.h"
#include "shaders/shared/section.h"
#include "shaders/shared/shading.h"
#include "shaders/shared/surface_map.h"
#include "shaders/shared/torus.h"
#include "shaders/shared/trim_kd.h"
#include "shaders/shared/trim_lookup.h"

#include "shaders/ray_types.glsl"
#include "shaders/eye_rays.glsl"
#include "shaders/leaf_hit.glsl"
#include "shaders/walk.glsl"
#include "shaders/last_hits.glsl"

#include "shaders/border_edges.glsl"
#include "shaders/colors.glsl"
#include "shaders/places.glsl"
#include "shaders/light.glsl"
#include "shaders/section.glsl"
#include "shaders/surface_maps.glsl"
#include "shaders/work_counts.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// S_u x S_v of a Bezier patch; at a pole or along a degenerate side the one a little way inside
vec3 bezier_normal(PatchRecord patch, vec2 uv)
{
    const float kFlat = 1e-10f; // square of the sine, or of the ratio of lengths, that rounding leaves no digits
    const float kInwards = 1.0f / 2048.0f;
    uint degree_u = (patch.shape >> 8) & 0xffu;
    uint degree_v = (patch.shape >> 16) & 0xffu;
    bool rational = has_feature(kFeatureRational) && (patch.shape & kShapeRational) != 0u;
    if (local_floats > 0u)
        copy_control_points(patch, (degree_u + 1u) * (degree_v + 1u) * (rational ? 4u : 3u));
    vec3 normal = vec3(0.0f);
    bool flat_there = true;
    for (int attempt = 0; attempt < 2 && flat_there; ++attempt) {
        SurfacePoint s = bezier_point(patch.first_control_point, int(degree_u), int(degree_v), rational, uv);
        normal = cross(s.du, s.dv);
        float du2 = dot(s.du, s.du);
        float dv2 = dot(s.dv, s.dv);
        flat_there = dot(normal, normal) <= kFlat * du2 * dv2 || du2 <= kFlat * dv2 || dv2 <= kFlat * du2;
        uv += (0.5f - uv) * kInwards;
    }
    return normal;
}

// The normal in the world, outward as the face's orientation says, of any length
vec3 world_normal(Hit hit, FrameInstance instance, PatchRecord patch, FaceRecord face, Ray eye_ray)
{
    uint kind = patch.shape & 0xffu;
    PatchRay ray = patch_ray(instance, hit.instance, patch, eye_ray);
    vec3 p = ray.origin + hit.t * ray.direction;
    vec3 n;
    if (kind == kKindBezier && has_kind(kKindBezier))
        n = bezier_normal(patch, clamp(hit.uv_patch, 0.0f, 1.0f)); // beyond a pole's side a patch is turned inside out
    else
        n = native_normal(kind, patch, p);
    n = combine(vector(patch.axis_x), vector(patch.axis_y), vector(patch.axis_z), outward(patch, face, n));
    return combine(vector(instance.normal_x), vector(instance.normal_y), vector(instance.normal_z), n);
}

FramePixel miss_pixel(bool doubt)
{
    FramePixel pixel;
    pixel.depth_mm = kHuge;
    pixel.normal = float[3](0.0f, 0.0f, 0.0f);
    pixel.uv_face = float[2](0.0f, 0.0f);
    pixel.face = 0u;
    pixel.instance = 0u;
    pixel.status = doubt ? 0u : kPixelCertified;
    pixel.rgba = float[4](0.0f, 0.0f, 0.0f, 0.0f);
    return pixel;
}

FramePixel hit_pixel(Hit hit, Ray eye_ray, uint band_pixel)
{
    FrameInstance instance = instances[hit.instance];
    LeafRecord leaf = leaves[hit.leaf];
    PatchRecord patch = patches[leaf.patch];
    FaceRecord face = faces[patch.face];
    vec3 direction = vector(view.w0) + turned(eye_ray.across);
    float stretch = length(direction);
    vec3 to_eye = direction / -stretch;
    vec3 normal = world_normal(hit, instance, patch, face, eye_ray);
    float size = length(normal);
    normal = size > 0.0f ? normal / size : to_eye; // a surface without a normal faces the eye
    FramePixel result;
    result.depth_mm = (view.tau_ref + hit.past) * stretch;
    result.normal = float[3](normal.x, normal.y, normal.z);
    result.uv_face = float[2](hit.uv_face.x, hit.uv_face.y);
    result.face = patch.face;
    result.instance = hit.instance;
    result.status = kPixelHit | (hit.doubt <= hit.past ? 0u : kPixelCertified);
    result.rgba = float[4](0.0f, 0.0f, 0.0f, 1.0f);
    bool mapped = surface_map != kMapNone;
    MapColor map;
    if (mapped)
        map = map_hit(hit, instance, patch, face, eye_ray, normal, to_eye);
    if (measures())
        map_values[band_pixel] = map.value;
    if (has_feature(kFeatureShade)) {
        vec3 color = mapped ? map.color : face_color(face, instance);
        if (mapped && !is_lit_map(surface_map)) {
            if (has_feature(kFeatureLights))
                lit_pixels[band_pixel].pixel = 0.0f;
        } else if (has_feature(kFeatureLights)) {
            LitPixel point = lit_pixel(eye_ray.pixel, hit.past, normal, to_eye, color, kSpecular);
            lit_pixels[band_pixel] = point;
            color = light_without_rays(point);
        } else
            color = shade(color, normal, to_eye);
        result.rgba = float[4](color.x, color.y, color.z, 1.0f);
    }
    return result;
}

void main()
{
    uvec2 at = gl_GlobalInvocationID.xy;
    bool active_here = at.x < view.width && at.y < view.row_count;
    if (view.alone != 0u) {
        uint retry = retries[gl_WorkGroupID.x];
        at = uvec2(retry % view.width, retry / view.width);
        active_here = gl_LocalInvocationIndex == 0u;
    }
    if (active_here) {
        vec2 pixel = vec2(float(at.x) + 0.5f - view.middle[0], float(at.y + view.first_row) + 0.5f - view.middle[1]);
        Ray eye_ray = Ray(pixel, pixel.x * vector(view.step_x) + pixel.y * vector(view.step_y));
        uint picture_pixel = (view.first_row + at.y) * view.width + at.x;
        Hit before = Hit(kHuge, 0.0f, vec2(0.0f), vec2(0.0f), 0xffffffffu, 0xffffffffu, kHuge, false, false, 0.0f);
        if (has_feature(kFeatureKept))
            before = load_kept(picture_pixel);
        if (has_feature(kFeatureStochastic))
            before.doubt = -kHuge; // plain Newton claims nothing
        if (has_feature(kFeatureCut)) {
            CutSpan span = cut_span(pixel);
            cut_begin = span.begin;
            before.past = span.begin < span.end ? min(before.past, span.end) : -kHuge;
        }
        Guess guess = Guess(kNoLeaf, 0u);
        // where the loop limit bears on what is searched, alone, the picture must not hang on the last one
        if (has_feature(kFeatureReuse) && view.alone == 0u)
            guess = guess_hit(uvec2(at.x, view.first_row + at.y), pixel);
        Hit hit;
        bool complete;
        for (int attempt = 0; attempt < 2; ++attempt) {
            hit = before;
            complete = walk(eye_ray, guess, hit);
            if (!complete || !hit.back || rims_cut)
                break;
            rims_cut = true;
        }
        if (has_feature(kFeatureCut) && hit.leaf == kNoLeaf)
            hit.past = kHuge;
        if (has_feature(kFeatureKept)) {
            // a pixel changes only where its new hit is nearer than what was kept
            if (complete && hit.past < before.past)
                store_kept(picture_pixel, hit);
            else
                hit = before;
        }
        if (has_feature(kFeatureReuse))
            keep_hit(picture_pixel, hit, eye_ray.across);
        uint band_pixel = at.y * view.width + at.x;
        FramePixel result = miss_pixel(hit.doubt < kHuge);
        if (hit.past < kHuge)
            result = hit_pixel(hit, eye_ray, band_pixel);
        else if (has_feature(kFeatureLights))
            lit_pixels[band_pixel].pixel = 0.0f;
        if (measures() && hit.past >= kHuge)
            map_values[band_pixel] = 0.0f;
        if (!complete)
            result.status |= kPixelStopped;
        if (has_feature(kFeatureEdges))
            edges[band_pixel] = hit.past < kHuge ? find_edges(hit, eye_ray) : uvec2(0u);
        pixels[band_pixel] = result;
    }
    if (has_feature(kFeatureCount)) {
        tally(kCountRays, active_here && view.alone == 0u ? 1u : 0u);
        tally(kCountNodes, node_visits);
        tally(kCountLeaves, leaf_visits);
        tally(kCountNewton, newton_steps);
        tally(kCountCurves, curve_tests);
        tally(kCountEdges, edge_tests);
    }
}
