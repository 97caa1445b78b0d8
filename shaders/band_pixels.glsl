// Which pixel of the band an invocation works on.

// False: none. `at` is its place in the band
bool is_active(out uvec2 at)
{
    at = gl_GlobalInvocationID.xy;
    if (view.alone == 0u)
        return at.x < view.width && at.y < view.row_count;
    uint retry = retries[gl_WorkGroupID.x];
    at = uvec2(retry % view.width, retry / view.width);
    return gl_LocalInvocationIndex == 0u;
}

uint band_index(uvec2 at)
{
    return at.y * view.width + at.x;
}

// From the picture's middle
vec2 pixel_at(uvec2 at)
{
    return vec2(float(at.x) + 0.5f - view.middle[0], float(at.y + view.first_row) + 0.5f - view.middle[1]);
}
