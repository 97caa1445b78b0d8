// Cells of a face's trims: a grid over uv_face whose cells are in, out, or mixed with their few pieces
// (pack_layout.h, CellEntry). The reference line of a column lies a little beyond the cells' right edge at a u that no
// single-precision number has, so no end of a piece and no vertical piece lies on it; rows likewise. Every decision
// about a crossing of that line uses the same rounded eta that the query will see, so parity cannot break.
#include "format/alike_trims.h"
#include "format/derive.h"
#include "format/trim_piece.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace trimray {
namespace {

// A tracer finds its cell in single precision, off by a few ulp (6e-8): entries are collected over the cell's box grown
// by this much on every side, so a query that lands in the neighbour is still answered exactly.
constexpr double kCellMargin = 1e-6;
// Reference lines of the last column and row: between 1 and the largest float below it, where clamped queries end.
constexpr double kJustBelowOne = 1 - 0x1p-25;
// What a grid may cost, so that cells and pieces together stay near the kd-tree's memory (see kd_trim_bytes).
constexpr size_t kBytesPerPiece = 28;
constexpr double kMeanEntriesOfMixedCell = 2;
constexpr double kMeanTestsPerQuery = 1; // in units of a line; a cubic counts kCubicTest
constexpr double kCubicTest = 3;
constexpr uint kMaxGrid = 1024;

/// One direction of a grid: of each column (row), the lowest coordinate a query may bring, and its reference line.
struct GridAxis {
    std::vector<double> lo, reference;
};

GridAxis make_axis(uint count)
{
    GridAxis axis;
    for (uint i = 0; i < count; ++i) {
        axis.lo.push_back(i == 0 ? 0 : static_cast<double>(i) / count - kCellMargin);
        double line = static_cast<double>(i + 1) / count + 2 * kCellMargin;
        if (static_cast<double>(static_cast<float>(line)) == line)
            line += 1e-3 * kCellMargin;
        axis.reference.push_back(i + 1 == count ? kJustBelowOne : line);
    }
    return axis;
}

/// First i in [0, count) with (i + 1) / count + margins > x.
uint first_index(double x, uint count)
{
    const double i = std::floor((x - 4 * kCellMargin) * count) - 1;
    return i <= 0 ? 0 : std::min(static_cast<uint>(i), count - 1);
}

struct PlacedEntry {
    uint cell;
    CellEntry entry;
};

struct FaceCells {
    uint columns = 0, rows = 0;
    std::vector<uint> cells;
    std::vector<CellEntry> entries;
    double mixed_cells = 0;
    double tests = 0; // over all cells, in lines

    size_t size_bytes() const { return cells.size() * sizeof(uint) + entries.size() * sizeof(CellEntry); }
};

/// Appends the piece's entries in all cells, and its crossings of the columns' reference lines.
void place_piece(const MonotonePiece& piece, uint word, const GridAxis& u_axis, const GridAxis& v_axis,
                 std::vector<PlacedEntry>& placed, std::vector<std::vector<float>>& crossings)
{
    const uint columns = static_cast<uint>(u_axis.lo.size()), rows = static_cast<uint>(v_axis.lo.size());
    const double u_lo = piece.u_lo(), u_hi = piece.u_hi(), v_lo = piece.v_lo(), v_hi = piece.v_hi();
    const bool grows = piece.u_grows_with_v();
    const uint first_column = first_index(u_lo, columns);

    std::vector<float> eta(columns - first_column, kNoEta);
    for (uint c = first_column; c < columns && u_axis.reference[c] < u_hi; ++c)
        if (u_axis.reference[c] > u_lo) {
            eta[c - first_column] = static_cast<float>(v_at_u(piece, u_axis.reference[c]));
            crossings[c].push_back(eta[c - first_column]);
        }

    for (uint r = first_index(v_lo, rows); r < rows && v_axis.lo[r] <= v_hi; ++r) {
        const double row_lo = v_axis.lo[r], row_hi = v_axis.reference[r];
        if (v_lo > row_hi)
            continue;
        // the part of the piece within the row, from left to right
        double left = u_lo, right = u_hi;
        if (v_lo < v_hi && (v_lo < row_lo || v_hi > row_hi)) {
            const double a = u_at_v(piece, std::max(v_lo, row_lo)), b = u_at_v(piece, std::min(v_hi, row_hi));
            // rounding of the solution only: far below the margin of the cells
            left = std::max(u_lo, std::min(a, b) - 1e-9);
            right = std::min(u_hi, std::max(a, b) + 1e-9);
        }
        for (uint c = first_index(left, columns); c < columns && u_axis.lo[c] < right; ++c) {
            if (u_axis.reference[c] < left)
                continue;
            CellEntry entry{word, kNoEta};
            const float e = eta[c - first_column];
            if (e != kNoEta) {
                const bool below_row = e <= row_lo, above_row = e > row_hi;
                // throughout the row the piece is right of the line: the path ends before it
                if ((below_row && grows) || (above_row && !grows))
                    continue;
                if (!below_row && !above_row)
                    entry.eta = e;
            } else if (u_lo > u_axis.reference[c]) {
                continue;
            }
            // a horizontal piece is met by the vertical part of the path alone
            if (entry.eta == kNoEta && v_lo == v_hi)
                continue;
            placed.push_back({r * columns + c, entry});
        }
    }
}

FaceCells build_cells(std::span<const MonotonePiece> pieces, std::span<const uint> words, uint columns, uint rows)
{
    const GridAxis u_axis = make_axis(columns), v_axis = make_axis(rows);
    std::vector<PlacedEntry> placed;
    std::vector<std::vector<float>> crossings(columns);
    for (size_t i = 0; i < pieces.size(); ++i)
        place_piece(pieces[i], words[i], u_axis, v_axis, placed, crossings);

    FaceCells out;
    out.columns = columns;
    out.rows = rows;
    out.cells.resize(static_cast<size_t>(columns) * rows);
    std::stable_sort(placed.begin(), placed.end(),
                     [](const PlacedEntry& a, const PlacedEntry& b) { return a.cell < b.cell; });
    for (std::vector<float>& etas : crossings)
        std::sort(etas.begin(), etas.end());

    size_t next = 0;
    for (uint r = 0; r < rows; ++r)
        for (uint c = 0; c < columns; ++c) {
            // beyond the domain is outside: parity of the crossings above the corner
            const auto above = std::upper_bound(crossings[c].begin(), crossings[c].end(), v_axis.reference[r],
                                                [](double x, float e) { return x < e; });
            const bool corner_in = (crossings[c].end() - above) % 2 != 0;
            const uint cell = r * columns + c;
            const uint first = static_cast<uint>(out.entries.size());
            for (; next < placed.size() && placed[next].cell == cell; ++next) {
                out.entries.push_back(placed[next].entry);
                out.tests += (placed[next].entry.word & kPieceCubic) != 0 ? kCubicTest : 1;
            }
            if (out.entries.size() == first) {
                out.cells[cell] = corner_in ? kCellIn : kCellOut;
                continue;
            }
            out.entries.back().word |= kEntryLast;
            out.cells[cell] = (corner_in ? kCellMixedCornerIn : kCellMixedCornerOut) | first << 2;
            out.mixed_cells += 1;
        }
    return out;
}

/// The smallest grid, of cells about square on the surface, whose queries are cheap; or the largest that the face's
/// pieces pay for.
FaceCells choose_cells(std::span<const MonotonePiece> pieces, std::span<const uint> words, double aspect)
{
    const size_t budget_bytes = kBytesPerPiece * pieces.size() + 16;
    FaceCells best;
    uint last_columns = 0, last_rows = 0;
    for (double cells = 1; cells <= static_cast<double>(kMaxGrid) * kMaxGrid; cells *= 1.5) {
        const double ideal = std::sqrt(cells * aspect);
        const uint columns = static_cast<uint>(std::clamp(std::round(ideal), 1.0, std::min<double>(kMaxGrid, cells)));
        const uint rows = static_cast<uint>(std::clamp(std::round(cells / columns), 1.0, 1.0 * kMaxGrid));
        if (columns == last_columns && rows == last_rows)
            continue;
        last_columns = columns;
        last_rows = rows;
        if (!best.cells.empty() && static_cast<size_t>(columns) * rows * sizeof(uint) > budget_bytes)
            break;
        FaceCells tried = build_cells(pieces, words, columns, rows);
        const double entries = static_cast<double>(tried.entries.size());
        const bool cheap = entries <= kMeanEntriesOfMixedCell * tried.mixed_cells &&
                           tried.tests <= kMeanTestsPerQuery * static_cast<double>(tried.cells.size());
        if (best.cells.empty() || tried.size_bytes() <= budget_bytes)
            best = std::move(tried);
        if (cheap)
            break;
    }
    return best;
}

} // namespace

void derive_cells(PackImage& image, const std::function<bool()>& cancelled)
{
    const std::vector<uint> alike = first_alike(image);
    std::vector<FaceCells> built(image.faces.size());
    tbb::parallel_for(size_t{0}, image.faces.size(), [&](size_t f) {
        const FaceRecord& face = image.faces[f];
        if (face.piece_count == 0 || alike[f] != f || (cancelled && cancelled()))
            return;
        const std::span<const uint> words(image.trim_pieces.data() + face.first_piece, face.piece_count);
        std::vector<MonotonePiece> pieces;
        for (const uint word : words)
            pieces.push_back(load_piece(image.trim_points.data(), face.first_point, word));
        const double aspect = face.extent_mm[0] > 0 && face.extent_mm[1] > 0
                                  ? static_cast<double>(face.extent_mm[0]) / face.extent_mm[1]
                                  : 1.0;
        built[f] = choose_cells(pieces, words, aspect);
    });

    image.cells.clear();
    image.cell_entries.clear();
    for (size_t f = 0; f < built.size(); ++f) {
        FaceRecord& face = image.faces[f];
        const FaceCells& own = built[alike[f]];
        face.grid = own.columns | own.rows << 16;
        face.first_cell = static_cast<uint>(image.cells.size());
        face.first_entry = static_cast<uint>(image.cell_entries.size());
        face.entry_count = static_cast<uint>(own.entries.size());
        image.cells.insert(image.cells.end(), own.cells.begin(), own.cells.end());
        image.cell_entries.insert(image.cell_entries.end(), own.entries.begin(), own.entries.end());
    }
}

} // namespace trimray
