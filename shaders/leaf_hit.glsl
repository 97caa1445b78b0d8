// A ray against one leaf: its box, the roots, the face's domain and its trims. What a ray is says eye_rays.glsl or
// free_rays.glsl.

const float kBoxMargin = 1e-6f;                    // patch units: the ray's rounding, and the box's
const uint kRunIterations = 24u + 27u;             // bound of kd_crossed: bisections, halvings of a run
const uint kCurveIterations = 32u;                 // bound of left_of_cubic
const uint kTorusIterations = 3u * 24u + 4u * 32u; // bound of torus_roots

// Where loops are limited, one leaf may take so many iterations: 13 steps at degree 25, and a few hundred trim pieces.
// Where the degree is high, parts of a leaf may have to be left out, and the hit is in doubt.
const uint kRoundIterations = 20000u;
bool overrun = false; // a leaf took more

const uint kQuartersWork = 64u; // evaluations that the quarters of a part take, and theirs, about
uint group_iterations = 0u;      // of the whole subgroup, whose lanes share the driver's limit

// Where loops are limited, what a leaf's splitting may take: a sixth of what is left of three quarters of the limit, for
// leaves behind must be searched too
uint split_iterations()
{
    uint most = iteration_limit / 4u * 3u;
    return min(kRoundIterations / 2u, (most - min(group_iterations, most)) / 6u);
}

// A rim's back counts as a surface first, for few rays meet one: where it is what they see they are traced again.
bool rims_cut = false;

// crossed(run) of format/kd_layout.h. `first_point` is the run's.
bool kd_crossed(uint first_point, KdRun run, vec2 uv)
{
    uint stride = kd_stride(run);
    vec2 a = fetch_kd_point(first_point);
    vec2 b = fetch_kd_point(first_point + run.piece_count * stride);
    if (!kd_in_box(a, b, uv))
        return kd_crossed_beside(run, a, b, uv);
    return kd_left_of_piece(first_point + kd_piece_at(first_point, stride, run.piece_count, uv.y) * stride,
                            (run.word & kKdRunCubic) != 0u, uv, true);
}

bool inside_kd(KdFace face, vec2 uv)
{
    KdNode node = kd_nodes[face.first_node];
    for (uint depth = 1u; depth < kMaxKdDepth && !kd_is_leaf(node); ++depth) {
        bool beyond = (kd_splits_v(node) ? uv.y : uv.x) >= uintBitsToFloat(node.data);
        node = kd_nodes[face.first_node + kd_number(node) + (beyond ? 1u : 0u)];
        ++iterations;
    }
    bool inside = (node.word & kKdInside) != 0u;
    bool single = (node.word & kKdKindMask) == kKdLeafRun;
    uint run_count = kd_run_count(node);
    for (uint i = 0u; i < run_count; ++i) {
        KdRun run = KdRun(node.data, kd_number(node));
        if (!single)
            run = kd_runs[face.first_run + node.data + i];
        inside = differ(inside, kd_crossed(face.first_point + (run.word >> kKdPointShift), run, uv));
        ++curve_tests;
        iterations += 1u + kRunIterations;
        if (iteration_limit > 0u && iterations > kRoundIterations) {
            overrun = true;
            return false;
        }
    }
    return inside;
}

bool inside_trims(uint face_id, FaceRecord face, vec2 uv)
{
    if (!has_feature(kFeatureTrims) || (face.flags & kFaceNaturalBorder) != 0u)
        return true;
    if (trims_by() == kTrimByKd)
        return inside_kd(kd_faces[face_id], uv);
    // a face without pieces has neither cells nor texture, and no inside
    if ((trims_by() != kTrimByTexture && face.grid == 0u) || (trims_by() != kTrimByCells && face.sdf_size == 0u))
        return false;
    TrimFace trim = trim_face(face);
    if (trims_by() == kTrimByTexture)
        return sdf_inside(sdf_distance(sdf_face(face), uv));
    // the cell's class takes one fetch and decides most; the texture's four come before the pieces
    uint word = fetch_cell(cell_index(trim, uv));
    bool inside = cell_says_inside(word);
    if (!cell_is_mixed(word))
        return inside;
    if (trims_by() == kTrimByBoth) {
        float distance_texels = sdf_distance(sdf_face(face), uv);
        if (abs(distance_texels) > face.sdf_band_texels)
            return sdf_inside(distance_texels);
    }
    uint at = cell_first_entry(trim, word);
    for (;;) {
        CellEntry entry = cell_entries[at];
        inside = differ(inside, entry_crossed(trim, entry.word, entry.eta, uv, true));
        ++curve_tests;
        iterations += 1u + kCurveIterations;
        if (iteration_limit > 0u && iterations > kRoundIterations) {
            overrun = true;
            return false;
        }
        if (entry_is_last(entry.word))
            return inside;
        ++at;
    }
}

// The patch's normal S_u x S_v outwards: in left-handed axes S_u x S_v is the mirror image of the formula's
vec3 outward(PatchRecord patch, FaceRecord face, vec3 n)
{
    bool left_handed = dot(cross(vector(patch.axis_x), vector(patch.axis_y)), vector(patch.axis_z)) < 0.0f;
    bool reversed = (face.flags & kFaceReversed) != 0u;
    return left_handed != reversed ? -n : n;
}

// Whether the rectangle around uv with half sides `width` holds no trim: it lies in one cell and meets no box of a piece
// that passes through
bool lies_clear(FaceRecord face, vec2 uv, vec2 width)
{
    if (!has_feature(kFeatureTrims) || (face.flags & kFaceNaturalBorder) != 0u)
        return true;
    if ((trims_by() != kTrimByCells && trims_by() != kTrimByBoth) || face.grid == 0u)
        return false;
    TrimFace trim = trim_face(face);
    vec2 lo = clamp(uv - width, vec2(0.0f), vec2(kUvBelowOne));
    vec2 hi = clamp(uv + width, vec2(0.0f), vec2(kUvBelowOne));
    uint cell = cell_index(trim, lo);
    if (cell != cell_index(trim, hi))
        return false;
    uint word = fetch_cell(cell);
    for (uint at = cell_first_entry(trim, word); cell_is_mixed(word); ++at) {
        uint entry = cell_entries[at].word;
        if (meets_piece_box(trim, entry, lo, hi))
            return false;
        ++iterations;
        if (entry_is_last(entry) || (iteration_limit > 0u && iterations > kRoundIterations))
            break;
    }
    return true;
}

// Whether a point is inside the face's trims and, if asked, beside its rim (shaders/shared/rim.h). `unsure`: it may be
// on the other side of a trim, for rounding may have moved it by `blur`; 0 where that is too little to matter.
bool inside_face(uint face_id, FaceRecord face, vec2 uv, bool beside_rim, vec2 blur, out bool unsure)
{
    unsure = false;
    bool inside = true;
    int blurred = blur.x > 0.0f && !lies_clear(face, uv, blur) ? kCornerCount : 0;
    int count = 1 + blurred + (beside_rim ? kCornerCount : 0);
    for (int i = 0; i < count; ++i) {
        bool of_rim = i > blurred;
        vec2 q = uv;
        if (i > 0)
            q = corner_around(uv, of_rim ? rim_width(face.flags) : blur, (i - 1) % kCornerCount);
        if (!of_rim)
            q = clamp(q, vec2(0.0f), vec2(kUvBelowOne));
        bool here = in_domain(q) && inside_trims(face_id, face, min(q, vec2(kUvBelowOne)));
        if (i == 0 || of_rim)
            inside = inside && here;
        else
            unsure = unsure || here != inside;
        if (!inside && i >= blurred)
            break;
    }
    return inside;
}

// Hits of the ray's patch count as equally near as the nearest so far within this: the same whichever comes first
float as_near(PatchRay ray, Hit hit)
{
    return max(ray.slack, hit.slack);
}

// In front of the eye and not behind the nearest hit; `blur` goes on top of what is as near
bool in_range(PatchRay ray, float t, float blur, Hit hit)
{
    float past = ray.past + t;
    return t < kHuge && past > ray_begin() && past < hit.past + (as_near(ray, hit) + blur);
}

// Takes the root at t if it is in the face's domain, inside its trims and nearer than what was found. Of two hits
// within rounding one that lies in its leaf stays, for no bound hides that leaf, then the one of the lower instance and
// leaf, whatever the order. `back`: it may be a rim's; `blur`: as in in_range; `uv_blur`: as in inside_face.
void offer(PatchRay ray, uint face_id, FaceRecord face, uint leaf, uint instance, float t, vec2 uv_patch, vec2 uv_face,
           bool back, bool own, float blur, vec2 uv_blur, inout Hit hit)
{
    vec2 off = abs(uv_face - 0.5f);
    if (max(off.x, off.y) > 0.5f + kDomainSlack)
        return;
    float past = ray.past + t;
    bool first = instance < hit.instance || (instance == hit.instance && leaf < hit.leaf);
    if (own != hit.own)
        first = own;
    float near = as_near(ray, hit) + blur;
    if (!(past < hit.past + (first ? near : -near)))
        return;
    vec2 uv = clamp(uv_face, vec2(0.0f), vec2(kUvBelowOne));
    bool unsure;
    bool inside = inside_face(face_id, face, uv, back && rims_cut, uv_blur, unsure);
    if (unsure)
        hit.doubt = min(hit.doubt, past - near);
    if (!inside)
        return;
#ifdef TRIMRAY_COLLECTS
    collect_crossing(past, as_near(ray, hit), back, face.tolerance_mm, leaf, instance);
#else
    hit.past = past;
    hit.back = back;
    hit.own = own;
    hit.slack = ray.slack;
    hit.t = t;
    hit.uv_face = uv;
    hit.uv_patch = uv_patch;
    hit.leaf = leaf;
    hit.instance = instance;
#endif
}

// uv_patch of a point of a native surface
vec2 native_uv(uint kind, PatchRecord patch, vec3 p)
{
    switch (kind) {
    case kKindCylinder:
        return cylinder_uv(p);
    case kKindCone:
        return cone_uv(patch.param[0], patch.param[1], p);
    case kKindSphere:
        return sphere_uv(p);
    case kKindTorus:
        return torus_uv(patch.param[0], patch.param[1], p);
    default:
        return plane_uv(p);
    }
}

// Normal of a native surface at a point in patch space, of any length
vec3 native_normal(uint kind, PatchRecord patch, vec3 p)
{
    switch (kind) {
    case kKindCylinder:
        return cylinder_normal(p);
    case kKindCone:
        return cone_normal(patch.param[0], patch.param[1], p);
    case kKindSphere:
        return sphere_normal(p);
    case kKindTorus:
        return torus_normal(patch.param[0], patch.param[1], p);
    default:
        return plane_normal();
    }
}

vec2 face_uv(PatchRecord patch, uint kind, vec2 uv_patch)
{
    vec2 scale = vec2(patch.uv_scale[0], patch.uv_scale[1]);
    vec2 uv = vec2(patch.uv_offset[0], patch.uv_offset[1]) + scale * uv_patch;
    // the torus' second angle, unwrapped as pack_layout.h says
    bool wrapped = kind == kKindTorus && uv.y < 0.5f - kPi * scale.y;
    return vec2(uv.x, wrapped ? uv.y + 2.0f * kPi * scale.y : uv.y);
}

void native_hit(PatchRay ray, PatchRecord patch, FaceRecord face, uint kind, uint leaf, uint instance, bool rims,
                inout Hit hit)
{
    float r = patch.param[0];
    float second = patch.param[1];
    vec4 roots = vec4(kHuge);
    float touch = kHuge;
    if (kind == kKindTorus && has_kind(kKindTorus)) {
        TorusRoots found = torus_roots(r, second, ray.origin, ray.direction);
        roots = vec4(found.t0, found.t1, found.t2, found.t3);
        touch = found.touch;
        iterations += kTorusIterations;
    } else {
        RootPair found = RootPair(kHuge, kHuge, kHuge);
        if (kind == kKindPlane && has_kind(kKindPlane))
            found = plane_roots(ray.origin, ray.direction);
        else if (kind == kKindCylinder && has_kind(kKindCylinder))
            found = cylinder_roots(r, ray.origin, ray.direction);
        else if (kind == kKindCone && has_kind(kKindCone))
            found = cone_roots(r, second, ray.origin, ray.direction);
        else if (kind == kKindSphere && has_kind(kKindSphere))
            found = sphere_roots(r, ray.origin, ray.direction);
        roots.xy = vec2(found.t0, found.t1);
        touch = found.touch;
    }
    // where rounding decides whether a ray meets a surface, what lies behind is not certain
    float from = ray.past - ray.slack + touch;
    if (touch < kHuge && (from > ray_begin() || touch <= -kHuge))
        hit.doubt = min(hit.doubt, from);
    for (int i = 0; i < 4; ++i) {
        if (!in_range(ray, roots[i], 0.0f, hit))
            continue;
        vec3 p = ray.origin + roots[i] * ray.direction;
        vec2 uv_patch = native_uv(kind, patch, p);
        bool back = rims && dot(ray.direction, outward(patch, face, native_normal(kind, patch, p))) > 0.0f;
        offer(ray, patch.face, face, leaf, instance, roots[i], uv_patch, face_uv(patch, kind, uv_patch), back, true,
              0.0f, vec2(0.0f), hit); // alike from all leaves of its patch
    }
    iterations += 4u;
}

struct NewtonPatch {
    uint first_control_point;
    PatchShape shape;
    float enough;   // residual of the last step, patch units
    float rounding; // residual that rounding alone may leave, patch units
    uint work;      // loop iterations of a step
    RayPlanes planes;
};

SurfacePoint evaluate(NewtonPatch newton, vec2 uv)
{
    iterations += newton.work;
    return patch_point(newton.first_control_point, newton.shape, uv);
}

// Where Newton's iteration ended
struct Search {
    bool settled; // at a root
    bool exact;   // its last step is proved to end within rounding
    SurfacePoint s;
    SeenPoint seen;
    NewtonStep next;
    vec2 uv;
};

// What a search ended at; accepted anywhere on the patch, so that leaves leave no gaps
void offer_end(PatchRay ray, PatchRecord patch, FaceRecord face, NewtonPatch newton, LeafBox box, Search search,
               uint leaf, uint instance, bool rims, inout Hit hit)
{
    if (!search.settled)
        return;
    NewtonRoot root = newton_root(search.s, search.next, search.uv, search.exact, ray.origin, ray.direction);
    vec2 moved = root_blur(search.seen, newton.rounding);
    vec2 slack = patch_slack(vec2(patch.uv_scale[0], patch.uv_scale[1]));
    vec2 overlap = patch_overlap(moved, slack);
    vec2 within = clamp(root.uv, 0.0f, 1.0f);
    bool own = all(greaterThanEqual(within, box.uv_lo)) && all(lessThanEqual(within, box.uv_hi));
    // a leaf beside it finds the same root elsewhere along the ray, by as much as rounding moves it on the patch
    float blur = 0.0f;
    if (own != hit.own)
        blur = dot(min(moved, vec2(kNewtonOutside)), vec2(length(search.s.du), length(search.s.dv))) /
               length(ray.direction);
    if (!in_range(ray, root.t, blur, hit))
        return;
    vec2 off = abs(root.uv - 0.5f) - overlap;
    bool on_patch = max(off.x, off.y) <= 0.5f;
    vec2 uv_face = face_uv(patch, kKindBezier, root.uv);
    vec2 uv_blur = vec2(0.0f);
    float footprint = ray.pixel * spread(ray.anchor + root.t);
    float off_by = kRaysCertify ? more_than_hair(footprint, newton.rounding) : 0.0f;
    // where weights may not stay positive beyond a side, it is not certain that the patch goes on
    bool unsure = on_patch && newton.shape.rational && is_beyond_sides(root.uv);
    if (off_by > 0.0f) {
        vec2 patch_blur = root_blur(search.seen, off_by);
        uv_blur = patch_blur * abs(vec2(patch.uv_scale[0], patch.uv_scale[1]));
        unsure = unsure || is_beside_side(root.uv, patch_blur, slack) ||
                 is_beside_side(uv_face, uv_blur, vec2(kDomainSlack)) ||
                 (on_patch && is_depth_unsure(search.s, ray.direction, off_by, footprint));
    }
    if (unsure)
        hit.doubt = min(hit.doubt, ray.past + root.t - as_near(ray, hit) - blur);
    if (!on_patch)
        return;
    bool back = false;
    if (rims) {
        within = clamp(search.uv, 0.0f, 1.0f); // beyond a pole's side a patch is turned inside out
        SurfacePoint s = search.s;
        if (within != search.uv)
            s = evaluate(newton, within);
        back = dot(ray.direction, outward(patch, face, cross(s.du, s.dv))) > 0.0f;
    }
    offer(ray, patch.face, face, leaf, instance, root.t, root.uv, uv_face, back, own, blur, uv_blur, hit);
}

#include "shaders/stochastic.glsl"

// Parts of a leaf are numbered by the quarters that they lie in, 2 bits a depth, below them the depth
const uint kDepthBits = 3u;

uint part_depth(uint part)
{
    return part & 7u;
}

vec2 part_middle(LeafBox box, uint part)
{
    vec2 middle = leaf_middle(box);
    vec2 half_side = leaf_half_side(box);
    uint depth = part_depth(part);
    for (uint i = 1u; i <= depth; ++i) {
        uint quarter = part >> (kDepthBits + 2u * (depth - i));
        half_side *= 0.5f;
        middle += half_side * (2.0f * vec2(float(quarter & 1u), float(quarter >> 1u & 1u)) - 1.0f);
    }
    return middle;
}

uint quarter_of(uint part, uint quarter)
{
    return (part >> kDepthBits << 2u | quarter) << kDepthBits | (part_depth(part) + 1u);
}

// All roots in the leaf: of the whole of it, where its bend allows a proof that they are all, else of its parts. One
// loop of rectangles around one of steps, for the compiler makes copies of all that is called twice.
void bezier_hit(PatchRay ray, PatchRecord patch, FaceRecord face, LeafBox box, float box_past, uint leaf, uint instance,
                bool rims, inout Hit hit)
{
    NewtonPatch newton;
    newton.first_control_point = patch.first_control_point;
    newton.shape = patch_shape(patch.shape);
    copy_control_points(patch, newton.shape);
    newton.planes = ray_planes(ray.origin, ray.direction);
    newton.enough = last_residual(view.error_px * ray.width);
    newton.rounding = patch_rounding(newton.shape.degree_u, newton.shape.degree_v);
    newton.work = 1u + point_iterations(newton.shape);
    if (has_feature(kFeatureStochastic)) {
        newton_once(ray, patch, face, box, newton, leaf, instance, rims, hit);
        return;
    }
    vec2 lost = derivative_loss(box, vec2(patch.param[0], patch.param[1]), newton.shape.degree_u, newton.shape.degree_v);
    uint search_work = uint(kNewtonSteps + 2) * newton.work;
    LeafPlane plane;
    uint stack[3 * kDeepestSplit + 1];
    stack[0] = 0u; // the whole leaf
    int waiting = 1;
    int part_count = 0;
    bool spent = false; // too many parts stay open: 16 that are not split stand for the leaf
    bool doubtful = false;
    while (waiting > 0) {
        uint part = stack[--waiting];
        uint depth = part_depth(part);
        bool at_end = depth == uint(kDeepestSplit) || spent;
        if (iteration_limit > 0u && depth > 0u) {
            at_end = at_end || iterations + kQuartersWork * newton.work > split_iterations();
            if (iterations + search_work > 2u * split_iterations()) {
                doubtful = true;
                break;
            }
        }
        iterations += 1u + depth;
        float share = 1.0f / float(1u << depth);
        vec2 half_side = share * leaf_half_side(box);
        vec2 per_side = 1.0f / half_side;
        vec2 middle = part_middle(box, part);
        Search search;
        search.settled = false;
        search.exact = false;
        search.uv = middle;
        RootBox where = RootBox(middle - half_side, middle + half_side);
        RayBend bend;
        bool one = false;  // the rectangle holds one root at most
        bool none = false; // proved: there is no root in the rectangle
        uint met = 0xfu;   // its quarters that may hold one
        bool near = false;
        for (int step = 0;; ++step) {
            vec2 uv = search.uv;
            search.s = evaluate(newton, uv);
            if (step == 0 && depth == 0u)
                plane = leaf_plane(box, search.s.p, search.s.du, search.s.dv, lost);
            search.seen = seen_point(search.s, newton.planes);
            RayBend around;
            if (step == 0 && depth == 0u) {
                bend = middle_bend(plane, search.seen);
                around = bend;
            } else if (step == 0 || !one)
                around = bend_around(plane, newton.planes, search.seen, share);
            if (step == 0) {
                bend = around;
                one = holds_one(bend, 1.0f);
                if (depth > 0u) {
                    ++newton_steps;
                    at_end = at_end || splits_in_vain(plane, search.s, bend, share);
                }
                if (depth > 0u || !one) {
                    Sight sight = sight_of(plane, newton.planes, search.s, search.seen, share, newton.rounding);
                    none = passes_by(sight);
                    for (int quarter = 0; quarter < 4; ++quarter)
                        if (passes_quarter(sight, quarter))
                            met &= ~(1u << quarter);
                    iterations += 4u;
                }
                if (none || !(at_end || is_searched(bend)))
                    break;
            }
            NewtonStep next = newton_step(search.seen, uv);
            search.next = next;
            float off = farther(uv - middle, per_side);
            vec2 moved = next.uv - uv;
            float turn = (one ? bend.bend : around.bend) * farther(moved, per_side);
            float left = one ? bend_left(bend, off) : 1.0f;
            bool little = turns_little(turn, left);
            search.exact =
                newton_exact(plane, search.s, next, moved, turn, left, little, newton.rounding, newton.enough);
            search.settled = search.exact || newton_settled(next, little, near, newton.rounding);
            near = next.residual <= newton.rounding + next.blur;
            if (search.settled)
                break;
            if (!next.singular && farther(next.uv - middle, per_side) > 1.0f) {
                float from = one ? bend_from(bend, off) : around.bend;
                where = narrowed(where, plane, search.seen, uv, next.uv, from, per_side, newton.rounding);
                none = is_empty(where);
            }
            if (none || step == (one || at_end ? kNewtonSteps : kGrazingSteps))
                break;
            ++newton_steps;
            vec2 to =
                vec2(kept_near(next.uv.x, middle.x, half_side.x), kept_near(next.uv.y, middle.y, half_side.y));
            if (newton_stuck(next, uv, to))
                break;
            search.uv = to;
        }
        bool complete = none;
        if (search.settled) {
            // one root at most in a rectangle as large as to hold it
            complete = holds_one(bend, max(farther(search.uv - middle, per_side), 1.0f));
            if (!complete) {
                RayBend around = bend_around(plane, newton.planes, search.seen, share);
                complete = is_only_root(where, search.uv, around, per_side);
            }
            offer_end(ray, patch, face, newton, box, search, leaf, instance, rims, hit);
            doubtful = doubtful || is_blurred(search.uv, root_blur(search.seen, newton.rounding));
        }
        if (complete || (depth == 0u && box_past >= hit.past + as_near(ray, hit)))
            continue;
        if (iteration_limit > 0u && view.alone == 0u) {
            overrun = true; // lanes would split at different places, and their loops add up: alone, then
            return;
        }
        if (at_end) {
            doubtful = true;
            continue;
        }
        part_count += bitCount(met);
        if (part_count > kMostParts) {
            spent = true;
            doubtful = true;
            waiting = 0;
            for (uint sixteenth = 0u; sixteenth < 16u; ++sixteenth)
                stack[waiting++] = quarter_of(quarter_of(0u, sixteenth >> 2u), sixteenth & 3u);
            continue;
        }
        for (uint quarter = 4u; quarter > 0u; --quarter)
            if ((met >> (quarter - 1u) & 1u) != 0u)
                stack[waiting++] = quarter_of(part, quarter - 1u);
    }
    if (doubtful)
        hit.doubt = min(hit.doubt, min(box_past, hit.past)); // it may lie a little before its box, on the next leaf
}

void leaf_hit(uint leaf, uint instance_index, FrameInstance instance, Ray whole_ray, inout Hit hit)
{
    LeafRecord record = leaves[leaf];
    PatchRecord patch = patches[record.patch];
    PatchRay ray = patch_ray(instance, instance_index, patch, whole_ray);
    LeafBox box = decode_leaf(record);
    // a ray far from its patch has larger rounding
    float margin = kBoxMargin * (1.0f + length(ray.origin));
    BoxHit in_box = leaf_box_hit(box, ray.origin, ray.direction, margin);
    ++leaf_visits;
    if (!in_box.hit || ray.past + in_box.far < ray_begin() - ray.slack ||
        ray.past + in_box.near > hit.past + as_near(ray, hit))
        return;
    uint kind = patch.shape & 0xffu;
    FaceRecord face = faces[patch.face];
#ifdef TRIMRAY_COLLECTS
    bool rims = true; // on which side it is met must be known of every hit
#else
    bool rims = has_feature(kFeatureRims) && instance.outside != 0u && (face.flags & kFaceRims) != 0u;
#endif
    if (kind == kKindBezier) {
        if (has_kind(kKindBezier))
            bezier_hit(ray, patch, face, box, ray.past + in_box.near, leaf, instance_index, rims, hit);
    } else
        native_hit(ray, patch, face, kind, leaf, instance_index, rims, hit);
}
