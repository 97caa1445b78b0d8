// The nearest borders of a hit's face as edge words (shaders/shared/edge.h): line, border. The CPU tracer's way is
// runtime/cpu_edges.h.

// A border's point is measured in loops of so many iterations; where loops are limited, so many are left to a pixel.
const uint kNearestIterations = uint(kNearestSteps) + 2u;
const uint kEdgeIterations = 12000u;

struct NearestBorder {
    vec2 offset;
    float square; // of its length; kHuge: none
    float strength;
};

// What a hit is measured with
struct Measured {
    PatchRecord patch;
    uint kind;
    vec2 uv; // uv_face
    PixelRows rows;
    PixelMap map;
    Derivatives native; // of native kinds
    vec3 p;             // the hit in patch space, of Bezier patches
    float line_strength;
    vec2 reach_uv; // nothing farther counts
};

NearestBorder nearest_line;
NearestBorder nearest_border;

SurfacePoint bezier_at(PatchRecord patch, vec2 uv_face)
{
    vec2 uv = (uv_face - vec2(patch.uv_offset[0], patch.uv_offset[1])) / vec2(patch.uv_scale[0], patch.uv_scale[1]);
    PatchShape shape = patch_shape(patch.shape);
    iterations += 1u + point_iterations(shape);
    return patch_point(patch.first_control_point, shape, uv);
}

Derivatives native_derivatives(uint kind, PatchRecord patch, vec3 p)
{
    float r = patch.param[0];
    float second = patch.param[1];
    if (kind == kKindCylinder && has_kind(kKindCylinder))
        return cylinder_derivatives(p);
    if (kind == kKindCone && has_kind(kKindCone))
        return cone_derivatives(r, second, p);
    if (kind == kKindSphere && has_kind(kKindSphere))
        return sphere_derivatives(p);
    if (kind == kKindTorus && has_kind(kKindTorus))
        return torus_derivatives(r, torus_side(r, second, p), p);
    return plane_derivatives();
}

Measured measured_hit(Hit hit, FrameInstance instance, PatchRecord patch, Ray eye_ray)
{
    Measured m;
    m.patch = patch;
    m.kind = patch.shape & 0xffu;
    m.uv = hit.uv_face;
    PatchRay ray = patch_ray(instance, hit.instance, patch, eye_ray);
    m.p = ray.origin + hit.t * ray.direction;
    float per_scale = 1.0f / patch.scale;
    vec3 axis_x = vector(patch.axis_x);
    vec3 axis_y = vector(patch.axis_y);
    vec3 axis_z = vector(patch.axis_z);
    vec3 step_x = project(axis_x, axis_y, axis_z, vector(instance.step_x)) * per_scale;
    vec3 step_y = project(axis_x, axis_y, axis_z, vector(instance.step_y)) * per_scale;
    m.rows = pixel_rows(ray.direction, step_x, step_y, spread(ray.anchor + hit.t));
    vec2 uv_scale = vec2(patch.uv_scale[0], patch.uv_scale[1]);
    m.native = plane_derivatives();
    if (m.kind == kKindBezier && has_kind(kKindBezier)) {
        SurfacePoint s = bezier_at(patch, hit.uv_face);
        m.map = pixel_map(m.rows, s.du, s.dv, uv_scale);
    } else {
        m.native = native_derivatives(m.kind, patch, m.p);
        m.map = pixel_map(m.rows, m.native.u, m.native.v, uv_scale);
    }
    m.line_strength = view.line_width_px > 0.0f ? line_strength(seen_thickness(m.map), view.line_width_px) : 1.0f;
    return m;
}

void take_nearer(inout NearestBorder nearest, vec2 offset, float square, float strength)
{
    if (square < nearest.square)
        nearest = NearestBorder(offset, square, strength);
}

// Offers the border's point at uv_face, the nearest in the plane of the map.
void offer_border(Measured m, float reach, uint edge_class, vec2 uv_face)
{
    bool as_line = ((view.line_classes >> edge_class) & 1u) != 0u;
    bool as_border = view.border_reach_px > 0.0f;
    vec2 step = uv_face - m.uv;
    vec2 offset = to_pixels(m.map, step);
    if (!(as_line || as_border) || dot(offset, offset) > reach * reach || any(greaterThan(abs(step), m.reach_uv)))
        return;
    if (m.kind == kKindBezier && has_kind(kKindBezier)) {
        SurfacePoint there = bezier_at(m.patch, uv_face);
        offset = unless_turned(m.rows, m.map, there.du, there.dv, seen_step(m.rows, there.p - m.p));
    } else if (m.kind != kKindPlane)
        offset = seen_bent(m.rows, m.map, m.native, step / vec2(m.patch.uv_scale[0], m.patch.uv_scale[1]));
    float square = dot(offset, offset);
    if (as_line)
        take_nearer(nearest_line, offset, square, m.line_strength);
    if (as_border)
        take_nearer(nearest_border, offset, square, 1.0f);
}

void measure_line(Measured m, float reach, uint edge_class, vec2 a, vec2 b)
{
    ++edge_tests;
    float t = nearest_on_line(to_pixels(m.map, a - m.uv), to_pixels(m.map, b - m.uv));
    offer_border(m, reach, edge_class, a + (b - a) * t);
}

void measure_piece(Measured m, float reach, FaceRecord face, uint word, vec2 box_lo, vec2 box_hi)
{
    uint at = face.first_point + (word >> kPiecePointShift);
    bool cubic = (word & kPieceCubic) != 0u;
    uint edge_class = (word >> kPieceClassShift) & 3u;
    vec2 a = trim_points[at];
    vec2 d = trim_points[at + (cubic ? 3u : 1u)];
    // a piece is monotone: it lies in its ends' box
    if (any(lessThan(max(a, d), box_lo)) || any(greaterThan(min(a, d), box_hi)))
        return;
    if (!cubic) {
        measure_line(m, reach, edge_class, a, d);
        return;
    }
    ++edge_tests;
    vec2 b = trim_points[at + 1u];
    vec2 c = trim_points[at + 2u];
    float t = nearest_on_cubic(to_pixels(m.map, a - m.uv), to_pixels(m.map, b - m.uv), to_pixels(m.map, c - m.uv),
                               to_pixels(m.map, d - m.uv));
    iterations += kNearestIterations;
    offer_border(m, reach, edge_class, cubic_at(a, b, c, d, t).p);
}

uint cell_of(float x, uint count)
{
    return min(uint(clamp(x, 0.0f, 1.0f) * float(count)), count - 1u);
}

void measure_pieces(Measured m, float reach, uint face_index, FaceRecord face)
{
    uint size = border_words[2u * face_index];
    uint columns = size & 0xffffu;
    uint rows = size >> 16;
    if (columns == 0u)
        return;
    m.reach_uv = reach_in_cells(m.reach_uv, float(columns), float(rows));
    vec2 box_lo = m.uv - m.reach_uv;
    vec2 box_hi = m.uv + m.reach_uv;
    uint cells = border_words[2u * face_index + 1u];
    uvec2 i = uvec2(cell_of(box_lo.x, columns), cell_of(box_hi.x, columns));
    uvec2 j = uvec2(cell_of(box_lo.y, rows), cell_of(box_hi.y, rows));
    iterations = 0u;
    for (uint row = j.x; row <= j.y; ++row) {
        uint at = border_words[cells + row * columns + i.x];
        uint end = border_words[cells + row * columns + i.y + 1u];
        for (; at < end; ++at) {
            measure_piece(m, reach, face, border_words[at], box_lo, box_hi);
            ++iterations;
            if (iteration_limit > 0u && iterations > kEdgeIterations)
                return;
        }
    }
}

void measure_sides(Measured m, float reach, FaceRecord face, vec2 box_lo, vec2 box_hi)
{
    for (uint side = 0u; side < 4u; ++side) {
        uint edge_class = (face.border_classes >> (2u * side)) & 3u;
        bool along_v = side < 2u;
        bool low = side % 2u == 0u;
        float lo = along_v ? box_lo.x : box_lo.y;
        float hi = along_v ? box_hi.x : box_hi.y;
        if (edge_class == kEdgeSeam || (low ? lo > 0.0f : hi < 1.0f))
            continue;
        float at = low ? 0.0f : 1.0f;
        vec2 a = along_v ? vec2(at, 0.0f) : vec2(0.0f, at);
        vec2 b = along_v ? vec2(at, 1.0f) : vec2(1.0f, at);
        measure_line(m, reach, edge_class, a, b);
    }
}

float texture_distance(SdfFace sdf, vec2 uv)
{
    return sdf_distance(sdf, clamp(uv, vec2(0.0f), vec2(kUvBelowOne)));
}

// Where the texture that trims the face has its border
vec2 texture_border(SdfFace sdf, Measured m)
{
    vec2 half_texel = 0.5f / sdf.scale;
    vec2 du = vec2(half_texel.x, 0.0f);
    vec2 dv = vec2(0.0f, half_texel.y);
    vec2 gradient = vec2(texture_distance(sdf, m.uv + du) - texture_distance(sdf, m.uv - du),
                         texture_distance(sdf, m.uv + dv) - texture_distance(sdf, m.uv - dv)) *
                    0.5f / half_texel;
    return level_offset(m.map, texture_distance(sdf, m.uv), gradient);
}

// Moves what a piece said to where the texture has it.
void move_to(vec2 offset, inout NearestBorder nearest)
{
    if (nearest.square < kHuge && agrees(offset, nearest.offset))
        nearest = NearestBorder(offset, dot(offset, offset), nearest.strength);
}

uint word_within(NearestBorder nearest, float reach)
{
    return nearest.square <= reach * reach ? edge_word(nearest.offset, nearest.strength) : 0u;
}

// The words of the nearest line and the nearest border
uvec2 find_edges(Hit hit, Ray eye_ray)
{
    PatchRecord patch = patches[leaves[hit.leaf].patch];
    FaceRecord face = faces[patch.face];
    nearest_line = NearestBorder(vec2(0.0f), kHuge, 1.0f);
    nearest_border = nearest_line;
    Measured m = measured_hit(hit, instances[hit.instance], patch, eye_ray);
    float reach = max(view.line_reach_px, view.border_reach_px);
    m.reach_uv = reach_in_uv(m.map, reach);
    if ((face.flags & kFaceNaturalBorder) != 0u)
        measure_sides(m, reach, face, m.uv - m.reach_uv, m.uv + m.reach_uv);
    else
        measure_pieces(m, reach, patch.face, face);
    if (trims_by() == kTrimByTexture && face.sdf_size != 0u) {
        SdfFace sdf = sdf_face(face);
        if (in_texture(m.uv, 1.0f / sdf.scale)) {
            vec2 at = texture_border(sdf, m);
            move_to(at, nearest_line);
            move_to(at, nearest_border);
        }
    }
    return uvec2(word_within(nearest_line, view.line_reach_px), word_within(nearest_border, view.border_reach_px));
}
