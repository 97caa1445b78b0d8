// Primary rays, one an invocation: walks the top tree and the parts' trees, nearest child first, meets leaves, and
// shades the nearest hit. A frame is traced in bands of rows; each band is one dispatch.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_basic : require

#include "format/kd_layout.h"
#include "shaders/frame_layout.h"
// first: the formulas fetch through it, and they make `scalar`, a layout there, a type
#include "shaders/scene_buffers.glsl"

#include "shaders/shared/bezier.h"
#include "shaders/shared/bvh_node.h"
#include "shaders/shared/edge.h"
#include "shaders/shared/language.h"
#include "shaders/shared/leaf_box.h"
#include "shaders/shared/leaf_proof.h"
#include "shaders/shared/leaf_start.h"
#include "shaders/shared/precision.h"
#include "shaders/shared/quadric.h"
#include "shaders/shared/rim.h"
#include "shaders/shared/shading.h"
#include "shaders/shared/torus.h"
#include "shaders/shared/trim_kd.h"
#include "shaders/shared/trim_lookup.h"

#include "shaders/leaf_hit.glsl"
#include "shaders/last_hits.glsl"

#include "shaders/border_edges.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// A ray for one tree: the point at tau = anchor, and the direction
struct TreeRay {
    vec3 origin;
    vec3 inverse;
    float anchor;
};

TreeRay top_ray(vec3 across)
{
    TreeRay ray;
    ray.anchor = view.top_tau;
    ray.origin = vector(view.top_origin) + view.top_tau * view.per_world_scale * across;
    vec3 direction = (vector(view.w0) + across) * view.per_world_scale;
    ray.inverse = vec3(safe_inverse(direction.x), safe_inverse(direction.y), safe_inverse(direction.z));
    return ray;
}

TreeRay part_ray(FrameInstance instance, vec2 pixel)
{
    vec3 across = pixel.x * vector(instance.step_x) + pixel.y * vector(instance.step_y);
    TreeRay ray;
    ray.anchor = instance.node_tau;
    ray.origin = vector(instance.node_origin) + instance.node_tau * across;
    vec3 direction = vector(instance.w0_hi) + across;
    ray.inverse = vec3(safe_inverse(direction.x), safe_inverse(direction.y), safe_inverse(direction.z));
    return ray;
}

// A child that waits: its first tau, and its node or leaf
struct Waiting {
    float tau;
    uint item;
};

Waiting waiting_child(BvhNode node, NodeRay ray, TreeRay tree_ray, int child, float tau_max)
{
    ChildHit hit = child_hit(node, ray, child, -tree_ray.anchor, tau_max - tree_ray.anchor);
    bool exists = node.child[child] != kBvhEmpty;
    return Waiting(exists && hit.hit ? hit.near + tree_ray.anchor : kHuge, node.child[child]);
}

void nearer_first(inout Waiting a, inout Waiting b)
{
    if (b.tau < a.tau) {
        Waiting c = a;
        a = b;
        b = c;
    }
}

Waiting stack[stack_size];
uint stack_top = 0u;

void push(Waiting waiting)
{
    if (waiting.tau < kHuge) {
        stack[stack_top] = waiting;
        ++stack_top;
    }
}

void push_children(BvhNode node, TreeRay tree_ray, float tau_max)
{
    NodeRay ray = node_ray(node, tree_ray.origin, tree_ray.inverse);
    Waiting a = waiting_child(node, ray, tree_ray, 0, tau_max);
    Waiting b = waiting_child(node, ray, tree_ray, 1, tau_max);
    Waiting c = waiting_child(node, ray, tree_ray, 2, tau_max);
    Waiting d = waiting_child(node, ray, tree_ray, 3, tau_max);
    nearer_first(a, b); // a sorting network of five comparisons
    nearer_first(c, d);
    nearer_first(a, c);
    nearer_first(b, d);
    nearer_first(b, c);
    push(d);
    push(c);
    push(b);
    push(a);
    ++node_visits;
}

// No hit can be nearer than what begins beyond this: the nearest so far, and the rounding of a distance
float hit_tau(Hit hit)
{
    float tau = view.tau_ref + hit.past;
    return hit.past < kHuge ? tau + max(4.0f * kRounding * abs(tau), hit.slack) : kHuge;
}

// Walks the trees until nothing nearer can wait; the guess is searched before all others, and only then. Returns false
// where the driver's loop limit would have cut it short.
bool walk(vec2 pixel, vec3 across, Guess guess, inout Hit hit)
{
    const uint kNoPart = 0xffffffffu;
    uint part_floor = kNoPart; // what the stack holds below is the top tree's
    uint instance_index = 0u;
    FrameInstance instance;
    TreeRay ray = top_ray(across);
    stack_top = 0u;
    push(Waiting(0.0f, 0u));
    bool guess_waits = has_feature(kFeatureReuse) && guess.leaf != kNoLeaf;
    if (guess_waits)
        push(Waiting(0.0f, kBvhLeaf | guess.instance));
    while (stack_top > 0u) {
        iterations = 1u;
        if (part_floor != kNoPart && stack_top == part_floor) {
            part_floor = kNoPart;
            ray = top_ray(across);
        }
        --stack_top;
        Waiting next = stack[stack_top];
        float tau_max = hit_tau(hit);
        if (next.tau <= tau_max) {
            uint index = next.item & ~kBvhLeaf;
            bool is_leaf = (next.item & kBvhLeaf) != 0u;
            bool in_part = part_floor != kNoPart;
            if (!is_leaf) {
                if (in_part)
                    push_children(part_nodes[instance.first_node + index], ray, tau_max);
                else
                    push_children(top_nodes[index], ray, tau_max);
            } else if (!in_part) {
                instance_index = index;
                instance = instances[index];
                ray = part_ray(instance, pixel);
                part_floor = stack_top;
                push(Waiting(next.tau, guess_waits ? kBvhLeaf | (guess.leaf - instance.first_leaf) : 0u));
            } else {
                uint leaf = instance.first_leaf + index;
                bool is_guess = has_feature(kFeatureReuse) && leaf == guess.leaf && instance_index == guess.instance;
                if (!is_guess || guess_waits)
                    leaf_hit(leaf, instance_index, instance, pixel, hit);
                guess_waits = false;
            }
        }
        if (iteration_limit > 0u) {
            group_iterations += subgroupMax(iterations);
            if (group_iterations > iteration_limit || overrun)
                return false;
        }
    }
    return true;
}

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
vec3 world_normal(Hit hit, FrameInstance instance, PatchRecord patch, FaceRecord face, vec2 pixel)
{
    uint kind = patch.shape & 0xffu;
    PatchRay ray = patch_ray(instance, patch, pixel);
    vec3 p = ray.origin + hit.t * ray.direction;
    vec3 n;
    if (kind == kKindBezier && has_kind(kKindBezier))
        n = bezier_normal(patch, clamp(hit.uv_patch, 0.0f, 1.0f)); // beyond a pole's side a patch is turned inside out
    else
        n = native_normal(kind, patch, p);
    n = combine(vector(patch.axis_x), vector(patch.axis_y), vector(patch.axis_z), outward(patch, face, n));
    return combine(vector(instance.normal_x), vector(instance.normal_y), vector(instance.normal_z), n);
}

vec3 linear_color(uint rgba)
{
    return vec3(linear_of_srgb(float(rgba & 0xffu) / 255.0f), linear_of_srgb(float((rgba >> 8) & 0xffu) / 255.0f),
                linear_of_srgb(float((rgba >> 16) & 0xffu) / 255.0f));
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

FramePixel hit_pixel(Hit hit, vec2 pixel, vec3 across)
{
    FrameInstance instance = instances[hit.instance];
    LeafRecord leaf = leaves[hit.leaf];
    PatchRecord patch = patches[leaf.patch];
    FaceRecord face = faces[patch.face];
    vec3 direction = vector(view.w0) + across;
    float stretch = length(direction);
    vec3 to_eye = direction / -stretch;
    vec3 normal = world_normal(hit, instance, patch, face, pixel);
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
    if (has_feature(kFeatureShade)) {
        uint rgba = instance.color_rgba >> 24 != 0u ? instance.color_rgba : kDefaultColor;
        if ((face.flags & kFaceHasColor) != 0u)
            rgba = face.color_rgba;
        vec3 color = shade(linear_color(rgba), normal, to_eye);
        result.rgba = float[4](color.x, color.y, color.z, 1.0f);
    }
    return result;
}

// Adds a subgroup's sum to a count of two words
void tally(uint count, uint amount)
{
    uint sum = subgroupAdd(amount);
    if (subgroupElect() && sum > 0u) {
        uint before = atomicAdd(counts[2u * count], sum);
        if (before + sum < before)
            atomicAdd(counts[2u * count + 1u], 1u);
    }
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
        vec3 across = pixel.x * vector(view.step_x) + pixel.y * vector(view.step_y);
        uint picture_pixel = (view.first_row + at.y) * view.width + at.x;
        Hit before = Hit(kHuge, 0.0f, vec2(0.0f), vec2(0.0f), 0xffffffffu, 0xffffffffu, kHuge, false, false, 0.0f);
        if (has_feature(kFeatureKept))
            before = load_kept(picture_pixel);
        if (has_feature(kFeatureStochastic))
            before.doubt = -kHuge; // plain Newton claims nothing
        Guess guess = Guess(kNoLeaf, 0u);
        // where the loop limit bears on what is searched, alone, the picture must not hang on the last one
        if (has_feature(kFeatureReuse) && view.alone == 0u)
            guess = guess_hit(uvec2(at.x, view.first_row + at.y), pixel);
        Hit hit;
        bool complete;
        for (int attempt = 0; attempt < 2; ++attempt) {
            hit = before;
            complete = walk(pixel, across, guess, hit);
            if (!complete || !hit.back || rims_cut)
                break;
            rims_cut = true;
        }
        if (has_feature(kFeatureKept)) {
            // a pixel changes only where its new hit is nearer than what was kept
            if (complete && hit.past < before.past)
                store_kept(picture_pixel, hit);
            else
                hit = before;
        }
        if (has_feature(kFeatureReuse))
            keep_hit(picture_pixel, hit, across);
        FramePixel result = miss_pixel(hit.doubt < kHuge);
        if (hit.past < kHuge)
            result = hit_pixel(hit, pixel, across);
        if (!complete)
            result.status |= kPixelStopped;
        if (has_feature(kFeatureEdges))
            edges[at.y * view.width + at.x] = hit.past < kHuge ? find_edges(hit, pixel) : uvec2(0u);
        pixels[at.y * view.width + at.x] = result;
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
