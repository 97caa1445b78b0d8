// Where leaves are: oriented boxes and bounds in and out of a LeafRecord, in double, and exact bounds of native
// surfaces. For the code that derives leaves and trees; the tracers decode in shaders/shared.
#pragma once

#include "format/leaf_bend.h"
#include "format/pack_image.h"

#include <array>

namespace trimray {

using Point3 = std::array<double, 3>;

inline double dot3(const Point3& a, const Point3& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Point3 cross3(const Point3& a, const Point3& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// The oriented box of a leaf in patch units: q = center + sum_i b_i axis[i], |b_i| <= half[i].
struct OrientedBox {
    Point3 center{};
    std::array<Point3, 3> axis{};
    Point3 half{};
};

OrientedBox decode_leaf_box(const LeafRecord& leaf);

/// Writes orthonormal axes into the record, permuted and mirrored freely so that the quaternion's w, which is not
/// stored, is at least 0.85 and decodes well. Returns the axes as they decode.
std::array<Point3, 3> encode_leaf_axes(const std::array<Point3, 3>& axes, LeafRecord& leaf);

/// Writes centre and half extents of a box that holds [lo_i, hi_i] along each of the decoded axes, grown by `margin`.
/// Domain: points within 2 patch units of the origin.
void encode_leaf_extent(const std::array<Point3, 3>& axes, const Point3& lo, const Point3& hi, double margin,
                        LeafRecord& leaf);

/// The bounds of a leaf's record, infinite where it has none.
LeafBend decode_leaf_bend(const LeafRecord& leaf);

/// Writes bounds into the record, rounded up.
void encode_leaf_bend(const LeafBend& bend, LeafRecord& leaf);

/// A native surface in patch units over a rectangle of its own parameters.
struct NativePiece {
    uint kind = kKindPlane;
    double param[2] = {0, 0}; // as PatchRecord::param
    double lo[2] = {0, 0}, hi[2] = {0, 0};
};

/// The piece of `patch` over [lo, hi] in uv_face.
NativePiece native_piece(const PatchRecord& patch, const std::array<double, 2>& lo, const std::array<double, 2>& hi);

/// Returns max of S(u, v) . d over the piece, exact but for rounding.
double largest_along(const NativePiece& piece, const Point3& d);

/// Returns max of p . d over the leaf boxes of an instance's part where it is placed, p in world mm; -infinity for a
/// part without leaves.
double largest_along(const PackImage& image, const InstanceRecord& instance, const Point3& d);

} // namespace trimray
