// Primary rays, one an invocation: walks the top tree and the parts' trees, nearest child first, meets leaves, and
// shades the nearest hit. A frame is traced in bands of rows; each band is one dispatch.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_basic : require

#include "shaders/frame_layout.h"
// first: the formulas fetch through it, and they make `scalar`, a layout there, a type
#include "shaders/scene_buffers.glsl"

#include "shaders/shared/bezier.h"
#include "shaders/shared/bvh_node.h"
#include "shaders/shared/language.h"
#include "shaders/shared/leaf_box.h"
#include "shaders/shared/patch_newton.h"
#include "shaders/shared/precision.h"
#include "shaders/shared/quadric.h"
#include "shaders/shared/shading.h"
#include "shaders/shared/torus.h"
#include "shaders/shared/trim_lookup.h"

#include "shaders/leaf_hit.glsl"

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

// Walks the trees until nothing nearer can wait. Returns false where the driver's loop limit would have cut it short.
bool walk(vec2 pixel, vec3 across, inout Hit hit)
{
    const uint kNoPart = 0xffffffffu;
    uint part_floor = kNoPart; // what the stack holds below is the top tree's
    uint instance_index = 0u;
    FrameInstance instance;
    TreeRay ray = top_ray(across);
    uint group_iterations = 0u; // of the whole subgroup, whose lanes share the driver's limit
    stack_top = 0u;
    push(Waiting(0.0f, 0u));
    while (stack_top > 0u) {
        iterations = 1u;
        if (part_floor != kNoPart && stack_top == part_floor) {
            part_floor = kNoPart;
            ray = top_ray(across);
        }
        --stack_top;
        Waiting next = stack[stack_top];
        if (next.tau <= hit.tau) {
            uint index = next.item & ~kBvhLeaf;
            bool is_leaf = (next.item & kBvhLeaf) != 0u;
            bool in_part = part_floor != kNoPart;
            if (!is_leaf) {
                if (in_part)
                    push_children(part_nodes[instance.first_node + index], ray, hit.tau);
                else
                    push_children(top_nodes[index], ray, hit.tau);
            } else if (!in_part) {
                instance_index = index;
                instance = instances[index];
                ray = part_ray(instance, pixel);
                part_floor = stack_top;
                push(Waiting(next.tau, 0u));
            } else
                leaf_hit(instance.first_leaf + index, instance_index, instance, pixel, hit);
        }
        if (iteration_limit > 0u) {
            group_iterations += subgroupMax(iterations);
            if (group_iterations > iteration_limit)
                return false;
        }
    }
    return true;
}

// The unit normal in the world, outward as the face's orientation says, and uv_face of a hit
vec3 world_normal(Hit hit, FrameInstance instance, PatchRecord patch, FaceRecord face, vec2 pixel)
{
    uint kind = patch.shape & 0xffu;
    vec3 axis_x = vector(patch.axis_x);
    vec3 axis_y = vector(patch.axis_y);
    vec3 axis_z = vector(patch.axis_z);
    PatchRay ray = patch_ray(instance, patch, pixel);
    vec3 p = ray.origin + hit.t * ray.direction;
    float r = patch.param[0];
    float second = patch.param[1];
    vec3 n = plane_normal();
    if (kind == kKindBezier && has_kind(kKindBezier)) {
        uint degree_u = (patch.shape >> 8) & 0xffu;
        uint degree_v = (patch.shape >> 16) & 0xffu;
        bool rational = has_feature(kFeatureRational) && (patch.shape & kShapeRational) != 0u;
        if (local_floats > 0u)
            copy_control_points(patch, (degree_u + 1u) * (degree_v + 1u) * (rational ? 4u : 3u));
        SurfacePoint s =
            bezier_point(patch.first_control_point, int(degree_u), int(degree_v), rational, hit.uv_patch);
        n = cross(s.du, s.dv);
    } else if (kind == kKindCylinder && has_kind(kKindCylinder))
        n = cylinder_normal(p);
    else if (kind == kKindCone && has_kind(kKindCone))
        n = cone_normal(r, second, p);
    else if (kind == kKindSphere && has_kind(kKindSphere))
        n = sphere_normal(p);
    else if (kind == kKindTorus && has_kind(kKindTorus))
        n = torus_normal(r, second, p);
    // in left-handed axes S_u x S_v is the mirror image of the formula's
    if (dot(cross(axis_x, axis_y), axis_z) < 0.0f)
        n = -n;
    if ((face.flags & kFaceReversed) != 0u)
        n = -n;
    n = combine(axis_x, axis_y, axis_z, n);
    n = combine(vector(instance.normal_x), vector(instance.normal_y), vector(instance.normal_z), n);
    float size = length(n);
    return size > 0.0f ? n / size : vec3(0.0f);
}

vec3 linear_color(uint rgba)
{
    return vec3(linear_of_srgb(float(rgba & 0xffu) / 255.0f), linear_of_srgb(float((rgba >> 8) & 0xffu) / 255.0f),
                linear_of_srgb(float((rgba >> 16) & 0xffu) / 255.0f));
}

FramePixel miss_pixel()
{
    FramePixel pixel;
    pixel.depth_mm = kHuge;
    pixel.normal = float[3](0.0f, 0.0f, 0.0f);
    pixel.uv_face = float[2](0.0f, 0.0f);
    pixel.face = 0u;
    pixel.instance = 0u;
    pixel.status = kPixelCertified;
    pixel.rgba = float[4](view.background[0], view.background[1], view.background[2], 0.0f);
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
    vec3 normal = world_normal(hit, instance, patch, face, pixel);
    FramePixel result;
    result.depth_mm = hit.tau * stretch;
    result.normal = float[3](normal.x, normal.y, normal.z);
    result.uv_face = float[2](hit.uv_face.x, hit.uv_face.y);
    result.face = patch.face;
    result.instance = hit.instance;
    bool flagged = (leaf.quat_z_flags >> 16 & kLeafFlagged) != 0u;
    result.status = kPixelHit | (flagged ? 0u : kPixelCertified);
    result.rgba = float[4](0.0f, 0.0f, 0.0f, 0.0f);
    if (has_feature(kFeatureShade)) {
        uint rgba = (face.flags & kFaceHasColor) != 0u ? face.color_rgba : instance.color_rgba;
        vec3 color = shade(linear_color(rgba), normal, -direction / stretch);
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
    bool in_band = at.x < view.width && at.y < view.row_count;
    bool complete = true;
    if (in_band) {
        vec2 pixel = vec2(float(at.x) + 0.5f - view.middle[0], float(at.y + view.first_row) + 0.5f - view.middle[1]);
        vec3 across = pixel.x * vector(view.step_x) + pixel.y * vector(view.step_y);
        Hit hit = Hit(kHuge, 0.0f, vec2(0.0f), vec2(0.0f), 0u, 0u);
        complete = walk(pixel, across, hit);
        FramePixel result = miss_pixel();
        if (hit.tau < kHuge)
            result = hit_pixel(hit, pixel, across);
        if (!complete)
            result.status = (result.status | kPixelStopped) & ~kPixelCertified;
        pixels[at.y * view.width + at.x] = result;
    }
    if (iteration_limit > 0u)
        tally(kCountStopped, complete ? 0u : 1u);
    if (has_feature(kFeatureCount)) {
        tally(kCountRays, in_band ? 1u : 0u);
        tally(kCountNodes, node_visits);
        tally(kCountLeaves, leaf_visits);
        tally(kCountNewton, newton_steps);
        tally(kCountCurves, curve_tests);
    }
}
