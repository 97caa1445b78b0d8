// Surfaces that let light through: adds a layer to what is seen of a pixel, nearest first, and at the end makes of all
// layers the pixel's colour.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "format/kd_layout.h"
#include "shaders/look_layout.h"
#include "shaders/material_layout.h"
// first: the formulas fetch through it, and they make `scalar`, a layout there, a type
#include "shaders/scene_buffers.glsl"

#include "shaders/shared/environment.h"
#include "shaders/shared/language.h"

#include "shaders/environment.glsl"
#include "shaders/places.glsl"
#include "shaders/band_pixels.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void add_layer(uint band_pixel)
{
    PathState path = paths[band_pixel];
    if (view.gathered == 0u) {
        path.left = 1.0f;
        path.layers = float[3](0.0f, 0.0f, 0.0f);
    }
    FramePixel layer = pixels[band_pixel];
    if ((layer.status & kPixelHit) != 0u) {
        float share = path.left * layer.rgba[3];
        for (uint i = 0u; i < 3u; ++i)
            path.layers[i] += share * layer.rgba[i];
        path.left -= share;
    } else
        path.begin = kHuge;
    if (path.left <= kLeastLeft)
        path.begin = kHuge;
    if (path.begin < kHuge)
        atomicAdd(stopped_count, 1u);
    paths[band_pixel] = path;
}

void finish(uint band_pixel, vec2 pixel)
{
    PathState path = paths[band_pixel];
    float alpha = 1.0f - path.left;
    vec3 sum = vector(path.layers);
    if (has_feature(kFeatureEnvironment)) {
        sum += path.left * environment_along(place_along(pixel));
        alpha = 1.0f;
    }
    vec3 color = alpha > 0.0f ? sum / alpha : vec3(0.0f);
    pixels[band_pixel].rgba = float[4](color.x, color.y, color.z, alpha);
}

void main()
{
    uvec2 at;
    if (!is_active(at))
        return;
    vec2 pixel = pixel_at(at);
    uint band_pixel = band_index(at);
    if (view.gathered == kBlendAll)
        finish(band_pixel, pixel);
    else
        add_layer(band_pixel);
}
