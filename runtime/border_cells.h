// Which pieces of a face's borders are near a point: for lines along borders and for anti-aliasing, not for trims. A
// trim cell (derive_cells) lists what its queries may cross; this grid lists all that passes through a cell, and
// nothing where no edge is. Built when a picture first asks for it.
#pragma once

#include "format/pack_image.h"

#include <cstdint>
#include <vector>

namespace trimray {

/// words[2 f] = columns | rows << 16 of face f (0: no pieces; natural borders have none), words[2 f + 1] = index of its
/// first cell. A cell is the index of its first piece; its pieces end where the next cell's begin, and one more index
/// follows the last cell. A piece is its TrimPiece word (pack_layout.h); pieces along seams are left out.
struct BorderCells {
    std::vector<uint32_t> words;
    std::vector<uint8_t> classes; // by face: bits kEdge... of its borders, of natural ones too

    size_t size_bytes() const { return words.size() * sizeof(uint32_t) + classes.size(); }
};

/// Domain: a validated image. Cells are about square on the surface, about two a piece.
BorderCells make_border_cells(const PackImage& image);

} // namespace trimray
