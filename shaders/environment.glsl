// What rays that meet nothing see.

vec3 environment_texel(uint index)
{
    return vec3(environment_rgb[3u * index], environment_rgb[3u * index + 1u], environment_rgb[3u * index + 2u]);
}

// `along`: of any length
vec3 environment_along(vec3 along)
{
    EnvironmentTexels at = environment_texels(along, environment_width, environment_height);
    vec3 above = mix(environment_texel(at.a), environment_texel(at.b), at.across);
    vec3 below = mix(environment_texel(at.c), environment_texel(at.d), at.across);
    return mix(above, below, at.down);
}
