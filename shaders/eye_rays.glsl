// The pixels' rays from the eye in the spaces of trees and patches (shaders/shared/precision.h).

// Certificates are made for these rays
const bool kRaysCertify = true;

struct Ray {
    vec2 pixel;  // from the picture's middle
    vec3 across; // w - w0, world; of parallel rays mm to the side
};

// How far pixels' rays have spread at `tau`, per pixel in units of the steps: from the eye in proportion; parallel rays
// are as far apart everywhere
float spread(float tau)
{
    return has_feature(kFeatureParallel) ? 1.0f : tau;
}
// What a pixel's direction has of `across`
vec3 turned(vec3 across)
{
    return has_feature(kFeatureParallel) ? vec3(0.0f) : across;
}

float cut_begin = -kHuge; // where the ray begins on its way, with kFeatureCut or kFeatureLayers

// `past` of the ray's begin: the eye, a section plane, or behind a surface that lets light through
float ray_begin()
{
    return has_feature(kFeatureCut | kFeatureLayers) ? max(cut_begin, -view.tau_ref) : -view.tau_ref;
}

// The ray's tau of a hit
float tau_of(float past)
{
    return view.tau_ref + past;
}

TreeRay top_ray(Ray eye_ray)
{
    vec3 across = eye_ray.across;
    TreeRay ray;
    ray.anchor = view.top_tau;
    ray.origin = vector(view.top_origin) + spread(view.top_tau) * view.per_world_scale * across;
    vec3 direction = (vector(view.w0) + turned(across)) * view.per_world_scale;
    ray.inverse = vec3(safe_inverse(direction.x), safe_inverse(direction.y), safe_inverse(direction.z));
    return ray;
}

TreeRay part_ray(FrameInstance instance, uint, Ray eye_ray)
{
    vec3 across = eye_ray.pixel.x * vector(instance.step_x) + eye_ray.pixel.y * vector(instance.step_y);
    TreeRay ray;
    ray.anchor = instance.node_tau;
    ray.origin = vector(instance.node_origin) + spread(instance.node_tau) * across;
    vec3 direction = vector(instance.w0_hi) + turned(across);
    ray.inverse = vec3(safe_inverse(direction.x), safe_inverse(direction.y), safe_inverse(direction.z));
    return ray;
}

// Source: shaders/shared/precision.h
PatchRay patch_ray(FrameInstance instance, uint, PatchRecord patch, Ray eye_ray)
{
    vec3 w0 = vector(instance.w0_hi);
    precise vec3 across = eye_ray.pixel.x * vector(instance.step_x) + eye_ray.pixel.y * vector(instance.step_y);
    PatchRay ray;
    ray.anchor = dot(vector(patch.origin_hi) - vector(instance.eye_hi), w0) / dot(w0, w0);
    vec3 middle;
    for (int axis = 0; axis < 3; ++axis) {
        Pair eye = Pair(instance.eye_hi[axis], instance.eye_lo[axis]);
        Pair w = Pair(instance.w0_hi[axis], instance.w0_lo[axis]);
        Pair origin = Pair(patch.origin_hi[axis], patch.origin_lo[axis]);
        middle[axis] = anchored(eye, w, ray.anchor, origin);
    }
    precise float per_scale = 1.0f / patch.scale;
    vec3 axis_x = vector(patch.axis_x);
    vec3 axis_y = vector(patch.axis_y);
    vec3 axis_z = vector(patch.axis_z);
    ray.origin = project(axis_x, axis_y, axis_z, middle + spread(ray.anchor) * across) * per_scale;
    ray.direction = project(axis_x, axis_y, axis_z, w0 + turned(across)) * per_scale;
    ray.past = ray.anchor - view.tau_ref;
    // the patch's own arithmetic, |q| about 1, and one rounding of `past`
    ray.slack = 4e-7f * (1.0f + length(middle) * per_scale) / length(ray.direction) + 1.2e-7f * abs(ray.past);
    ray.pixel = instance.footprint * per_scale;
    ray.width = ray.pixel * abs(spread(ray.anchor));
    return ray;
}
