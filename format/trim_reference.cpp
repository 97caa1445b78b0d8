#include "format/trim_reference.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trimray {
namespace {

constexpr uint kMostRows = 4096;

/// The first half of a cubic's coordinates, then the second. Source: de Casteljau at 1/2.
void halve(const double c[4], double first[4], double second[4])
{
    const double ab = 0.5 * (c[0] + c[1]), bc = 0.5 * (c[1] + c[2]), cd = 0.5 * (c[2] + c[3]);
    const double abc = 0.5 * (ab + bc), bcd = 0.5 * (bc + cd), middle = 0.5 * (abc + bcd);
    const double halves[7] = {c[0], ab, abc, middle, bcd, cd, c[3]};
    std::copy(halves, halves + 4, first);
    std::copy(halves + 3, halves + 7, second);
}

/// u < P(v) for a line. The coordinates are floats, so the differences and products lose next to nothing.
bool left_of_line(const MonotonePiece& piece, double u, double v)
{
    const int a = piece.v[0] < piece.v[3] ? 0 : 3, b = 3 - a;
    return (u - piece.u[a]) * (piece.v[b] - piece.v[a]) < (v - piece.v[a]) * (piece.u[b] - piece.u[a]);
}

/// u < P(v) for a monotone cubic: the half of the curve that passes v, again and again, until u lies beside it.
bool left_of_cubic(MonotonePiece piece, double u, double v)
{
    constexpr int kHalvings = 64; // of t: by then the half is a point
    const bool upward = piece.v[0] < piece.v[3];
    for (int i = 0; i < kHalvings; ++i) {
        if (u < piece.u_lo())
            return true;
        if (u >= piece.u_hi())
            return false;
        MonotonePiece first, second;
        halve(piece.u, first.u, second.u);
        halve(piece.v, first.v, second.v);
        piece = (v < second.v[0]) == upward ? first : second;
    }
    return u < piece.u[0];
}

double to_segment(const double a[2], const double b[2])
{
    const double d[2] = {b[0] - a[0], b[1] - a[1]};
    const double length2 = d[0] * d[0] + d[1] * d[1];
    const double t = length2 > 0 ? std::clamp(-(a[0] * d[0] + a[1] * d[1]) / length2, 0.0, 1.0) : 0.0;
    return std::hypot(a[0] + t * d[0], a[1] + t * d[1]);
}

/// The lesser of `best` and the distance from the origin to a cubic with coordinates x, y.
double to_cubic(const double x[4], const double y[4], double best, int depth)
{
    const auto [x_lo, x_hi] = std::minmax_element(x, x + 4);
    const auto [y_lo, y_hi] = std::minmax_element(y, y + 4);
    // the curve lies in the box of its control points
    if (std::hypot(std::max({*x_lo, 0.0, -*x_hi}), std::max({*y_lo, 0.0, -*y_hi})) >= best)
        return best;
    // a cubic stays within 3/4 of its inner points' distance from the chord's thirds
    double bend = 0;
    for (int i = 1; i < 3; ++i)
        bend = std::max(bend, std::hypot(x[i] - x[0] - i * (x[3] - x[0]) / 3, y[i] - y[0] - i * (y[3] - y[0]) / 3));
    const double ends[2][2] = {{x[0], y[0]}, {x[3], y[3]}};
    const double chord = to_segment(ends[0], ends[1]);
    if (depth == 0 || bend <= 1e-6 * std::max(chord - bend, 0.0))
        return std::min(best, chord);
    double x1[4], x2[4], y1[4], y2[4];
    halve(x, x1, x2);
    halve(y, y1, y2);
    best = to_cubic(x1, y1, best, depth - 1);
    return to_cubic(x2, y2, best, depth - 1);
}

} // namespace

uint TrimReference::row_of(const Face& face, double v)
{
    const double rows = static_cast<double>(face.row_begin.size() - 1);
    return static_cast<uint>(std::clamp(v * rows, 0.0, rows - 1)); // grows with v, whatever the rounding
}

TrimReference::TrimReference(const PackImage& image) : faces_(image.faces.size())
{
    for (size_t f = 0; f < faces_.size(); ++f) {
        const FaceRecord& record = image.faces[f];
        Face& face = faces_[f];
        face.natural = (record.flags & kFaceNaturalBorder) != 0;
        for (uint i = 0; i < record.piece_count; ++i)
            face.pieces.push_back(
                load_piece(image.trim_points.data(), record.first_point, image.trim_pieces[record.first_piece + i]));
        const uint rows = std::clamp(record.piece_count / 2, 1u, kMostRows);
        face.row_begin.assign(rows + 1, 0);
        for (const MonotonePiece& piece : face.pieces)
            for (uint row = row_of(face, piece.v_lo()); row <= row_of(face, piece.v_hi()); ++row)
                ++face.row_begin[row + 1];
        for (uint row = 0; row < rows; ++row)
            face.row_begin[row + 1] += face.row_begin[row];
        face.row_piece.resize(face.row_begin[rows]);
        std::vector<uint> next(face.row_begin.begin(), face.row_begin.end() - 1);
        for (uint i = 0; i < record.piece_count; ++i)
            for (uint row = row_of(face, face.pieces[i].v_lo()); row <= row_of(face, face.pieces[i].v_hi()); ++row)
                face.row_piece[next[row]++] = i;
    }
}

bool TrimReference::inside(uint face_id, double u, double v) const
{
    const Face& face = faces_[face_id];
    if (face.natural)
        return true;
    bool inside = false;
    const uint row = row_of(face, v);
    for (uint i = face.row_begin[row]; i < face.row_begin[row + 1]; ++i) {
        const MonotonePiece& piece = face.pieces[face.row_piece[i]];
        if (!(piece.v_lo() <= v && v < piece.v_hi()) || u >= piece.u_hi())
            continue;
        inside ^= u < piece.u_lo() || (piece.cubic ? left_of_cubic(piece, u, v) : left_of_line(piece, u, v));
    }
    return inside;
}

double TrimReference::distance(uint face, double u, double v, const UvMap& map) const
{
    constexpr int kHalvings = 40;
    double best = std::numeric_limits<double>::infinity();
    for (const MonotonePiece& piece : faces_[face].pieces) {
        double x[4], y[4];
        for (int i = 0; i < 4; ++i) {
            const double du = piece.u[i] - u, dv = piece.v[i] - v;
            x[i] = map.uu * du + map.uv * dv;
            y[i] = map.vu * du + map.vv * dv;
        }
        best = to_cubic(x, y, best, kHalvings);
    }
    return best;
}

} // namespace trimray
