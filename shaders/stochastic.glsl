// The paper's own method: plain Newton from one start a leaf and frame, and hits that are kept from frame to frame.

Hit load_kept(uint pixel)
{
    KeptHit kept = kept_hits[pixel];
    vec2 uv_face = vec2(kept.uv_face[0], kept.uv_face[1]);
    vec2 uv_patch = vec2(kept.uv_patch[0], kept.uv_patch[1]);
    return Hit(kept.past, kept.t, uv_face, uv_patch, kept.leaf, kept.instance, kHuge, false, true, 0.0f);
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
                 uint instance, bool rims, inout Hit hit)
{
    Search search;
    search.settled = false;
    search.exact = false;
    search.uv = leaf_start(vec2(view.start[0], view.start[1]), box.uv_lo, box.uv_hi);
    vec2 middle = leaf_middle(box);
    vec2 half_side = leaf_half_side(box);
    for (int step = 0; step <= kNewtonSteps; ++step) {
        search.s = evaluate(newton, search.uv);
        search.seen = seen_point(search.s, newton.planes);
        search.next = newton_step(search.seen, search.uv);
        bool close = search.next.residual <= newton.enough;
        if (search.settled) {
            search.settled = close;
            search.next.uv = search.uv; // no step more
            offer_end(ray, patch, face, newton, box, search, leaf, instance, rims, hit);
            return;
        }
        if (step == kNewtonSteps)
            return;
        ++newton_steps;
        search.settled = close;
        vec2 to = vec2(kept_near(search.next.uv.x, middle.x, half_side.x),
                       kept_near(search.next.uv.y, middle.y, half_side.y));
        if (!close && newton_stuck(search.next, search.uv, to))
            return;
        search.uv = to;
    }
}
