// The paper's own method: plain Newton from one start a leaf and frame, and hits that are kept from frame to frame.

Hit load_kept(uint pixel)
{
    KeptHit kept = kept_hits[pixel];
    vec2 uv_face = vec2(kept.uv_face[0], kept.uv_face[1]);
    vec2 uv_patch = vec2(kept.uv_patch[0], kept.uv_patch[1]);
    return Hit(kept.past, kept.t, uv_face, uv_patch, kept.leaf, kept.instance, kHuge, false);
}

void store_kept(uint pixel, Hit hit)
{
    float uv_face[2] = float[2](hit.uv_face.x, hit.uv_face.y);
    float uv_patch[2] = float[2](hit.uv_patch.x, hit.uv_patch.y);
    kept_hits[pixel] = KeptHit(hit.past, hit.t, uv_face, uv_patch, hit.leaf, hit.instance);
}

// Plain Newton from the frame's start in the leaf: ends where a step began within newton.enough of its ray, after
// kNewtonSteps, or at the bounds of its leaf's reach
void newton_once(PatchRay ray, PatchRecord patch, FaceRecord face, LeafBox box, NewtonPatch newton, uint leaf,
                 uint instance, inout Hit hit)
{
    vec2 uv = leaf_start(vec2(view.start[0], view.start[1]), box.uv_lo, box.uv_hi);
    bool settled = false;
    for (int step = 0; step <= kNewtonSteps; ++step) {
        SurfacePoint s =
            bezier_point(patch.first_control_point, int(newton.degree_u), int(newton.degree_v), newton.rational, uv);
        NewtonStep next = newton_step(s, newton.planes, uv);
        iterations += newton.work;
        if (settled) {
            // not `precise`: glslc follows precise values around this loop for ever
            float t = dot(s.p - ray.origin, ray.direction) / dot(ray.direction, ray.direction);
            vec2 overlap = patch_overlap(s, newton.planes, patch_rounding(int(newton.degree_u), int(newton.degree_v)));
            vec2 off = abs(uv - 0.5f) - overlap;
            if (max(off.x, off.y) <= 0.5f && next.residual <= newton.enough && in_range(ray, t, hit)) {
                bool back = newton.rims && dot(ray.direction, outward(patch, face, cross(s.du, s.dv))) > 0.0f;
                offer(ray, patch.face, face, leaf, instance, t, uv, face_uv(patch, kKindBezier, uv), back, hit);
            }
            return;
        }
        if (step == kNewtonSteps)
            return;
        ++newton_steps;
        settled = next.residual <= newton.enough;
        vec2 to = vec2(kept_near_leaf(next.uv.x, box.uv_lo.x, box.uv_hi.x),
                       kept_near_leaf(next.uv.y, box.uv_lo.y, box.uv_hi.y));
        if (!settled && newton_stuck(next, uv, to))
            return;
        uv = to;
    }
}
