#include "format/curve_distance.h"

#include <cmath>
#include <limits>

namespace trimray {
namespace {

/// Points of the grid as (x, y) in units of `reach`: a point is i * step_x, j * step_y.
struct Picture {
    uint width, height;
    double step_x, step_y;
    std::vector<float> distance2; // to the nearest chord so far; infinite beyond 1
};

/// First and last + 1 of the points at i * step, 0 <= i < count, from lo to hi.
std::pair<uint, uint> points_between(double lo, double hi, double step, uint count)
{
    const double first = std::clamp<double>(std::ceil(lo / step), 0, count);
    const double last = std::clamp<double>(std::floor(hi / step) + 1, first, count);
    return {static_cast<uint>(first), static_cast<uint>(last)};
}

/// Lowers distances to that from the chord a b, for all points not farther than 1 (and some others). Source: the
/// nearest point of a segment is a + t (b - a), t = (p - a).(b - a) / |b - a|^2 cut to [0, 1].
void draw_chord(double ax, double ay, double bx, double by, Picture& picture)
{
    const double ex = bx - ax, ey = by - ay;
    const double length2 = ex * ex + ey * ey, length = std::sqrt(length2);
    const float inverse = static_cast<float>(length2 > 0 ? 1 / length2 : 0);
    const float fx = static_cast<float>(ex), fy = static_cast<float>(ey), step = static_cast<float>(picture.step_x);
    const auto [first_row, last_row] =
        points_between(std::min(ay, by) - 1, std::max(ay, by) + 1, picture.step_y, picture.height);
    for (uint j = first_row; j < last_row; ++j) {
        const double y = j * picture.step_y - ay;
        double lo = std::min(ax, bx) - 1, hi = std::max(ax, bx) + 1;
        // |(x - ax) ey - y ex| <= length: not farther than 1 from the chord's line
        if (std::abs(ey) > 1e-3 * length) {
            const double middle = ax + y * ex / ey, half = length / std::abs(ey);
            lo = std::max(lo, middle - half);
            hi = std::min(hi, middle + half);
        }
        const auto [first, last] = points_between(lo, hi, picture.step_x, picture.width);
        const float x0 = static_cast<float>(first * picture.step_x - ax), dy = static_cast<float>(y);
        float* row = picture.distance2.data() + static_cast<size_t>(j) * picture.width + first;
        const int count = static_cast<int>(last - first);
        for (int i = 0; i < count; ++i) {
            const float dx = x0 + static_cast<float>(i) * step;
            const float t = std::min(std::max((dx * fx + dy * fy) * inverse, 0.0f), 1.0f);
            const float rx = dx - t * fx, ry = dy - t * fy;
            row[i] = std::min(row[i], rx * rx + ry * ry);
        }
    }
}

/// Chords of equal steps in t. Their number: a cubic leaves its chord over a step h in t by max |B''| h^2 / 8 at most,
/// |B''| <= 6 |second difference of its points|. No chord is longer than kLongest, for the sake of its rounding.
void draw_piece(const MonotonePiece& piece, const double x[4], const double y[4], Picture& picture)
{
    constexpr double kLongest = 8;
    const double span = std::abs(x[3] - x[0]) + std::abs(y[3] - y[0]);
    double chords = std::ceil(span / kLongest);
    if (piece.cubic) {
        double bend = 0;
        for (int i = 0; i < 2; ++i)
            bend = std::max(bend, std::hypot(x[i] - 2 * x[i + 1] + x[i + 2], y[i] - 2 * y[i + 1] + y[i + 2]));
        chords = std::max(3 * chords, std::ceil(std::sqrt(0.75 * bend / kChordDeviation)));
    }
    const int count = std::max(1, static_cast<int>(chords));
    double ax = x[0], ay = y[0];
    for (int i = 1; i <= count; ++i) {
        const double t = static_cast<double>(i) / count;
        const double bx = i == count ? x[3] : piece.cubic ? bezier3(x, t) : std::lerp(x[0], x[3], t);
        const double by = i == count ? y[3] : piece.cubic ? bezier3(y, t) : std::lerp(y[0], y[3], t);
        draw_chord(ax, ay, bx, by, picture);
        ax = bx, ay = by;
    }
}

} // namespace

std::vector<float> curve_distances(std::span<const MonotonePiece> pieces, const SampleGrid& grid, double step_u,
                                   double step_v, double reach)
{
    const size_t size = static_cast<size_t>(grid.width) * grid.height;
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    Picture picture{grid.width, grid.height, step_u / reach, step_v / reach, std::vector<float>(size, kInfinity)};
    for (const MonotonePiece& piece : pieces) {
        double x[4], y[4];
        for (int i = 0; i < 4; ++i) {
            x[i] = (piece.u[i] - grid.u0) / grid.du * picture.step_x;
            y[i] = (piece.v[i] - grid.v0) / grid.dv * picture.step_y;
        }
        draw_piece(piece, x, y, picture);
    }
    const TrimMask mask = scan_convert(pieces, grid);
    std::vector<float>& out = picture.distance2;
    for (size_t i = 0; i < size; ++i) {
        const float distance = out[i] <= 1 ? static_cast<float>(std::sqrt(out[i]) * reach) : kInfinity;
        out[i] = mask.inside[i] != 0 ? distance : -distance;
    }
    return std::move(out);
}

} // namespace trimray
