// Section planes: what they leave of the eye's rays, and of free ones.

CutSpan cut_span(vec2 pixel)
{
    CutSpan span = CutSpan(-view.tau_ref, kHuge, kNoPlane);
    for (uint i = 0u; i < section.count; ++i) {
        SectionPlaneView plane = section.planes[i];
        span = cut_by(span, plane.at + pixel.x * plane.at_x + pixel.y * plane.at_y,
                      plane.rise + pixel.x * plane.rise_x + pixel.y * plane.rise_y, i);
    }
    return span;
}

float cut_free_ray(vec3 origin, vec3 direction, float reach)
{
    for (uint i = 0u; i < section.count; ++i) {
        vec3 normal = vector(section.planes[i].normal);
        reach = cut_reach(dot(normal, origin) - section.planes[i].offset, dot(normal, direction), reach);
    }
    return reach;
}
