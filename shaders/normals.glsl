// Normals of hits.

// S_u x S_v of a Bezier patch; at a pole or along a degenerate side the one a little way inside
vec3 bezier_normal(PatchRecord patch, vec2 uv)
{
    const float kFlat = 1e-10f; // square of the sine, or of the ratio of lengths, that rounding leaves no digits
    const float kInwards = 1.0f / 2048.0f;
    PatchShape shape = patch_shape(patch.shape);
    copy_control_points(patch, shape);
    vec3 normal = vec3(0.0f);
    bool flat_there = true;
    for (int attempt = 0; attempt < 2 && flat_there; ++attempt) {
        SurfacePoint s = patch_point(patch.first_control_point, shape, uv);
        normal = cross(s.du, s.dv);
        float du2 = dot(s.du, s.du);
        float dv2 = dot(s.dv, s.dv);
        flat_there = dot(normal, normal) <= kFlat * du2 * dv2 || du2 <= kFlat * dv2 || dv2 <= kFlat * du2;
        uv += (0.5f - uv) * kInwards;
    }
    return normal;
}

// The normal in the world, outward as the face's orientation says, of any length
vec3 world_normal(Hit hit, FrameInstance instance, PatchRecord patch, FaceRecord face, Ray whole_ray)
{
    uint kind = patch.shape & 0xffu;
    PatchRay ray = patch_ray(instance, hit.instance, patch, whole_ray);
    vec3 p = ray.origin + hit.t * ray.direction;
    vec3 n;
    if (kind == kKindBezier && has_kind(kKindBezier))
        n = bezier_normal(patch, clamp(hit.uv_patch, 0.0f, 1.0f)); // beyond a pole's side a patch is turned inside out
    else
        n = native_normal(kind, patch, p);
    n = combine(vector(patch.axis_x), vector(patch.axis_y), vector(patch.axis_z), outward(patch, face, n));
    return combine(vector(instance.normal_x), vector(instance.normal_y), vector(instance.normal_z), n);
}
