// B-spline surfaces -> Bezier patches by knot insertion, in double, and native surfaces -> patch records.
#pragma once

#include "format/pack_layout.h"
#include "format/result.h"
#include "preprocess/import/cad_model.h"

#include <array>
#include <span>
#include <vector>

namespace trimray {

/// A rational Bezier patch over `domain` in uv_file. control_points[i * (degree_v + 1) + j] = (w x, w y, w z, w), i
/// along u.
struct BezierPatch {
    int degree_u = 1, degree_v = 1;
    bool rational = false;
    Rect2d domain;
    std::vector<std::array<double, 4>> control_points;
};

/// The box of control points (w x, w y, w z, w) in space, which holds the surface. Domain: weights positive.
struct ControlBox {
    Vec3d lo, hi;

    Vec3d centre() const;
    double half_diagonal() const;
};
ControlBox control_box(std::span<const std::array<double, 4>> points);

/// Returns the patches of `surface` over `domain` (cut at its border), row by row. Zero-length spans give no patch. In
/// periodic directions the domain may lie anywhere and is at most one period long; patches come back shifted into it.
/// Source: Piegl & Tiller A5.6 / A5.7 (knot refinement, decomposition), eq. 1.7 for cutting.
std::vector<BezierPatch> decompose(const CadSurface& surface, const Rect2d& domain);

/// Point and first derivatives, in mm, at uv_file; for every kind. The slow, obvious form, for metrics and tests.
/// Beyond a spline's ends: as at its end (held_to_surface).
struct SurfaceDerivatives {
    Vec3d p, du, dv;
};
SurfaceDerivatives evaluate(const CadSurface& surface, double u, double v);

/// Mean lengths in mm of the domain along u and along v, and the area in mm^2 of the domain's image.
struct SurfaceExtent {
    double length_u_mm = 0, length_v_mm = 0, area_mm2 = 0;
};
SurfaceExtent surface_extent(const CadSurface& surface, const Rect2d& domain);

/// The part's unit space: p_part = (p_mm - origin_mm) / scale_mm.
struct PartFrame {
    Vec3d origin_mm;
    double scale_mm = 1;
};

/// What weights far apart asked for.
struct AppendedPatches {
    uint32_t cut = 0;      // Bezier patches that were cut into pieces (patch_cut.h)
    uint32_t too_fast = 0; // of those, where some piece should have been cut further
    double uv_face_mm = 0; // how far rounding of uv_face moves a point of a patch that was cut, at most
};

/// Appends the records of a face's surface over `domain`: one native patch, or its Bezier patches with their control
/// points (pack_layout.h PatchRecord). Fails: InvalidSurface, UnsupportedSurface (weights not positive, degree above
/// kMaxDegree).
Result<AppendedPatches> append_patches(const CadSurface& surface, const Rect2d& domain, const PartFrame& frame,
                                       uint32_t face, std::vector<PatchRecord>& patches,
                                       std::vector<float>& control_points);

} // namespace trimray
