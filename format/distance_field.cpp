#include "format/distance_field.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>

namespace trimray {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// First of `count` points at first + i * step that is at x or beyond.
int first_point_from(double x, double first, double step, uint count)
{
    return static_cast<int>(std::clamp<double>(std::ceil((x - first) / step), 0, count));
}

/// row[x] ^= row[x - 1] from left to right, for pixels of 0 and 1: eight at a time, as the bytes of one word.
void sum_row(uint8_t* row, uint width)
{
    constexpr uint kWord = sizeof(uint64_t);
    uint8_t last = 0;
    uint x = 0;
    for (; std::endian::native == std::endian::little && x + kWord <= width; x += kWord) {
        uint64_t pixels;
        std::memcpy(&pixels, row + x, kWord);
        pixels ^= pixels << 8;
        pixels ^= pixels << 16;
        pixels ^= pixels << 32;
        pixels ^= last * uint64_t{0x0101010101010101};
        std::memcpy(row + x, &pixels, kWord);
        last = row[x + kWord - 1];
    }
    for (; x < width; ++x)
        last = row[x] ^= last;
}

/// Fills `changes` with each x, in order, where pixel x of the row differs from x - 1; around the row is outside.
void find_changes(const uint8_t* row, uint width, std::vector<int>& changes)
{
    constexpr uint kWord = sizeof(uint64_t);
    changes.clear();
    uint8_t last = 0;
    for (uint x = 0; x < width;) {
        uint64_t pixels;
        if (x + kWord <= width && (std::memcpy(&pixels, row + x, kWord), pixels == last * uint64_t{0x0101010101010101}))
            x += kWord;
        else
            for (const uint end = std::min(x + kWord, width); x < end; last = row[x++])
                if (row[x] != last)
                    changes.push_back(static_cast<int>(x));
    }
    if (last != 0)
        changes.push_back(static_cast<int>(width));
}

} // namespace

SampleGrid pixel_centres(uint width, uint height)
{
    return {width, height, 0.5 / width, 0.5 / height, 1.0 / width, 1.0 / height};
}

TrimMask scan_convert(std::span<const MonotonePiece> pieces, const SampleGrid& grid)
{
    const uint width = grid.width, height = grid.height;
    TrimMask mask{width, height, std::vector<uint8_t>(static_cast<size_t>(width) * height, 0)};
    // each crossing flips all pixels right of it: mark the first, then sum along the row
    for (const MonotonePiece& piece : pieces) {
        const int last = first_point_from(piece.v_hi(), grid.v0, grid.dv, height);
        for (int y = first_point_from(piece.v_lo(), grid.v0, grid.dv, height); y < last; ++y) {
            const int x = first_point_from(u_at_v(piece, grid.v0 + y * grid.dv), grid.u0, grid.du, width);
            if (x < static_cast<int>(width))
                mask.inside[static_cast<size_t>(y) * width + x] ^= 1;
        }
    }
    for (uint y = 0; y < height; ++y)
        sum_row(mask.inside.data() + static_cast<size_t>(y) * width, width);
    return mask;
}

std::vector<float> signed_distances(const TrimMask& mask, uint oversampling, double pixel_u, double pixel_v,
                                    double farthest)
{
    assert(oversampling % 2 == 1 && mask.width % oversampling == 0 && mask.height % oversampling == 0);
    const uint columns = mask.width / oversampling, rows = mask.height / oversampling;
    const uint middle = oversampling / 2;
    const size_t line = mask.height + 2; // a row of outside below and above
    // squared distance along the row to the nearest pixel of the other kind, negative outside, by column; [0]: row -1
    std::vector<double> along(columns * line, -kInfinity);
    std::vector<int> changes;
    for (uint y = 0; y < mask.height; ++y) {
        const uint8_t* row = mask.inside.data() + static_cast<size_t>(y) * mask.width;
        find_changes(row, mask.width, changes);
        size_t next = 0;
        for (uint c = 0; c < columns; ++c) {
            const int x = static_cast<int>(c * oversampling + middle);
            while (next < changes.size() && changes[next] <= x)
                ++next;
            double steps = kInfinity;
            if (next > 0)
                steps = x - (changes[next - 1] - 1);
            if (next < changes.size())
                steps = std::min<double>(steps, changes[next] - x);
            along[c * line + y + 1] = (row[x] != 0 ? 1 : -1) * (steps * pixel_u * steps * pixel_u);
        }
    }

    std::vector<float> out(static_cast<size_t>(columns) * rows);
    const double farthest2 = farthest * farthest, pixel_v2 = pixel_v * pixel_v;
    for (uint c = 0; c < columns; ++c)
        for (uint r = 0; r < rows; ++r) {
            const double* column = along.data() + c * line;
            const size_t y = r * oversampling + middle + 1;
            const double side = column[y] > 0 ? 1 : -1;
            double nearest = std::abs(column[y]);
            // D^2 = min over rows of along^2 + (dy pixel_v)^2, from the own row outwards until rows are too far
            for (size_t dy = 1; dy < line; ++dy) {
                const double across = static_cast<double>(dy * dy) * pixel_v2;
                if (across >= nearest || across > farthest2)
                    break;
                // a row whose pixel is of the other kind has it at no distance along
                if (dy <= y)
                    nearest = std::min(nearest, std::max(0.0, side * column[y - dy]) + across);
                if (y + dy < line)
                    nearest = std::min(nearest, std::max(0.0, side * column[y + dy]) + across);
            }
            out[static_cast<size_t>(r) * columns + c] = static_cast<float>(side * std::sqrt(nearest));
        }
    return out;
}

double unresolved_distance(const TrimMask& mask, std::span<const MonotonePiece> pieces, double pixel_u, double pixel_v)
{
    const int width = static_cast<int>(mask.width), height = static_cast<int>(mask.height);
    const auto inside = [&](int x, int y) {
        return x >= 0 && y >= 0 && x < width && y < height && mask.inside[static_cast<size_t>(y) * mask.width + x] != 0;
    };
    const auto sum_of_four = [&](int x, int y) {
        if (x < 0 || y < 0 || x + 1 >= width || y + 1 >= height)
            return inside(x, y) + inside(x + 1, y) + inside(x, y + 1) + inside(x + 1, y + 1);
        const uint8_t* row = &mask.inside[static_cast<size_t>(y) * mask.width + x];
        return row[0] + row[1] + row[width] + row[width + 1];
    };
    constexpr double kStep = 0.5; // pixels between samples of a loop
    constexpr int kReach = 64;    // pixels: farther than any band is wide
    // distance from (x, y), in pixels, to the nearest centre of a kind: square rings around, until no ring is nearer
    const auto nearest_centre = [&](double x, double y, bool kind) {
        const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
        double nearest = kInfinity;
        for (int ring = 1; ring <= kReach && (ring - 1) * std::min(pixel_u, pixel_v) < nearest; ++ring)
            for (int dy = 1 - ring; dy <= ring; ++dy)
                for (int dx = 1 - ring; dx <= ring; dx += dy == 1 - ring || dy == ring ? 1 : 2 * ring - 1)
                    if (inside(x0 + dx, y0 + dy) == kind)
                        nearest = std::min(nearest, std::hypot((x0 + dx - x) * pixel_u, (y0 + dy - y) * pixel_v));
        return nearest;
    };
    const double diagonal = std::hypot(pixel_u, pixel_v);
    double worst = 0;
    for (const MonotonePiece& piece : pieces) {
        const double length =
            std::max(std::abs(piece.u[3] - piece.u[0]) * width, std::abs(piece.v[3] - piece.v[0]) * height);
        // a cubic's speed is at most 3 times its chord's when its points are ordered
        const int steps = 1 + static_cast<int>(length * (piece.cubic ? 3 : 1) / kStep);
        for (int i = 0; i <= steps; ++i) {
            const double t = static_cast<double>(i) / steps;
            const double x =
                (piece.cubic ? bezier3(piece.u, t) : piece.u[0] + t * (piece.u[3] - piece.u[0])) * width - 0.5;
            const double y =
                (piece.cubic ? bezier3(piece.v, t) : piece.v[0] + t * (piece.v[3] - piece.v[0])) * height - 0.5;
            // rounded down, as x and y are above -1; std::floor is a call
            const int x0 = static_cast<int>(x + 1) - 1, y0 = static_cast<int>(y + 1) - 1;
            const int sum = sum_of_four(x0, y0);
            // both kinds within the four centres around: no farther than the diagonal
            worst = std::max(worst, sum % 4 != 0 ? diagonal : nearest_centre(x, y, sum == 0));
            if (worst == kInfinity)
                return worst;
        }
    }
    // a distance changes by no more than the way to the next sample
    return worst + 0.5 * kStep * diagonal;
}

uint sdf_oversampling(uint width, uint height)
{
    // small textures get the finest masks; large ones resolve details by themselves
    const uint texels = width * height;
    return texels <= 32u * 32u ? 15 : texels <= 128u * 128u ? 9 : texels <= 1024u * 1024u ? 5 : 3;
}

} // namespace trimray
