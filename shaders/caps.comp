// Caps of section planes: whether the point where a pixel's ray begins at a plane is inside of a solid. More surfaces
// leave than enter then on the way from it to infinity. One dispatch a question (shaders/shared/section.h): the first
// two of every such pixel, the third where these disagree; the last one also writes the caps over the pixels.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_basic : require

#define TRIMRAY_COLLECTS
#include "shaders/free_pass.glsl"

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
    if (crossings_lost)
        cap.inside |= kCapUnsure;
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
    uint answers = cap.inside & ~kCapUnsure;
    bool agreed = (answers & 3u) == 0u || (answers & 3u) == 3u;
    bool certain = agreed && answers == cap.inside && !has_feature(kFeatureStochastic);
    if (bitCount(answers) < 2) {
        if (!certain)
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
    result.status = kPixelHit | (certain ? kPixelCertified : 0u);
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
    uvec2 at;
    bool active_here = is_active(at);
    if (active_here) {
        vec2 pixel = pixel_at(at);
        uint band_pixel = band_index(at);
        CutSpan span = cut_span(pixel);
        if (span.plane != kNoPlane && span.begin < span.end) {
            CapState cap = CapState(0u, 0u, kNoLeaf);
            if (view.gathered > 0u)
                cap = caps[band_pixel];
            bool last = view.gathered + 1u == kInsideQuestions;
            bool disagree = (cap.inside & 3u) == 1u || (cap.inside & 3u) == 2u;
            bool complete = true;
            if (!last || disagree)
                complete = ask(pixel, span.begin, cap);
            if (complete) {
                caps[band_pixel] = cap;
                if (last)
                    write_cap(band_pixel, pixel, span, cap);
            } else
                cast_again(band_pixel);
        }
    }
    tally_free_work();
}
