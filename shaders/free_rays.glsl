// Rays that begin anywhere, in the spaces of trees and patches. `past` of a hit is s, in the top tree's units.

const bool kRaysCertify = false;

struct Ray {
    vec3 origin;    // the top tree's units
    vec3 direction; // unit
    float pixel;    // how well hits must be known: a pixel's width where the ray comes from
};

float ray_begin()
{
    return 0.0f;
}
float tau_of(float past)
{
    return past;
}
float spread(float tau)
{
    return tau;
}

TreeRay tree_ray(vec3 origin, vec3 direction)
{
    return TreeRay(origin, vec3(safe_inverse(direction.x), safe_inverse(direction.y), safe_inverse(direction.z)), 0.0f);
}
TreeRay top_ray(Ray ray)
{
    return tree_ray(ray.origin, ray.direction);
}

vec3 to_part_vector(WorldToPart to, vec3 v)
{
    return project(vector(to.row_x), vector(to.row_y), vector(to.row_z), v);
}
TreeRay part_ray(FrameInstance, uint instance_index, Ray ray)
{
    WorldToPart to = to_part[instance_index];
    return tree_ray(to_part_vector(to, ray.origin) + vector(to.offset), to_part_vector(to, ray.direction));
}

PatchRay patch_ray(FrameInstance, uint instance_index, PatchRecord patch, Ray whole)
{
    WorldToPart to = to_part[instance_index];
    precise vec3 origin = to_part_vector(to, whole.origin) + vector(to.offset);
    precise vec3 off = (origin - vector(patch.origin_hi)) - vector(patch.origin_lo);
    precise float per_scale = 1.0f / patch.scale;
    vec3 axis_x = vector(patch.axis_x);
    vec3 axis_y = vector(patch.axis_y);
    vec3 axis_z = vector(patch.axis_z);
    vec3 far_origin = project(axis_x, axis_y, axis_z, off) * per_scale;
    PatchRay ray;
    ray.direction = project(axis_x, axis_y, axis_z, to_part_vector(to, whole.direction)) * per_scale;
    // t = 0 where the ray is nearest to the patch's middle, so that what is large has cancelled
    float square = dot(ray.direction, ray.direction);
    ray.anchor = -dot(far_origin, ray.direction) / square;
    ray.origin = far_origin + ray.anchor * ray.direction;
    ray.past = ray.anchor;
    ray.slack = free_rounding(length(ray.origin), sqrt(square), ray.anchor, length(whole.origin));
    ray.width = whole.pixel * to.scale * per_scale;
    ray.pixel = ray.width;
    return ray;
}
