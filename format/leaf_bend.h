// How far a leaf is from a plane with a linear map: what proves that a ray meets it once, and that Newton finds the
// hit.
#pragma once

#include "format/bezier_net.h"

#include <array>
#include <limits>

namespace trimray {

/// Bounds over a rectangle of uv_patch of D = (DS - DS_0) R^-1, where DS = [S_u S_v], DS_0 = Q R (QR decomposition) is
/// its value at a point and n the unit normal there.
///
/// A ray at the angle b to the plane of DS_0 sees the surface through F = P S, P the projection along the ray. Then
/// |(P DS_0 R^-1)^-1 P D| <= k := along + across / tan b, since the inverse leaves Q's part as it is and scales n's
/// by 1 / tan b. Where k < 1, F is injective on the rectangle (it is convex, and (P DS_0)^-1 F is the identity but for
/// a contraction): the ray meets it at most once. And if it does, then within the distance k / (1 - k) |d| of u + d, in
/// the norm |R .|, where u is the point of DS_0 and d Newton's step from there. Source: the contraction mapping
/// theorem; Ortega & Rheinboldt, 5.1 and 12.
struct LeafBend {
    double along = std::numeric_limits<double>::infinity();  // |Q^T D|
    double across = std::numeric_limits<double>::infinity(); // |n^T D|

    /// A ray steeper than this meets the rectangle at most once: tan b > across / (1 - along). Infinity: none is.
    double least_slope() const { return along < 1 ? across / (1 - along) : std::numeric_limits<double>::infinity(); }
};

/// Of a patch's net over [lo, hi] in uv_patch, with DS_0 at `at`. Bounds by the convex hulls of derivatives' nets;
/// infinite where DS_0 has no plane. Domain: weights positive over the rectangle.
LeafBend leaf_bend(const Net& patch, const std::array<double, 2>& lo, const std::array<double, 2>& hi,
                   const std::array<double, 2>& at);

} // namespace trimray
