// The quantised boxes of a tree's node: child box = origin + exp2(exponent) * q, 8 bits an axis.
#if defined(TRIMRAY_SHARED_BVH_NODE_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_BVH_NODE_H
#undef TRIMRAY_SHARED_BVH_NODE_H
#else
#define TRIMRAY_SHARED_BVH_NODE_H
#endif

#include "format/pack_layout.h"
#include "shaders/shared/language.h"

SHARED_OPEN

struct ChildBox {
    scalar3 lo; // the tree's units
    scalar3 hi;
};

// 2^(exponent - 127), by the bits of a float
FN scalar3 node_scale(BvhNode node)
{
    return scalar3(bits_to_scalar((node.exponents & 0xffu) << 23),
                   bits_to_scalar(((node.exponents >> 8) & 0xffu) << 23),
                   bits_to_scalar(((node.exponents >> 16) & 0xffu) << 23));
}
FN int node_child_count(BvhNode node)
{
    return int(node.exponents >> 24);
}

FN ChildBox decode_child(BvhNode node, int child)
{
    scalar3 scale = node_scale(node);
    int shift = child * 8;
    ChildBox box;
    box.lo = scalar3(node.origin[0] + scale.x * scalar((node.lo[0] >> shift) & 0xffu),
                     node.origin[1] + scale.y * scalar((node.lo[1] >> shift) & 0xffu),
                     node.origin[2] + scale.z * scalar((node.lo[2] >> shift) & 0xffu));
    box.hi = scalar3(node.origin[0] + scale.x * scalar((node.hi[0] >> shift) & 0xffu),
                     node.origin[1] + scale.y * scalar((node.hi[1] >> shift) & 0xffu),
                     node.origin[2] + scale.z * scalar((node.hi[2] >> shift) & 0xffu));
    return box;
}

// A ray for one node: t = q * per_step + offset, for all its children
struct NodeRay {
    real3 per_step;
    real3 offset;
};
FN NodeRay node_ray(BvhNode node, real3 origin, real3 inverse)
{
    scalar3 scale = node_scale(node);
    NodeRay ray;
    ray.per_step = real3(inverse.x * scale.x, inverse.y * scale.y, inverse.z * scale.z);
    ray.offset = real3((node.origin[0] - origin.x) * inverse.x, (node.origin[1] - origin.y) * inverse.y,
                       (node.origin[2] - origin.z) * inverse.z);
    return ray;
}

struct ChildHit {
    real near;
    real far;
    mask hit; // the line meets the box within [t_min, t_max]
};
FN ChildHit child_hit(BvhNode node, NodeRay ray, int child, real t_min, real t_max)
{
    int shift = child * 8;
    real lo_x = scalar((node.lo[0] >> shift) & 0xffu) * ray.per_step.x + ray.offset.x;
    real hi_x = scalar((node.hi[0] >> shift) & 0xffu) * ray.per_step.x + ray.offset.x;
    real lo_y = scalar((node.lo[1] >> shift) & 0xffu) * ray.per_step.y + ray.offset.y;
    real hi_y = scalar((node.hi[1] >> shift) & 0xffu) * ray.per_step.y + ray.offset.y;
    real lo_z = scalar((node.lo[2] >> shift) & 0xffu) * ray.per_step.z + ray.offset.z;
    real hi_z = scalar((node.hi[2] >> shift) & 0xffu) * ray.per_step.z + ray.offset.z;
    ChildHit hit;
    hit.near = max(max(min(lo_x, hi_x), min(lo_y, hi_y)), max(min(lo_z, hi_z), t_min));
    hit.far = min(min(max(lo_x, hi_x), max(lo_y, hi_y)), min(max(lo_z, hi_z), t_max));
    // 1 + 4 eps: the products above round (Ize 2013, Robust BVH ray traversal)
    hit.hit = hit.near <= hit.far + abs(hit.far) * (8.0f * kRounding);
    return hit;
}

SHARED_CLOSE
#endif
