// All places where a line meets a Bezier patch, in double: subdivision and clipping, in which a part of the patch is
// dropped only when its control net proves that the line misses it.
//
// The line is where two planes meet; a net's distances from both, homogeneous, are two polynomials whose common roots
// are sought (Kajiya 1982). Where the convex hull of such a net's graph misses zero there is no root (Nishita,
// Sederberg & Kakimoto 1990); before that the two are combined with the inverse of a mean Jacobian, so that a simple
// root is closed in on quadratically (Mourrain & Pavone 2009). Every test allows for the rounding of all steps before
// it.
#pragma once

#include "format/pack_layout.h"
#include "format/reference_math.h"

#include <cstdint>
#include <vector>

namespace trimray::reference {

/// A point of a patch and its derivatives with respect to uv_patch, patch units.
struct SurfacePoint {
    Vec3 p{}, du{}, dv{};
};

struct SearchEnd {
    uint64_t boxes = 0;                                         // parts of the patch looked at
    double open_from = std::numeric_limits<double>::infinity(); // the least t at which a root may have been left out,
                                                                // because the search became too long
};

class BezierReference {
public:
    /// The patch over [-overlap, 1 + overlap] of uv_patch; over [0, 1] along both where a weight would not be positive
    /// beyond. Domain: a validated record of kind Bezier; 0 <= overlap_u, overlap_v <= kMostPatchSlack.
    BezierReference(const PatchRecord& patch, const float* control_points, double overlap_u, double overlap_v);

    /// Calls take(root) for each root with t in [t_lo, t_hi]. A root between two parts may come twice. A contact stands
    /// for all the roots nearer to it than rounding can tell apart, and for a whole curve of them, if the line lies in
    /// the surface.
    SearchEnd intersect(const Ray& ray, double t_lo, double t_hi, const TakeRoot& take) const;

    SurfacePoint evaluate(double u, double v) const;

    /// The direction of S_u x S_v, unit; where that vanishes (a pole, a side without length) its limit from the inside.
    /// (0, 0, 0) if there is none.
    Vec3 normal(double u, double v) const;

    /// Of the control points, patch units.
    Bounds bounds() const;

private:
    // w x, w y, w z, w
    using Point = std::array<double, 4>;
    friend class PatchSearch;

    int degree_[2];
    double lo_[2] = {0, 0}, size_[2] = {1, 1}; // uv_patch = lo + size * s, s in [0, 1]^2 the net's own parameters
    std::vector<Point> net_;                   // (degree_u + 1) (degree_v + 1), v runs fastest
    double reach_ = 0;                         // of the control points from the origin, patch units
};

} // namespace trimray::reference
