// Light that something may hide: one ray a sample from each pixel's hit, to a light or to the sky. What arrives is added
// to the pixel's colour. One dispatch gathers some samples of one light.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_basic : require

#include "shaders/free_pass.glsl"

vec2 sample_at(uint index, uvec2 picture_at)
{
    uint turn = (picture_at.y & 3u) * 4u + (picture_at.x & 3u);
    return turned_sample(light_samples[index], light_view.turn_cos[turn], light_view.turn_sin[turn]);
}

// Whether the ray meets anything before `reach`; `complete`: false where the driver's loop limit would have cut it short
bool is_stopped(Ray ray, float reach, inout bool complete)
{
    if (has_feature(kFeatureCut))
        reach = cut_free_ray(ray.origin, ray.direction, reach);
    Hit hit = Hit(reach, 0.0f, vec2(0.0f), vec2(0.0f), kNoLeaf, 0xffffffffu, kHuge, false, true, 0.0f);
    ++free_ray_count;
    complete = walk(ray, Guess(kNoLeaf, 0u), hit) && complete;
    return hit.leaf != kNoLeaf;
}

vec3 gather_sky(LitPixel point, uvec2 picture_at, inout bool complete)
{
    Ray ray = Ray(ray_start(point), vec3(0.0f), point.pixel);
    uint open = 0u;
    for (uint i = view.first_sample; i < view.end_sample; ++i) {
        vec2 at = sample_at(light_view.light_samples + i, picture_at);
        ray.direction = cosine_direction(vector(point.normal), at.x, at.y);
        if (!is_stopped(ray, light_view.occlusion_reach, complete))
            ++open;
    }
    return sky_on(point) * (float(open) / float(light_view.occlusion_samples));
}

vec3 gather_light(LitPixel point, uvec2 picture_at, inout bool complete)
{
    LightRecord light = light_records[view.gathered];
    bool soft = (light.kind & kLightSoft) != 0u;
    Ray ray = Ray(ray_start(point), vec3(0.0f), point.pixel);
    vec3 middle = way_to_light(light, ray.origin);
    vec3 sum = vec3(0.0f);
    for (uint i = view.first_sample; i < view.end_sample; ++i) {
        vec3 way = middle;
        if (soft)
            way = way_to_disc(middle, light.radius, sample_at(i, picture_at));
        ray.direction = unit_or_zero(way);
        if (dot(vector(point.normal), ray.direction) <= 0.0f)
            continue;
        float reach = (light.kind & 3u) == kLightPoint ? length(way) : kHuge;
        if (!is_stopped(ray, reach, complete))
            sum += lit_from(point, ray.direction);
    }
    return sum * light_strength(light) / float(soft ? light_view.light_samples : 1u);
}

void main()
{
    any_hit = true;
    rims_cut = true;
    uvec2 at;
    bool active_here = is_active(at);
    if (active_here) {
        uint band_pixel = band_index(at);
        LitPixel point = lit_pixels[band_pixel];
        if (point.pixel > 0.0f) {
            uvec2 picture_at = uvec2(at.x, at.y + view.first_row);
            bool complete = true;
            vec3 light = vec3(0.0f);
            if (view.gathered == kGatherSky)
                light = gather_sky(point, picture_at, complete);
            else
                light = gather_light(point, picture_at, complete);
            if (complete) {
                for (uint i = 0u; i < 3u; ++i)
                    pixels[band_pixel].rgba[i] += light[i];
            } else
                cast_again(band_pixel);
        }
    }
    tally_free_work();
}
