// The bounds of a leaf's bend (format/leaf_bend.h) once the leaf's frame is known: convex hulls of second derivatives.
#pragma once

#include "format/bezier_net.h"
#include "format/leaf_bend.h"
#include "format/leaf_geometry.h"

namespace trimray {

/// The derivative at a leaf's middle and the leaf's place in its reach.
struct BendFrame {
    Point3 middle;  // S_c, patch units
    Point3 axis[3]; // q_1, q_2, n
    double r11 = 0, r12 = 0, r22 = 0;
    double half[2] = {};               // the leaf's half sides, uv_patch
    double begin[2] = {}, end[2] = {}; // the reach less the middle
    double per_side[2] = {};           // 1 / (the reach's side)
};

/// Bounds of |D^2 y[d, .]| and |D^2 z[d, .]| added up over the leaf's two half sides d, where (y, z) is the surface in
/// the frame as a function of y = R (u - c): D is the derivative by that, D y_c = 1 and D z_c = 0.
/// With y = p / w, z = q / w
///     D^2 y[d, .] = (D^2 p[d, .] - w_d D y - y_d D w - y D^2 w[d, .]) / w
/// and D y = 1 + (at most slope), y = (its linear part) + (at most off): what comes from 1 and the linear part is one
/// polynomial, bounded by its hull, what comes from the rest is of third order. The same for z with 0 in their place.
/// `reach`: the net of the leaf's reach. Infinite where a weight of its net, of a degree more, is not positive.
std::array<LeafBend, 2> bend_over(const Net& reach, const BendFrame& frame);

} // namespace trimray
