#include "runtime/border_cells.h"

#include "format/trim_piece.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace trimray {
namespace {

// A tracer finds its cells in single precision, off by a few ulp (6e-8), and a piece's place in a row is solved to
// 1e-9: pieces are listed over the cell's box grown by this much.
constexpr double kMargin = 1e-6;
constexpr double kCellsPerPiece = 2;
constexpr double kMostCells = 512; // a side
// A grid that long pieces cross again and again is halved until its lists are no longer than this.
constexpr double kMostWordsPerPiece = 16;

struct FaceGrid {
    uint32_t columns = 0, rows = 0;
    std::vector<uint32_t> first;  // by cell, and one more
    std::vector<uint32_t> pieces; // words
};

uint32_t index_of(double x, uint32_t count)
{
    const double i = std::floor(x * count);
    return i <= 0 ? 0 : std::min(static_cast<uint32_t>(i), count - 1);
}

/// Calls visit(cell) for the cells that the piece passes through.
template <class Visit>
void cells_of(const MonotonePiece& piece, uint32_t columns, uint32_t rows, Visit visit)
{
    const uint32_t first_row = index_of(piece.v_lo() - kMargin, rows),
                   last_row = index_of(piece.v_hi() + kMargin, rows);
    for (uint32_t row = first_row; row <= last_row; ++row) {
        const double lo = static_cast<double>(row) / rows - kMargin, hi = static_cast<double>(row + 1) / rows + kMargin;
        double left = piece.u_lo(), right = piece.u_hi();
        if (piece.v_lo() < lo || piece.v_hi() > hi) { // the part within the row
            const double a = u_at_v(piece, std::clamp(lo, piece.v_lo(), piece.v_hi()));
            const double b = u_at_v(piece, std::clamp(hi, piece.v_lo(), piece.v_hi()));
            left = std::min(a, b);
            right = std::max(a, b);
        }
        const uint32_t last_column = index_of(right + kMargin, columns);
        for (uint32_t column = index_of(left - kMargin, columns); column <= last_column; ++column)
            visit(row * columns + column);
    }
}

FaceGrid grid_of(const PackImage& image, const FaceRecord& face)
{
    std::vector<MonotonePiece> pieces;
    std::vector<uint32_t> words;
    for (uint i = 0; i < face.piece_count; ++i) {
        const uint word = image.trim_pieces[face.first_piece + i];
        if ((word >> kPieceClassShift & 3u) == kEdgeSeam)
            continue;
        pieces.push_back(load_piece(image.trim_points.data(), face.first_point, word));
        words.push_back(word);
    }
    FaceGrid grid;
    if (pieces.empty())
        return grid;
    const bool has_extent = face.extent_mm[0] > 0 && face.extent_mm[1] > 0;
    const double aspect = has_extent ? double(face.extent_mm[0]) / double(face.extent_mm[1]) : 1;
    const double cells = kCellsPerPiece * static_cast<double>(pieces.size());
    grid.columns = static_cast<uint32_t>(std::clamp(std::round(std::sqrt(cells * aspect)), 1.0, kMostCells));
    grid.rows = static_cast<uint32_t>(std::clamp(std::round(cells / grid.columns), 1.0, kMostCells));
    // count, sum, place
    for (;;) {
        grid.first.assign(size_t{grid.columns} * grid.rows + 1, 0);
        size_t listed = 0;
        for (const MonotonePiece& piece : pieces)
            cells_of(piece, grid.columns, grid.rows, [&](uint32_t cell) {
                ++grid.first[cell + 1];
                ++listed;
            });
        if (static_cast<double>(listed) <= kMostWordsPerPiece * static_cast<double>(pieces.size()))
            break;
        grid.columns = std::max(grid.columns / 2, 1u);
        grid.rows = std::max(grid.rows / 2, 1u);
    }
    std::partial_sum(grid.first.begin(), grid.first.end(), grid.first.begin());
    grid.pieces.resize(grid.first.back());
    std::vector<uint32_t> next = grid.first;
    for (size_t i = 0; i < pieces.size(); ++i)
        cells_of(pieces[i], grid.columns, grid.rows, [&](uint32_t cell) { grid.pieces[next[cell]++] = words[i]; });
    return grid;
}

uint8_t classes_of(const PackImage& image, const FaceRecord& face)
{
    uint classes = 0;
    if ((face.flags & kFaceNaturalBorder) != 0)
        for (uint side = 0; side < 4; ++side)
            classes |= 1u << (face.border_classes >> 2 * side & 3u);
    for (uint i = 0; i < face.piece_count; ++i)
        classes |= 1u << (image.trim_pieces[face.first_piece + i] >> kPieceClassShift & 3u);
    return static_cast<uint8_t>(classes);
}

} // namespace

BorderCells make_border_cells(const PackImage& image)
{
    std::vector<FaceGrid> grids(image.faces.size());
    tbb::parallel_for(size_t{0}, grids.size(), [&](size_t f) { grids[f] = grid_of(image, image.faces[f]); });
    BorderCells out;
    for (const FaceRecord& face : image.faces)
        out.classes.push_back(classes_of(image, face));
    out.words.resize(2 * grids.size());
    for (size_t f = 0; f < grids.size(); ++f) {
        const FaceGrid& grid = grids[f];
        const auto at = static_cast<uint32_t>(out.words.size());
        out.words[2 * f] = grid.columns | grid.rows << 16;
        out.words[2 * f + 1] = at;
        const auto pieces_at = at + static_cast<uint32_t>(grid.first.size());
        for (const uint32_t first : grid.first)
            out.words.push_back(pieces_at + first);
        out.words.insert(out.words.end(), grid.pieces.begin(), grid.pieces.end());
    }
    return out;
}

} // namespace trimray
