// Lines against the native surfaces of pack_layout.h in closed form, in extended precision: all roots along the line.
#pragma once

#include "format/pack_layout.h"
#include "format/reference_math.h"

#include <vector>

namespace trimray::reference {

/// Roots in the order of t, patch space. A line that touches the surface within rounding (1e-15 of the surface and of
/// its distance) gives one root, a contact; a line in the surface (a plane's, a ruling) gives none.
/// Domain: a validated record of a native kind; accurate for origins near the patch.
std::vector<Root> native_roots(const PatchRecord& patch, const Ray& ray);

/// Direction of S_u x S_v at (u, v) in uv_patch in right-handed axes, unit. At a cone's apex, where there is none, the
/// axis on the side of the others.
Vec3 native_normal(const PatchRecord& patch, double u, double v);

/// A box around S([u_lo, u_hi] x [v_lo, v_hi]), patch units.
Bounds native_bounds(const PatchRecord& patch, const double uv_lo[2], const double uv_hi[2]);

} // namespace trimray::reference
