// A leaf's record decoded, and its oriented box against a ray in patch space.
#if defined(TRIMRAY_SHARED_LEAF_BOX_H) == defined(HWY_TARGET_TOGGLE)
#ifdef TRIMRAY_SHARED_LEAF_BOX_H
#undef TRIMRAY_SHARED_LEAF_BOX_H
#else
#define TRIMRAY_SHARED_LEAF_BOX_H
#endif

#include "format/pack_layout.h"
#include "shaders/shared/language.h"

SHARED_OPEN

struct LeafBox {
    scalar3 center; // patch units
    scalar3 half_extent;
    scalar3 axis_x; // unit; the box's axes in patch space
    scalar3 axis_y;
    scalar3 axis_z;
    scalar2 uv_lo;
    scalar2 uv_hi;
    scalar along; // bounds of how fast its derivatives change: LeafBend, format/leaf_bend.h
    scalar across;
};

FN scalar signed_low_half(uint bits)
{
    return scalar(int(bits << 16) >> 16);
}
FN scalar signed_high_half(uint bits)
{
    return scalar(int(bits) >> 16);
}
FN scalar low_half(uint bits)
{
    return scalar(bits & 0xffffu);
}
FN scalar high_half(uint bits)
{
    return scalar(bits >> 16);
}

// The value of a code of LeafRecord.quat_z_bend, 0 to 255; kHuge where there is no bound
FN scalar bend_value(uint code)
{
    if (code == kBendNone)
        return kHuge;
    return bits_to_scalar((code << 20) + kBendOneBits);
}

FN LeafBox decode_leaf(LeafRecord leaf)
{
    LeafBox box;
    box.center = scalar3(signed_low_half(leaf.center_xy), signed_high_half(leaf.center_xy),
                         signed_low_half(leaf.center_z_half_x)) *
                 kLeafQuantum;
    box.half_extent =
        scalar3(high_half(leaf.center_z_half_x), low_half(leaf.half_yz), high_half(leaf.half_yz)) * kLeafQuantum;
    box.uv_lo = scalar2(low_half(leaf.uv_lo) * kLeafUvQuantum, high_half(leaf.uv_lo) * kLeafUvQuantum);
    box.uv_hi = scalar2(low_half(leaf.uv_hi) * kLeafUvQuantum, high_half(leaf.uv_hi) * kLeafUvQuantum);
    box.along = bend_value(leaf.quat_z_bend >> 16 & 0xffu);
    box.across = bend_value(leaf.quat_z_bend >> 24);
    // the quaternion's columns as a rotation: axis_x = q e_x q*, and so on
    scalar x = signed_low_half(leaf.quat_xy) * (1.0f / 32767.0f);
    scalar y = signed_high_half(leaf.quat_xy) * (1.0f / 32767.0f);
    scalar z = signed_low_half(leaf.quat_z_bend) * (1.0f / 32767.0f);
    scalar w = sqrt(max(1.0f - x * x - y * y - z * z, 0.0f));
    box.axis_x = scalar3(1.0f - 2.0f * (y * y + z * z), 2.0f * (x * y + w * z), 2.0f * (x * z - w * y));
    box.axis_y = scalar3(2.0f * (x * y - w * z), 1.0f - 2.0f * (x * x + z * z), 2.0f * (y * z + w * x));
    box.axis_z = scalar3(2.0f * (x * z + w * y), 2.0f * (y * z - w * x), 1.0f - 2.0f * (x * x + y * y));
    return box;
}

// Of the leaf's rectangle, uv_patch
FN scalar2 leaf_middle(LeafBox box)
{
    return scalar2(0.5f * (box.uv_lo.x + box.uv_hi.x), 0.5f * (box.uv_lo.y + box.uv_hi.y));
}
FN scalar2 leaf_half_side(LeafBox box)
{
    return scalar2(0.5f * (box.uv_hi.x - box.uv_lo.x), 0.5f * (box.uv_hi.y - box.uv_lo.y));
}

struct BoxHit {
    real near; // entry and exit along the line, not cut at the ray's start
    real far;
    mask hit;
};

// 1 / x without infinity: a component that small counts as the smallest one
FN real safe_inverse(real x)
{
    real least = select(x < 0.0f, real(-1e-18f), real(1e-18f));
    return 1.0f / select(abs(x) < 1e-18f, least, x);
}

// The slabs of a box around the origin
FN BoxHit slab_hit(real3 origin, real3 inverse, scalar3 half_extent)
{
    PRECISE real3 middle = real3(-origin.x * inverse.x, -origin.y * inverse.y, -origin.z * inverse.z);
    PRECISE real3 half_width =
        real3(half_extent.x * abs(inverse.x), half_extent.y * abs(inverse.y), half_extent.z * abs(inverse.z));
    PRECISE real3 lo = middle - half_width;
    PRECISE real3 hi = middle + half_width;
    BoxHit hit;
    hit.near = max(max(lo.x, lo.y), lo.z);
    hit.far = min(min(hi.x, hi.y), hi.z);
    hit.hit = hit.near <= hit.far;
    return hit;
}

// `margin` (patch units) covers the rounding of the ray: a few kRounding of the origin's distance
FN BoxHit leaf_box_hit(LeafBox box, real3 origin, real3 direction, scalar margin)
{
    PRECISE real3 o = project(box.axis_x, box.axis_y, box.axis_z, origin - real3(box.center));
    PRECISE real3 d = project(box.axis_x, box.axis_y, box.axis_z, direction);
    real3 inverse = real3(safe_inverse(d.x), safe_inverse(d.y), safe_inverse(d.z));
    return slab_hit(o, inverse, box.half_extent + scalar3(margin, margin, margin));
}

SHARED_CLOSE
#endif
