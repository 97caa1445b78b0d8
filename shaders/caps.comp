// Caps of section planes: whether the point where a pixel's ray begins at a plane is inside of a solid. More surfaces
// leave than enter then on the way from it to infinity. One dispatch a question (shaders/shared/section.h): the first
// two of every such pixel, the third where these disagree; the last one also writes the caps over the pixels.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_basic : require

#include "format/kd_layout.h"
#include "shaders/frame_layout.h"
#include "shaders/light_layout.h"
#include "shaders/material_layout.h"
#include "shaders/section_layout.h"
// first: the formulas fetch through it, and they make `scalar`, a layout there, a type
#include "shaders/scene_buffers.glsl"

#include "shaders/shared/bezier.h"
#include "shaders/shared/bvh_node.h"
#include "shaders/shared/language.h"
#include "shaders/shared/leaf_box.h"
#include "shaders/shared/leaf_proof.h"
#include "shaders/shared/leaf_start.h"
#include "shaders/shared/light.h"
#include "shaders/shared/precision.h"
#include "shaders/shared/quadric.h"
#include "shaders/shared/rim.h"
#include "shaders/shared/section.h"
#include "shaders/shared/torus.h"
#include "shaders/shared/trim_kd.h"
#include "shaders/shared/trim_lookup.h"

#include "shaders/materials.glsl"
#define TRIMRAY_COLLECTS
#include "shaders/ray_types.glsl"
#include "shaders/free_rays.glsl"
#include "shaders/crossings.glsl"
#include "shaders/leaf_hit.glsl"
#include "shaders/walk.glsl"
#include "shaders/places.glsl"
#include "shaders/light.glsl"
#include "shaders/section.glsl"
#include "shaders/work_counts.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

uint free_ray_count = 0u;

// The nearest crossing out of an instance that is left more often than it is entered
void next_left(inout CapState cap)
{
    float nearest = kHuge;
    for (uint i = 0u; i < crossing_count; ++i) {
        uint what = crossing_what[i];
        if ((what & kCrossingLeaves) == 0u || crossing_at[i] >= nearest || crossings_out(false, what >> 1) <= 0)
            continue;
        nearest = crossing_at[i];
        cap.instance = what >> 1;
        cap.leaf = crossing_leaf[i];
    }
}

// Asks question number view.gathered. Returns false where the driver's loop limit would have cut the walk short.
bool ask(vec2 pixel, float past, inout CapState cap)
{
    vec3 along = place_along(pixel);
    Ray ray = Ray(place_at(pixel, past), along / length(along), place_width(past));
    if (view.gathered > 0u)
        ray.direction = inside_direction(view.gathered);
    Hit hit = Hit(kHuge, 0.0f, vec2(0.0f), vec2(0.0f), kNoLeaf, 0xffffffffu, kHuge, false, true, 0.0f);
    ++free_ray_count;
    if (!walk(ray, Guess(kNoLeaf, 0u), hit))
        return false;
    if (crossings_out(true, 0u) <= 0)
        return true;
    cap.inside |= 1u << view.gathered;
    if (cap.leaf == kNoLeaf)
        next_left(cap);
    return true;
}

vec3 leaf_color(uint leaf, uint instance)
{
    uint face = patches[leaves[leaf].patch].face;
    return vector(face_material(face, faces[face], instance, instances[instance]).color);
}

vec3 cap_color(CapState cap, SectionPlaneView plane, vec2 at, vec3 to_eye, float width)
{
    vec3 color = vector(section.color);
    if (section.has_color == 0u)
        color = leaf_color(cap.leaf, cap.instance);
    if (section.caps != kCapsHatched)
        return color;
    float slant = max(abs(dot(vector(plane.normal), to_eye)), 0.05f);
    vec2 hatches = at / section.hatch;
    float hatch = hatch_at(hatches.x, hatches.y, (cap.instance & 1u) != 0u, width / section.hatch / slant);
    return color * (1.0f - kHatchDarkens * hatch);
}

void write_cap(uint band_pixel, vec2 pixel, CutSpan span, CapState cap)
{
    bool agreed = (cap.inside & 3u) == 0u || (cap.inside & 3u) == 3u;
    if (bitCount(cap.inside) < 2) {
        if (!agreed)
            pixels[band_pixel].status &= ~kPixelCertified;
        return;
    }
    SectionPlaneView plane = section.planes[span.plane];
    vec3 place = place_at(pixel, span.begin);
    vec3 direction = vector(view.w0);
    if (!has_feature(kFeatureParallel))
        direction += pixel.x * vector(view.step_x) + pixel.y * vector(view.step_y);
    float stretch = length(direction);
    vec3 to_eye = direction / -stretch;
    vec3 normal = vector(plane.normal);
    vec2 at = vec2(dot(vector(plane.across), place), dot(vector(plane.along), place));
    vec3 color = cap_color(cap, plane, at, to_eye, place_width(span.begin));
    FramePixel result;
    result.depth_mm = (view.tau_ref + span.begin) * stretch;
    result.normal = plane.normal;
    result.uv_face = float[2](at.x / places.per_mm, at.y / places.per_mm);
    result.face = kCapFace - span.plane;
    result.instance = cap.instance;
    result.status = kPixelHit | (agreed ? kPixelCertified : 0u);
    result.rgba = float[4](0.0f, 0.0f, 0.0f, 1.0f);
    if (has_feature(kFeatureShade)) {
        vec3 seen;
        if (has_feature(kFeatureLights)) {
            MaterialRecord plain =
                MaterialRecord(float[3](color.x, color.y, color.z), 1.0f, 1.0f, 0.0f, kSpecular, 0.0f);
            LitPixel point = lit_point(place, place_width(span.begin), normal, to_eye, plain);
            lit_pixels[band_pixel] = point;
            seen = light_without_rays(point);
        } else
            seen = shade(color, normal, to_eye);
        result.rgba = float[4](seen.x, seen.y, seen.z, 1.0f);
    }
    pixels[band_pixel] = result;
    if (has_feature(kFeatureMirrors))
        paths[band_pixel].mirror = 0.0f;
    if (has_feature(kFeatureEdges))
        edges[band_pixel] = uvec2(0u);
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
        uint band_pixel = at.y * view.width + at.x;
        CutSpan span = cut_span(pixel);
        if (span.plane != kNoPlane && span.begin < span.end) {
            CapState cap = CapState(0u, 0u, kNoLeaf);
            if (view.gathered > 0u)
                cap = caps[band_pixel];
            bool last = view.gathered + 1u == kInsideQuestions;
            bool disagree = cap.inside == 1u || cap.inside == 2u;
            bool complete = true;
            if (!last || disagree)
                complete = ask(pixel, span.begin, cap);
            if (complete) {
                caps[band_pixel] = cap;
                if (last)
                    write_cap(band_pixel, pixel, span, cap);
            } else
                stopped[atomicAdd(stopped_count, 1u)] = band_pixel;
        }
    }
    if (has_feature(kFeatureCount)) {
        tally(kCountNodes, node_visits);
        tally(kCountFreeRays, free_ray_count);
        tally(kCountFreeLeaves, leaf_visits);
        tally(kCountNewton, newton_steps);
        tally(kCountCurves, curve_tests);
    }
}
