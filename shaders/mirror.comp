// Mirrors: follows each pixel's ray from the mirror that it met, one reflection a dispatch, and in the last one adds up
// what came along. Between them the light at what was met is gathered (light.comp).
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_basic : require

#include "shaders/free_pass.glsl"

// What the pixel's ray meets from the mirror `point`: becomes its LitPixel, its colour the light there without rays.
// Where it meets nothing its way ends. Returns false where the driver's loop limit would have cut the walk short.
bool reflect_ray(uint band_pixel, LitPixel point, inout PathState path)
{
    vec3 normal = vector(point.normal);
    vec3 to_eye = vector(point.to_eye);
    Ray ray = Ray(ray_start(point), normal * (2.0f * dot(normal, to_eye)) - to_eye, point.pixel);
    float reach = kHuge;
    if (has_feature(kFeatureCut))
        reach = cut_free_ray(ray.origin, ray.direction, reach);
    Hit hit = Hit(reach, 0.0f, vec2(0.0f), vec2(0.0f), kNoLeaf, 0xffffffffu, kHuge, false, true, 0.0f);
    ++free_ray_count;
    if (!walk(ray, Guess(kNoLeaf, 0u), hit))
        return false;
    if (hit.leaf == kNoLeaf) {
        vec3 behind = vector(light_view.background);
        if (has_feature(kFeatureEnvironment))
            behind = environment_along(ray.direction);
        for (uint i = 0u; i < 3u; ++i)
            path.mirrored[i] += path.weight * behind[i];
        path.weight = 0.0f;
        return true;
    }
    FrameInstance instance = instances[hit.instance];
    PatchRecord patch = patches[leaves[hit.leaf].patch];
    FaceRecord face = faces[patch.face];
    vec3 back = -ray.direction;
    vec3 met = world_normal(hit, instance, patch, face, ray);
    float size = length(met);
    met = size > 0.0f ? met / size : back;
    MaterialRecord material = face_material(patch.face, face, hit.instance, instance);
    LitPixel next = lit_point(ray.origin + hit.past * ray.direction, point.pixel, met, back, material);
    lit_pixels[band_pixel] = next;
    path.mirror = material.mirror;
    vec3 light = light_without_rays(next);
    for (uint i = 0u; i < 3u; ++i)
        pixels[band_pixel].rgba[i] = light[i];
    return true;
}

void main()
{
    rims_cut = true;
    uvec2 at;
    bool active_here = is_active(at);
    if (active_here) {
        uint band_pixel = band_index(at);
        LitPixel point = lit_pixels[band_pixel];
        PathState path = paths[band_pixel];
        vec3 color = vec3(pixels[band_pixel].rgba[0], pixels[band_pixel].rgba[1], pixels[band_pixel].rgba[2]);
        if (view.gathered == 0u) {
            path.weight = 1.0f;
            path.mirrored = float[3](0.0f, 0.0f, 0.0f);
            if (point.pixel == 0.0f)
                path.mirror = 0.0f;
        }
        bool last = view.gathered == light_view.mirror_depth;
        float kept = path.weight * (last ? 1.0f : 1.0f - path.mirror);
        for (uint i = 0u; i < 3u; ++i)
            path.mirrored[i] += kept * color[i];
        path.weight -= kept;
        bool complete = true;
        if (last) {
            for (uint i = 0u; i < 3u; ++i)
                pixels[band_pixel].rgba[i] = path.mirrored[i];
        } else if (path.weight > 0.0f)
            complete = reflect_ray(band_pixel, point, path);
        if (!complete)
            cast_again(band_pixel);
        else {
            if (!last && path.weight == 0.0f)
                lit_pixels[band_pixel].pixel = 0.0f;
            paths[band_pixel] = path;
        }
    }
    tally_free_work();
}
