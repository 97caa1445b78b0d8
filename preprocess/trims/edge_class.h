// What runs along each edge of a part (pack_layout.h kEdgeSharp ...): by how many faces use it, and by the angle at
// which two faces meet along it, measured on their surfaces.
#pragma once

#include "preprocess/import/cad_model.h"

namespace trimray {

/// Faces that meet at less than this angle everywhere along an edge share their tangent planes there. Files mean
/// tangency to about 0.1 degrees (their blends are approximations); a crease of 1 degree is hardly seen.
inline constexpr double kSmoothAngle_deg = 1;

/// Sets CadEdgeUse::edge_class of every use in the part:
///   a pole is a seam; so is an edge that one face uses twice where its surface closes, unless it is creased there;
///   an edge of two faces, or of one face on both sides, is smooth where they share their tangent planes, else sharp;
///   an edge of one face is free; one of three or more is sharp.
/// Edges of one face each that lie on one another in space count as one: files of loose faces (IGES) share none. They
/// do where their ends and three points between are as near as their tolerances, or kUnstatedGap (border_gap.h) of
/// `size_mm`, the part's diagonal.
/// Only faces of this part count, and only those that were converted: an edge whose other face was dropped is free.
/// Where normals cannot be measured anywhere along an edge, CadEdge::smooth decides.
void classify_edges(CadPart& part, double size_mm);

} // namespace trimray
