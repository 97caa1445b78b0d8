// What a map draws at a hit, and what it measures there. The CPU tracer's way is runtime/cpu_maps.h.

bool measures() { return is_curvature_map(drawn_map()) || drawn_map() == kMapDraft; }

Derivatives bezier_derivatives_at(PatchRecord patch, PatchShape shape, vec2 uv)
{
    return bezier_derivatives(patch.first_control_point, shape.degree_u, shape.degree_v, shape.rational, uv);
}

// Of a Bezier patch; near poles those a little way inside. Its control points lie where bezier_normal copied them.
Derivatives map_derivatives(PatchRecord patch, vec2 uv)
{
    PatchShape shape = patch_shape(patch.shape);
    Derivatives s;
    float thin = 0.0f;
    // one call in the code: drivers inline each
    for (int attempt = 0; attempt < 2; ++attempt) {
        Derivatives there = bezier_derivatives_at(patch, shape, attempt == 0 ? uv : from_pole(uv));
        if (attempt == 0 || is_pole(thin, there))
            s = there;
        thin = thinness(there);
        if (!(thin < kThin))
            break;
    }
    return s;
}

Curvatures native_curvatures(uint kind, PatchRecord patch, vec3 p)
{
    float r = patch.param[0];
    float second = patch.param[1];
    if (kind == kKindCylinder && has_kind(kKindCylinder))
        return cylinder_curvatures(r);
    if (kind == kKindCone && has_kind(kKindCone))
        return cone_curvatures(r, second, p);
    if (kind == kKindSphere && has_kind(kKindSphere))
        return sphere_curvatures(r);
    if (kind == kKindTorus && has_kind(kKindTorus))
        return torus_curvatures(r, second, p);
    return curvatures_of(0.0f, 0.0f);
}

// A vector along a patch's normal, in the world
vec3 normal_to_world(FrameInstance instance, PatchRecord patch, vec3 n)
{
    vec3 in_part = combine(vector(patch.axis_x), vector(patch.axis_y), vector(patch.axis_z), n);
    return combine(vector(instance.normal_x), vector(instance.normal_y), vector(instance.normal_z), in_part);
}

PixelSteps world_normal_steps(PatchRecord patch, FrameInstance instance, Derivatives s, PixelRows rows, vec3 normal)
{
    vec3 across = normal_to_world(instance, patch, cross(s.u, s.v));
    PixelSteps steps = normal_steps(s, rows);
    steps.x = normal_to_world(instance, patch, steps.x);
    steps.y = normal_to_world(instance, patch, steps.y);
    float per_length = 1.0f / max(length(across), 1e-30f);
    return unit_steps(normal, steps, dot(across, normal) < 0.0f ? -per_length : per_length);
}

// normal: unit, outward; to_eye: unit
MapColor map_hit(Hit hit, FrameInstance instance, PatchRecord patch, FaceRecord face, Ray eye_ray, vec3 normal,
                 vec3 to_eye)
{
    uint kind = patch.shape & 0xffu;
    bool is_bezier = kind == kKindBezier && has_kind(kKindBezier);
    PatchRay ray = patch_ray(instance, hit.instance, patch, eye_ray);
    vec3 p = ray.origin + hit.t * ray.direction;
    Derivatives s;
    if (is_bezier)
        s = map_derivatives(patch, clamp(hit.uv_patch, 0.0f, 1.0f));
    MapPoint point;
    point.normal = normal;
    point.to_eye = to_eye;
    point.normal_steps = PixelSteps(vec3(0.0f), vec3(0.0f));
    point.curvatures = curvatures_of(0.0f, 0.0f);
    if (is_curvature_map(drawn_map())) {
        Curvatures k;
        if (is_bezier)
            k = curvatures_of_derivatives(s);
        else
            k = native_curvatures(kind, patch, p);
        float turn = outward(patch, face, vec3(1.0f, 0.0f, 0.0f)).x;
        // |w0| = 1 in the world: its length in the part is that of a millimetre
        point.curvatures = turned_curvatures(k, turn * length(vector(instance.w0_hi)) / patch.scale);
    } else {
        if (!is_bezier)
            s = native_derivatives(kind, patch, p);
        float per_scale = 1.0f / patch.scale;
        vec3 axis_x = vector(patch.axis_x);
        vec3 axis_y = vector(patch.axis_y);
        vec3 axis_z = vector(patch.axis_z);
        vec3 step_x = project(axis_x, axis_y, axis_z, vector(instance.step_x)) * per_scale;
        vec3 step_y = project(axis_x, axis_y, axis_z, vector(instance.step_y)) * per_scale;
        PixelRows rows = pixel_rows(ray.direction, step_x, step_y, spread(ray.anchor + hit.t));
        point.normal_steps = world_normal_steps(patch, instance, s, rows, normal);
    }
    PixelSteps steps = PixelSteps(vector(view.step_x), vector(view.step_y));
    point.to_eye_steps = PixelSteps(vec3(0.0f), vec3(0.0f));
    if (!has_feature(kFeatureParallel))
        point.to_eye_steps = unit_steps(to_eye, steps, -1.0f / length(vector(view.w0) + eye_ray.across));
    return map_color(drawn_map(), map_view, point);
}
