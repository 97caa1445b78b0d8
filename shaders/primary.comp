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
#include "shaders/material_layout.h"
#include "shaders/section_layout.h"
// first: the formulas fetch through it, and they make `scalar`, a layout there, a type
#include "shaders/scene_buffers.glsl"

#include "shaders/shared/bezier.h"
#include "shaders/shared/bezier_derivatives.h"
#include "shaders/shared/bvh_node.h"
#include "shaders/shared/edge.h"
#include "shaders/shared/environment.h"
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

#include "shaders/materials.glsl"
#include "shaders/ray_types.glsl"
#include "shaders/eye_rays.glsl"
#include "shaders/patch_point.glsl"
#include "shaders/leaf_hit.glsl"
#include "shaders/walk.glsl"
#include "shaders/last_hits.glsl"

#include "shaders/border_edges.glsl"
#include "shaders/normals.glsl"
#include "shaders/environment.glsl"
#include "shaders/places.glsl"
#include "shaders/light.glsl"
#include "shaders/section.glsl"
#include "shaders/surface_maps.glsl"
#include "shaders/band_pixels.glsl"
#include "shaders/work_counts.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

bool is_first_layer()
{
    return !has_feature(kFeatureLayers) || view.gathered == 0u;
}

// Where the layer behind a hit may begin: rounding does not find the same hit again
float begin_behind(vec2 pixel, float past)
{
    float away = start_distance(place_at(pixel, past), place_width(past) * view.error_px);
    return past + away / length(place_along(pixel));
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
    bool mapped = drawn_map() != kMapNone;
    MapColor map;
    if (mapped)
        map = map_hit(hit, instance, patch, face, eye_ray, normal, to_eye);
    if (measures() && is_first_layer())
        map_values[band_pixel] = map.value;
    if (has_feature(kFeatureShade)) {
        MaterialRecord material = face_material(patch.face, face, hit.instance, instance);
        if (mapped)
            material.color = float[3](map.color.x, map.color.y, map.color.z);
        vec3 color = vector(material.color);
        if (mapped && !is_lit_map(drawn_map())) {
            if (has_feature(kFeatureLights))
                lit_pixels[band_pixel].pixel = 0.0f;
        } else if (has_feature(kFeatureLights)) {
            LitPixel point = lit_point(place_at(eye_ray.pixel, hit.past), place_width(hit.past), normal, to_eye, material);
            lit_pixels[band_pixel] = point;
            color = light_without_rays(point);
        } else
            color = shade(color, normal, to_eye);
        result.rgba = float[4](color.x, color.y, color.z, material.opacity);
        if (has_feature(kFeatureMirrors))
            paths[band_pixel].mirror = material.mirror;
    }
    return result;
}

void main()
{
    uvec2 at;
    bool active_here = is_active(at);
    if (active_here) {
        vec2 pixel = pixel_at(at);
        Ray eye_ray = Ray(pixel, pixel.x * vector(view.step_x) + pixel.y * vector(view.step_y));
        uint picture_pixel = (view.first_row + at.y) * view.width + at.x;
        Hit before = Hit(kHuge, 0.0f, vec2(0.0f), vec2(0.0f), 0xffffffffu, 0xffffffffu, kHuge, false, false, 0.0f);
        if (has_feature(kFeatureKept) && is_first_layer())
            before = load_kept(picture_pixel);
        if (has_feature(kFeatureStochastic))
            before.doubt = -kHuge; // plain Newton claims nothing
        if (has_feature(kFeatureCut)) {
            CutSpan span = cut_span(pixel);
            cut_begin = span.begin;
            before.past = span.begin < span.end ? min(before.past, span.end) : -kHuge;
        }
        if (!is_first_layer()) {
            cut_begin = paths[picture_pixel - view.first_row * view.width].begin;
            if (cut_begin >= kHuge)
                before.past = -kHuge;
        }
        Guess guess = Guess(kNoLeaf, 0u);
        // where the loop limit bears on what is searched, alone, the picture must not hang on the last one
        if (has_feature(kFeatureReuse) && view.alone == 0u && is_first_layer())
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
        if (has_feature(kFeatureCut | kFeatureLayers) && hit.leaf == kNoLeaf)
            hit.past = kHuge;
        if (has_feature(kFeatureKept) && is_first_layer()) {
            // a pixel changes only where its new hit is nearer than what was kept
            if (complete && hit.past < before.past)
                store_kept(picture_pixel, hit);
            else
                hit = before;
        }
        if (has_feature(kFeatureReuse) && is_first_layer())
            keep_hit(picture_pixel, hit, eye_ray.across);
        uint band_pixel = band_index(at);
        FramePixel result = miss_pixel(hit.doubt < kHuge);
        if (hit.past < kHuge)
            result = hit_pixel(hit, eye_ray, band_pixel);
        else {
            if (has_feature(kFeatureLights))
                lit_pixels[band_pixel].pixel = 0.0f;
            if (has_feature(kFeatureEnvironment) && !has_feature(kFeatureLayers)) {
                vec3 behind = environment_along(place_along(pixel));
                result.rgba = float[4](behind.x, behind.y, behind.z, 1.0f);
            }
        }
        if (measures() && hit.past >= kHuge)
            map_values[band_pixel] = 0.0f;
        if (!complete)
            result.status |= kPixelStopped;
        else if (has_feature(kFeatureLayers)) // a pixel that is traced again begins where it did
            paths[band_pixel].begin = hit.past < kHuge ? begin_behind(pixel, hit.past) : kHuge;
        if (has_feature(kFeatureEdges) && is_first_layer())
            edges[band_pixel] = hit.past < kHuge ? find_edges(hit, eye_ray) : uvec2(0u);
        pixels[band_pixel] = result;
    }
    if (has_feature(kFeatureCount)) {
        tally(kCountRays, active_here && view.alone == 0u && is_first_layer() ? 1u : 0u);
        tally(kCountNodes, node_visits);
        tally(kCountLeaves, leaf_visits);
        tally(kCountNewton, newton_steps);
        tally(kCountCurves, curve_tests);
        tally(kCountEdges, edge_tests);
    }
}
