// The records of a pack, declared once for C++ and GLSL (scalar block layout, 4-byte fields, padding named).
// What each field means is part of the file format: format/SPEC.md repeats it in words and tables.
//
// Spaces, from the outside in (every point exists in one of these, and names say which):
//   world     millimetres, after the instance's transform
//   part      millimetres in the part's own axes; part units: p_mm = part.origin_mm + part.scale_mm * p, |p| about 1
//   patch     p = origin + scale * (axis_x * q.x + axis_y * q.y + axis_z * q.z), |q| about 1; all the tracers compute
//   in it uv_file   the surface's own parameters (mm, radians, knots), as in the CAD file uv_face   [0,1]^2: the
//   bounding rectangle of the face's trim loops ("domain") uv_patch  [0,1]^2 of a Bezier patch; for native kinds the
//   local parameters (lengths in patch units, angles in radians)
#ifndef TRIMRAY_PACK_LAYOUT_H
#define TRIMRAY_PACK_LAYOUT_H

#ifdef __cplusplus
#include <cstddef>
#include <cstdint>
namespace trimray {
using uint = std::uint32_t;
#define TRIMRAY_CONST inline constexpr
#else
#define TRIMRAY_CONST const
#define patch patch_index // `patch` is a keyword of GLSL: there LeafRecord.patch is a field of this name
#endif

// ---- surface kinds -------------------------------------------------------------------------------------------------
// Native parametrisations, in patch space (radius and the like are in patch units, param[] below):
//   plane     S(u,v) = (u, v, 0)
//   cylinder  S(u,v) = (r cos u, r sin u, v)                                        r = param[0]
//   cone      S(u,v) = ((r + v sin a) cos u, (r + v sin a) sin u, v cos a)          r = param[0], tan a = param[1]
//   sphere    S(u,v) = (r cos v cos u, r cos v sin u, r sin v)                      r = param[0]
//   torus     S(u,v) = ((R + r cos v) cos u, (R + r cos v) sin u, r sin v)          R = param[0], r = param[1]
// axis_y is stored, not derived: in a left-handed axis system axis_y = axis_x x axis_z.
// The axes are turned so that u = 0 is the middle of the face's domain, so an angle u in (-pi, pi] maps to uv_face
// without unwrapping. The cone's r is that of the domain's middle, >= 0, and its a may be negative; where r + v sin a
// < 0 (beyond the apex; likewise R + r cos v < 0 on a torus with R < r) the angle of (x, y) is u + pi. The torus' v in
// (-pi, pi] is unwrapped by one rule: if (uv_face.v < 0.5 - pi * uv_scale.v) uv_face.v += 2 pi * uv_scale.v.
TRIMRAY_CONST uint kKindPlane = 0u;
TRIMRAY_CONST uint kKindCylinder = 1u;
TRIMRAY_CONST uint kKindCone = 2u;
TRIMRAY_CONST uint kKindSphere = 3u;
TRIMRAY_CONST uint kKindTorus = 4u;
TRIMRAY_CONST uint kKindBezier = 5u; // polynomial or rational: PatchRecord.shape says which
TRIMRAY_CONST uint kSurfaceKindCount = 6u;

// PatchRecord.shape = kind | degree_u << 8 | degree_v << 16 | rational << 24
TRIMRAY_CONST uint kShapeRational = 1u << 24;
TRIMRAY_CONST uint kMaxDegree = 25u; // the kernel's own limit

// FaceRecord.flags
TRIMRAY_CONST uint kFaceReversed = 1u;      // outward normal is -(S_u x S_v)
TRIMRAY_CONST uint kFaceNaturalBorder = 2u; // the domain rectangle is the trim: no cells, no texture
TRIMRAY_CONST uint kFaceHasColor = 4u;      // else the instance's colour
TRIMRAY_CONST uint kFaceApproximated = 8u;  // surface converted with a deviation, see deviation_mm
TRIMRAY_CONST uint kFaceOpenLoop = 16u;     // a loop did not close within tolerance and was closed by a segment
TRIMRAY_CONST uint kFaceTexelCentres = 32u; // texels at (i + 0.5) / width, see kSdfInset
// and where tiles of a distance texture are kept, the logarithm of a tile's side in steps between texels; 0: rows
TRIMRAY_CONST uint kFaceTileShiftBit = 8u;
TRIMRAY_CONST uint kFaceTileShiftMask = 7u;
// and of a face of a closed shell how far its border may lie beyond its edges: within 2^-k_u of it along u and 2^-k_v
// along v, 1 <= k <= 31, its back is no surface for rays from outside of the shell (shaders/shared/rim.h). Two fields
// of 5 bits, k_u first; both 0: no rim
TRIMRAY_CONST uint kFaceRimBit = 11u;
TRIMRAY_CONST uint kFaceRimBits = 5u;
TRIMRAY_CONST uint kFaceRimMask = 31u;
TRIMRAY_CONST uint kFaceRims = (kFaceRimMask | kFaceRimMask << kFaceRimBits) << kFaceRimBit;

// A patch: one native surface, or one Bezier patch, of one face.
struct PatchRecord {
    float origin_hi[3]; // part units; origin = hi + lo, together 48 bits
    float origin_lo[3];
    float scale; // patch units to part units
    uint face;
    uint shape;
    uint first_control_point; // Bezier: first float of the control net in the control-point array, v runs fastest:
                              // polynomial (x, y, z), rational (wx, wy, wz, w), w > 0, patch units. Native: 0
    float uv_offset[2];       // uv_face = uv_offset + uv_scale * uv_patch
    float uv_scale[2];
    float axis_x[3]; // unit, orthogonal; Bezier: the identity
    float axis_y[3];
    float axis_z[3];
    float param[2]; // Bezier: bounds of what single precision loses of S_u and S_v (derivative_rounding,
                    // format/leaf_bend.h), patch units; what a certificate counts on
};

// A leaf: a rectangle of a patch and the oriented box around it. Native faces have one leaf or a few, with uv = [0,1]^2
// standing for the whole domain in uv_face.
struct LeafRecord {
    uint patch;
    uint uv_lo; // u | v << 16, each k / 32768, exact; Bezier: uv_patch, native: uv_face
    uint uv_hi;
    // box: q = center + R(quat) b, |b_i| <= half_i; R's columns are the box's axes
    uint center_xy;       // int16 x | int16 y << 16; center = k / 16384, patch units
    uint center_z_half_x; // int16 | uint16 << 16; half extent = k / 16384
    uint half_yz;         // uint16 | uint16 << 16
    uint quat_xy;         // int16 each, k / 32767; w = sqrt(1 - x^2 - y^2 - z^2) >= 0 (see decode in shaders/shared)
    uint quat_z_bend;     // int16 z | along << 16 | across << 24: codes of how fast its derivatives change
};
// A code of 8 bits, rounded up: 2^(e - 20) (1 + m / 8) with e = code >> 3, m = code & 7. What it bounds is written at
// LeafBend (format/leaf_bend.h); of a native surface both are 0.
TRIMRAY_CONST uint kBendNone = 255u;          // no bound
TRIMRAY_CONST uint kBendOneBits = 107u << 23; // a code's value has the float's bits (code << 20) + this
TRIMRAY_CONST float kLeafQuantum = 1.0f / 16384.0f;
TRIMRAY_CONST float kLeafUvQuantum = 1.0f / 32768.0f;

// A node of a 4-wide tree with boxes quantised against the node's own: child box = origin + exp2(exponent) * q.
struct BvhNode {
    float origin[3];
    uint exponents; // x | y << 8 | z << 16, biased by 127 as in a float; child count << 24
    uint lo[3];     // per axis, 4 children x 8 bits
    uint hi[3];
    uint child[4];    // node index, or kBvhLeaf | leaf index (instance index in the top tree), or kBvhEmpty (lo > hi)
    uint reserved[2]; // zero
};
TRIMRAY_CONST uint kBvhLeaf = 0x80000000u;
TRIMRAY_CONST uint kBvhEmpty = 0xffffffffu;
TRIMRAY_CONST uint kMaxBvhDepth = 48u; // nodes on a path from root to leaf; a reader refuses deeper trees

// ---- trims ---------------------------------------------------------------------------------------------------------
// Loops are chains of control points in uv_face. A piece is monotone in u and in v: a line (2 points) or a polynomial
// cubic Bezier (4 points); consecutive pieces of a loop share their end point, bit for bit. Fill rule: even-odd.
// TrimPiece word = first point (relative to the face's first_point) << 4 | edge class << 2 | kPieceCubic.
TRIMRAY_CONST uint kPieceCubic = 1u;
TRIMRAY_CONST uint kEntryLast = 2u; // in a CellEntry's word: last of its cell
TRIMRAY_CONST uint kPieceClassShift = 2u;
TRIMRAY_CONST uint kPiecePointShift = 4u;
// What runs along a piece, so that a picture's edges can be chosen
TRIMRAY_CONST uint kEdgeSharp = 0u;  // two faces meet at an angle
TRIMRAY_CONST uint kEdgeSmooth = 1u; // two faces meet with one tangent plane
TRIMRAY_CONST uint kEdgeSeam = 2u;   // no edge: a closed surface's seam, a pole, a line that closes a gap
TRIMRAY_CONST uint kEdgeFree = 3u;   // one face ends
TRIMRAY_CONST uint kEdgeClassCount = 4u;

// The largest float below 1. A query is clamped to [0, kUvBelowOne] in u and v: the rules below are half-open, so only
// there do the domain's upper borders belong to the face as the lower ones do.
TRIMRAY_CONST float kUvBelowOne = 0.99999994f;

// A hit belongs to the face as far as this outside of its domain, in uv_face, and is answered as the border's nearest
// point: along a seam nothing else makes both ends meet. A native surface needs 1.5e-7: an angle's error and that of pi
// (4e-7) over 2 pi, and the roundings of uv_scale, product and sum. A spline that closes needs patch_overlap times
// uv_scale (shaders/shared/patch_newton.h): of two bicubic patches with |S_u| = 1 this much where the ray meets them at
// 11 degrees, 8e-7 at a right angle. Borders that need to reach farther lie farther out in the pack.
// A Bezier patch goes on beyond each of its sides by as much, but by no more than kMostPatchSlack in uv_patch.
TRIMRAY_CONST float kDomainSlack = 4e-6f;
TRIMRAY_CONST float kMostPatchSlack = 1e-3f;

// CellEntry: a piece that passes through a mixed cell. Query q = (u, v) in a cell of grid index floor(uv * grid):
//   inside = corner_inside  XOR over the cell's entries of  horizontal(e)  XOR  vertical(e)
//   with piece ends (ua, va), (ub, vb), va <= vb; the path runs from q along +u to the cell's reference line, then
//   along +v to the reference corner; eta is where the piece crosses the reference line beside the cell, or kNoEta:
//   vertical(e)   = eta != kNoEta and v < eta
//   horizontal(e) = va <= v < vb and u < P(v) and (eta == kNoEta or (u grows with v along the piece ? v < eta : v >=
//   eta)) where u < P(v) is true for u < min(ua, ub), false for u >= max(ua, ub), else decided by solving P_v(t) = v.
struct CellEntry {
    uint word;
    float eta;
};
TRIMRAY_CONST float kNoEta = -1.0f;

// Cell word: class (2 bits) | first entry, relative to the face's first_entry, << 2
TRIMRAY_CONST uint kCellOut = 0u;
TRIMRAY_CONST uint kCellIn = 1u;
TRIMRAY_CONST uint kCellMixedCornerOut = 2u;
TRIMRAY_CONST uint kCellMixedCornerIn = 3u;

// Distance texel: one byte b, distance = (b - 128) / 64 texels, inside where it is 0 or more; bytes lie in words from
// the low end. The outer texels lie kSdfInset steps inside the domain (half a step with kFaceTexelCentres): texel i at
// u = (i + inset) / (width - 1 + 2 inset). The unit is the longer of the two steps between texels on the surface. A
// texture is rows of texels, or an entry of 2 bytes for each tile, row after row, and then the tiles that are kept, row
// by row: (side + 1)^2 texels, the last of which are the next tile's first. All texels of a tile that is not kept are
// 0, or all are 255.
TRIMRAY_CONST uint kTileOut = 0u;
TRIMRAY_CONST uint kTileIn = 1u;
TRIMRAY_CONST uint kFirstTile = 2u; // entry - kFirstTile: number of a tile that is kept
TRIMRAY_CONST float kSdfTexelQuantum = 1.0f / 64.0f;
TRIMRAY_CONST float kSdfInset = 0.125f;

struct FaceRecord {
    uint part;
    uint name;       // string index, 0: none
    uint color_rgba; // sRGB, R in the low byte
    uint flags;
    uint first_patch;
    uint patch_count;
    uint grid;       // cells: columns (u) | rows (v) << 16; 0: no cells
    uint first_cell; // row-major, rows along v
    uint first_entry;
    uint entry_count;
    uint first_point;
    uint point_count;
    uint first_piece;
    uint piece_count;
    uint sdf_size; // width | height << 16; 0: no texture
    uint sdf_first_word;
    float sdf_texel_mm;    // length of a texel, the unit of the stored distances
    float sdf_band_texels; // |B| above this decides; see tests/hard, "the band"
    float area_mm2;
    float tolerance_mm; // largest tolerance of its edges in the file
    float deviation_mm; // of an approximated surface from the file's; 0: exact
    float extent_mm[2]; // mean length of the domain along u and v on the surface
    uint surface_kind;  // kKind of the file's surface (kKindBezier for all splines, sweeps and offsets)
    uint loop_count;
    uint border_classes; // natural border: edge class of the sides u = 0, u = 1, v = 0, v = 1, 2 bits each; else 0
#ifdef __cplusplus
    double domain_lo[2]; // uv_file of uv_face (0,0) and (1,1)
    double domain_hi[2];
#else
    uvec2 domain_lo[2]; // the same bytes: no shader reads them, and a device may lack doubles
    uvec2 domain_hi[2];
#endif
};

#ifdef __cplusplus
// ---- host-only records ---------------------------------------------------------------------------------------------
/// A shape of the model, stored once however often it is placed.
struct PartRecord {
    double origin_mm[3];
    double scale_mm;
    uint name;
    uint first_face, face_count;
    uint first_patch, patch_count;
    uint first_leaf, leaf_count;
    uint first_node, node_count; // nodes of its tree; child indices are relative to first_node, leaves to first_leaf
    uint reserved;
};

/// A placement of a part. transform is row-major 3x4, part mm to world mm; a negative determinant is a mirror image.
struct InstanceRecord {
    double transform[12];
    uint part;
    uint name;
    uint color_rgba; // used by faces without their own colour; alpha 0: none, the default grey
    uint tree_node;  // its node in the assembly tree
};

/// A node of the assembly tree, parents before children; the root is node 0 and its own parent.
struct TreeNode {
    uint parent;
    uint name;
    uint color_rgba;
    uint reserved;
};

/// A face that is not in the pack, and why. `reason` is a string index.
struct DroppedFace {
    uint part;
    uint face_in_part; // its number in the file's part, counted from 0 over converted and dropped faces
    uint reason;
    uint name;
};

static_assert(sizeof(PatchRecord) == 100 && offsetof(PatchRecord, uv_offset) == 40);
static_assert(sizeof(LeafRecord) == 32);
static_assert(sizeof(BvhNode) == 64);
static_assert(sizeof(CellEntry) == 8);
static_assert(sizeof(FaceRecord) == 136 && offsetof(FaceRecord, domain_lo) == 104);
static_assert(sizeof(PartRecord) == 72);
static_assert(sizeof(InstanceRecord) == 112);
static_assert(sizeof(TreeNode) == 16);
static_assert(sizeof(DroppedFace) == 16);
} // namespace trimray
#endif

#endif
