// From trim pieces to signed distances, as the paper does it: a binary mask by scan conversion, an exact Euclidean
// distance transform, samples at texel centres. The mask has an odd number of pixels a texel in each direction, so that
// each texel's centre is a pixel's centre.
#pragma once

#include "format/trim_piece.h"

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace trimray {

/// Points of a face's domain: (i, j) lies at u = u0 + i du, v = v0 + j dv (uv_face).
struct SampleGrid {
    uint width = 0, height = 0;
    double u0 = 0, v0 = 0, du = 0, dv = 0;
};

/// The centres of width x height pixels that fill the domain: ((i + 0.5) / width, (j + 0.5) / height).
SampleGrid pixel_centres(uint width, uint height);

/// A binary picture of a face's domain. Shapes: inside[y * width + x], row 0 at the least v. Pixel (x, y) is 1 where
/// its point of the grid is inside by the even-odd rule. What lies around it is outside.
struct TrimMask {
    uint width = 0, height = 0;
    std::vector<uint8_t> inside;
};

/// The mask of `pieces` (a face's closed loops, uv_face) by scan conversion: each row's crossings, in double.
TrimMask scan_convert(std::span<const MonotonePiece> pieces, const SampleGrid& grid);

/// Distances from the centres of every `oversampling`-th pixel (odd; the middle one of each texel) to the nearest
/// centre of the other kind, positive inside, +-infinity if there is none. Pixels are pixel_u by pixel_v in any unit of
/// length. A distance beyond `farthest` may come out longer than it is, or infinite: the time a texel takes grows with
/// it. Shapes: mask.width / oversampling columns, mask.height / oversampling rows.
/// Source: Saito & Toriwaki, New algorithms for Euclidean distance transformation, 1994 (rows, then columns).
std::vector<float> signed_distances(const TrimMask& mask, uint oversampling, double pixel_u, double pixel_v,
                                    double farthest = std::numeric_limits<double>::infinity());

/// How far, at most, a point of the loops lies from the nearest pixel centre of either kind: what the mask does not
/// resolve. Infinite where a loop's inside or outside left no pixel within 64.
double unresolved_distance(const TrimMask& mask, std::span<const MonotonePiece> pieces, double pixel_u, double pixel_v);

/// Pixels a texel in each direction that derive_sdf uses for a texture of this size.
uint sdf_oversampling(uint width, uint height);

} // namespace trimray
