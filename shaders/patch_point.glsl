// Points of Bezier patches. A degree that all of the pack's patches have, and the largest, are known when the driver
// compiles: loops that it unrolls need no array that is indexed at run time, and no mask of lanes that go on.

// PatchRecord.shape's fields
struct PatchShape {
    int degree_u;
    int degree_v;
    bool rational;
};

PatchShape patch_shape(uint shape)
{
    PatchShape fields;
    fields.degree_u = int(common_degree_u > 0u ? common_degree_u : (shape >> 8) & 0xffu);
    fields.degree_v = int(common_degree_v > 0u ? common_degree_v : (shape >> 16) & 0xffu);
    fields.rational = has_feature(kFeatureRational) && (shape & kShapeRational) != 0u;
    return fields;
}

// S and its first derivatives, patch units; `first` as in bezier_point
SurfacePoint patch_point(uint first, PatchShape shape, vec2 uv)
{
    return bezier_point(first, shape.degree_u, shape.degree_v, shape.rational, uv);
}

// Loop iterations of one patch_point, as bezier_point's loops stand
uint point_iterations(PatchShape shape)
{
    uint u = uint(shape.degree_u);
    uint v = uint(shape.degree_v);
    return u * (u + 1u) / 2u + v * (v + 1u) / 2u + (u + 1u) * (v + 2u);
}

// Where patch_point fetches them: beside the invocation, where the driver reads buffers slowly
void copy_control_points(PatchRecord patch, PatchShape shape)
{
    if (local_floats == 0u)
        return;
    uint count = uint((shape.degree_u + 1) * (shape.degree_v + 1)) * (shape.rational ? 4u : 3u);
    local_first = patch.first_control_point;
    for (uint i = 0u; i < count && i < local_floats; ++i)
        local_points[i] = control_points[local_first + i];
    iterations += count;
}
