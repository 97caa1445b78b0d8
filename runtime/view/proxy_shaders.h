// The shaders of the first picture, GLSL 1.50. The light is the tracers' own (shaders/shared/shading.h), taken over at
// build time.
#pragma once

namespace trimray {

inline constexpr const char* kProxyVertexShader = R"TEXT(#version 150
in vec3 position;        // part units
in vec4 face_color;      // sRGB; alpha 0: the placement's
in vec4 row_x, row_y, row_z; // part units to view coordinates
in vec4 placement_color; // sRGB
uniform vec4 projection; // scale x, scale y, depth scale, depth offset
uniform bool parallel;
out vec3 seen;           // view coordinates
flat out vec3 srgb;
void main()
{
    vec4 p = vec4(position, 1);
    seen = vec3(dot(row_x, p), dot(row_y, p), dot(row_z, p));
    srgb = face_color.a > 0.5 ? face_color.rgb : placement_color.rgb;
    gl_Position = vec4(seen.xy * projection.xy, projection.z * seen.z + projection.w, parallel ? 1.0 : seen.z);
}
)TEXT";

/// What shading.h needs of the language it is written in (shaders/shared/language.h).
inline constexpr const char* kProxyShadingPrelude = R"TEXT(#version 150
#define SHARED_OPEN
#define SHARED_CLOSE
#define FN
#define scalar float
#define real float
#define real3 vec3
#define select(m, a, b) ((m) ? (a) : (b))
#define scalar_pow pow
)TEXT";

inline constexpr const char* kProxyShading =
#include "shading.glsl.inc"
    ;

inline constexpr const char* kProxyFragmentShader = R"TEXT(
in vec3 seen;
flat in vec3 srgb;
uniform bool parallel;
uniform vec3 right, up, forward; // the camera's, in the world
uniform vec4 cuts[6];
uniform int cut_count;
out vec4 pixel;
vec3 in_world(vec3 v)
{
    return right * v.x + up * v.y + forward * v.z;
}
float srgb_of_linear(float c)
{
    return c <= 0.0031308 ? 12.92 * c : 1.055 * pow(c, 1.0 / 2.4) - 0.055;
}
void main()
{
    for (int i = 0; i < cut_count; ++i)
        if (dot(cuts[i].xyz, seen) + cuts[i].w > 0.0)
            discard;
    vec3 to_eye = parallel ? vec3(0, 0, -1) : normalize(-seen);
    vec3 across = cross(dFdx(seen), dFdy(seen)); // of the triangle
    float size = length(across);
    vec3 normal = size > 0.0 ? across / size : to_eye;
    vec3 color = vec3(linear_of_srgb(srgb.r), linear_of_srgb(srgb.g), linear_of_srgb(srgb.b));
    vec3 light = clamp(shade(color, in_world(normal), in_world(to_eye)), 0.0, 1.0);
    pixel = vec4(srgb_of_linear(light.r), srgb_of_linear(light.g), srgb_of_linear(light.b), 1);
}
)TEXT";

} // namespace trimray
