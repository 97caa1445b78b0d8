// Monotone sets: trim pieces in chains of which one binary search finds the piece at a given v.
// Source: Sloup & Havran, "Optimizing Ray Tracing of Trimmed NURBS Surfaces on the GPU", CGF 2021.
#pragma once

#include "format/pack_image.h"
#include "format/trim_piece.h"

#include <vector>

namespace trimray {

/// Consecutive pieces of a loop, all lines or all cubics, in the order in which v does not fall; u does not turn
/// either.
struct MonotoneSet {
    uint first_point = 0; // in MonotoneSets::points; pieces share their ends
    uint piece_count = 0;
    bool cubic = false;

    uint points_a_piece() const { return cubic ? 3 : 1; }
};

struct MonotoneSets {
    std::vector<MonotoneSet> sets;
    std::vector<float> points; // u, v pairs, uv_face
};

/// A face's pieces as monotone sets; pieces without extent are left out. Domain: a validated image.
MonotoneSets monotone_sets(const PackImage& image, const FaceRecord& face);

/// Where piece k of the set begins; k = piece_count: where its last ends.
struct Joint {
    double u, v;
};
inline Joint joint(const MonotoneSets& all, const MonotoneSet& set, uint k)
{
    const float* p = all.points.data() + 2 * (static_cast<size_t>(set.first_point) + k * set.points_a_piece());
    return {p[0], p[1]};
}

/// Piece k of the set.
inline MonotonePiece set_piece(const MonotoneSets& all, const MonotoneSet& set, uint k)
{
    return load_piece(all.points.data(), set.first_point,
                      (k * set.points_a_piece()) << kPiecePointShift | (set.cubic ? kPieceCubic : 0));
}

} // namespace trimray
