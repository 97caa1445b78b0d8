// How fast a leaf's derivatives change: what proves that a ray meets it at most once, and that Newton finds the hit.
#pragma once

#include "format/bezier_net.h"

#include <array>
#include <limits>

namespace trimray {

/// Bounds of how the derivative DS = [S_u S_v] changes near a leaf. With c the leaf's middle, h its half sides, both in
/// uv_patch, DS_c = Q R (QR decomposition) and n the unit normal there: for all a, b in the leaf's reach (as far as
/// Newton's iterates may go: shaders/shared/newton_reach.h) and any l > 0 with |a_i - b_i| <= l h_i
///     |Q^T (DS_a - DS_b) R^-1| <= l along        |n^T (DS_a - DS_b) R^-1| <= l across        (spectral norms)
///
/// What that means for a ray: with b its angle to the plane of DS_c it sees the surface through F = P S, P the
/// projection along the ray onto that plane, P x = Q^T x + (something of length 1 / tan b) n^T x. Since P DS_c = R,
///     |P (DS_a - DS_b) R^-1| <= l k        k = along + across / tan b
/// so with y = R (u - c) the map y - F(y) has the Lipschitz constant k in the leaf (l = 1 from its middle) and 2k in
/// the reach (l = 2). Both are convex, so where k < 1 the ray meets the leaf at most once, where 2k < 1 the reach. And
/// Newton's step d from c is the root of F's linear part: a root u in the leaf, at the share s <= 1 of l = 1, has
///     |R (u - c - d)| <= integral over t in [0, 1] of |(F'(c + t (u - c)) - F'(c)) R^-1| |R (u - c)| <= k/2 |R (u -
///     c)|
/// Source: the contraction mapping theorem, Ortega & Rheinboldt 5.1 and 12.1; existence: Krawczyk 1969.
struct LeafBend {
    double along = std::numeric_limits<double>::infinity();
    double across = std::numeric_limits<double>::infinity();

    /// A ray steeper than this, tan b, meets the reach at most once: 2 k < 1. Infinity: none is.
    double least_slope() const
    {
        return along < 0.5 ? across / (0.5 - along) : std::numeric_limits<double>::infinity();
    }
};

/// Of the leaf [lo, hi] in uv_patch of a patch with this net, in patch units. Infinite where DS_c has no plane or
/// single precision loses it, or
/// where a weight of the reach's net is not positive. By convex hulls of the second derivatives over the reach.
LeafBend leaf_bend(const Net& patch, const std::array<double, 2>& lo, const std::array<double, 2>& hi);

/// The same as its two summands: what half a side along u adds, and one along v. Splitting about halves the one.
/// `rounding`: derivative_rounding(patch).
std::array<LeafBend, 2> leaf_bend_by_side(const Net& patch, const std::array<double, 2>& rounding,
                                          const std::array<double, 2>& lo, const std::array<double, 2>& hi);
LeafBend sum(const std::array<LeafBend, 2>& by_side);

inline constexpr double kMostRounding = 1e6; // stands for all that is more

/// Bounds of what single precision loses of S_u and of S_v anywhere on the patch: length in the plane and across it,
/// patch units. S_u is the degree times the difference of two points of the net of one degree less, each off by at most
/// patch_rounding / sqrt 2 in one direction (that is for two). Divided by the weight there: r times as much with r the
/// largest ratio of two neighbouring weights, for the surface's weight lies between those of the two points; and again
/// for w_u S, |S| <= 1. Never more than kMostRounding.
std::array<double, 2> derivative_rounding(const Net& patch);

} // namespace trimray
