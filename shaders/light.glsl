// The light at a pixel's hit (runtime/cpu_light.h does the same): the terms that need no rays, and the rays of those that
// do.

vec3 light_strength(LightRecord light)
{
    return vector(light.color);
}

// The way to a light from `place`, to its middle, of any length
vec3 way_to_light(LightRecord light, vec3 place)
{
    return (light.kind & 3u) == kLightPoint ? vector(light.place) - place : vector(light.place);
}

bool needs_rays(LightRecord light)
{
    return (light.kind & kLightShadows) != 0u;
}

// A hit at `place` where a pixel is `width` wide
LitPixel lit_point(vec3 place, float width, vec3 normal, vec3 to_eye, MaterialRecord material)
{
    vec3 side = dot(normal, to_eye) < 0.0f ? -normal : normal;
    return LitPixel(float[3](place.x, place.y, place.z), float[3](side.x, side.y, side.z),
                    float[3](to_eye.x, to_eye.y, to_eye.z), material.color, material.specular, width);
}

// Where the rays begin that leave it
vec3 ray_start(LitPixel point)
{
    vec3 place = vector(point.place);
    return place + start_distance(place, point.pixel * light_view.error_px) * vector(point.normal);
}

vec3 unit_or_zero(vec3 v)
{
    return v / max(length(v), 1e-20f);
}

vec3 lit_from(LitPixel point, vec3 to_light)
{
    return lit_by(vector(point.color), point.specular, vector(point.normal), vector(point.to_eye), to_light);
}

vec3 sky_on(LitPixel point)
{
    return vector(point.color) * (sky_light(vector(point.normal), vector(point.to_eye)) * light_view.sky);
}

// All that arrives without a question of what is between
vec3 light_without_rays(LitPixel point)
{
    vec3 sum = light_view.occlusion_samples == 0u ? sky_on(point) : vec3(0.0f);
    for (uint i = 0u; i < light_view.light_count; ++i) {
        LightRecord light = light_records[i];
        if (needs_rays(light))
            continue;
        vec3 to_light = vector(point.to_eye);
        if ((light.kind & 3u) != kLightEye)
            to_light = unit_or_zero(way_to_light(light, ray_start(point)));
        sum += lit_from(point, to_light) * light_strength(light);
    }
    return sum;
}
