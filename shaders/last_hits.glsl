// Moving cameras: what a pixel's ray may meet, guessed from the last picture's hits. A guess chooses the leaf that is
// searched first (walk.glsl); it decides nothing, so any is allowed.

// Where the last picture's hit in this very pixel is seen now tells how far things moved; what is seen here now was as
// far behind. `at` is of the whole picture.
Guess guess_hit(uvec2 at, vec2 pixel)
{
    LastHit here = last_hits[at.y * view.width + at.x];
    if (here.leaf == kNoLeaf)
        return Guess(kNoLeaf, 0u);
    vec3 off = (vector(here.point) - vector(view.top_origin)) / view.per_world_scale;
    vec3 step_x = vector(view.step_x);
    vec3 step_y = vector(view.step_y);
    float tau = max(view.top_tau + dot(off, vector(view.w0)), 0.0f); // w0, step_x, step_y are at right angles
    vec2 now = vec2(dot(off, step_x) / dot(step_x, step_x), dot(off, step_y) / dot(step_y, step_y)) / spread(tau);
    vec2 size = vec2(float(view.width), float(view.height));
    vec2 from = clamp(2.0f * pixel - now + vec2(view.middle[0], view.middle[1]), vec2(0.0f), size);
    // a conversion may give anything where tau was 0
    uvec2 there = min(uvec2(from), uvec2(view.width - 1u, view.height - 1u));
    LastHit hit = last_hits[there.y * view.width + there.x];
    return Guess(hit.leaf, hit.instance);
}

void keep_hit(uint picture_pixel, Hit hit, vec3 across)
{
    float tau = view.tau_ref + hit.past;
    vec3 point =
        vector(view.top_origin) + ((tau - view.top_tau) * vector(view.w0) + spread(tau) * across) * view.per_world_scale;
    next_hits[picture_pixel] =
        LastHit(float[3](point.x, point.y, point.z), hit.past < kHuge ? hit.leaf : kNoLeaf, hit.instance);
}
