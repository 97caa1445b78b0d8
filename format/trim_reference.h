// The reference for trims: crossings counted in double over a face's pieces, and how far a point is from the border.
// What the trim modes are measured against. Reads neither cells nor textures nor trees, and shares no code with what
// makes or asks them.
#pragma once

#include "format/pack_image.h"
#include "format/trim_piece.h"

#include <array>
#include <vector>

namespace trimray {

/// A linear map from uv_face to the plane in which a distance is wanted: x = uu * u + uv * v, y = vu * u + vv * v.
struct UvMap {
    double uu = 1, uv = 0, vu = 0, vv = 1;
};

class TrimReference {
public:
    /// Domain: a validated image. Keeps no reference to it.
    explicit TrimReference(const PackImage& image);

    /// Whether (u, v) in uv_face is inside the loops of a face by the even-odd rule; half-open, as pack_layout.h states
    /// at kUvBelowOne. A natural border is inside everywhere; a face without pieces nowhere.
    /// Domain: [0, kUvBelowOne]^2. Right for a point within 1e-15 of the one asked for.
    bool inside(uint face, double u, double v) const;

    /// Distance from (u, v) to the nearest point of the face's loops, both seen through `map`; infinity for a face
    /// without pieces. Within 1e-6 of itself, or 1e-11 of a piece's length where that is more.
    double distance(uint face, double u, double v, const UvMap& map) const;

private:
    // The pieces of a face, listed by rows of equal height in v
    struct Face {
        bool natural = false;
        std::vector<MonotonePiece> pieces;
        std::vector<uint> row_begin; // into row_piece; rows + 1 numbers
        std::vector<uint> row_piece;
    };
    static uint row_of(const Face& face, double v);
    std::vector<Face> faces_;
};

} // namespace trimray
