#include "format/distance_field.h"

#include <cassert>
#include <cmath>
#include <limits>

namespace trimray {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// First pixel whose centre is at x or beyond, in pixels.
int first_centre(double x)
{
    return static_cast<int>(std::ceil(x - 0.5));
}

/// Lower envelope of the parabolas f[i] + (x - i)^2 s^2, evaluated at given rows. Kept between columns to save
/// allocations.
class Envelope {
public:
    /// Domain: f >= 0, infinite where there is no parabola.
    void build(std::span<const double> f, double spacing)
    {
        spacing2_ = spacing * spacing;
        vertex_.clear();
        start_.clear();
        height_.clear();
        for (size_t q = 0; q < f.size(); ++q) {
            if (f[q] == kInfinity)
                continue;
            double from = -kInfinity;
            while (!vertex_.empty()) {
                // where the parabolas of p and q meet: ((f_q / s^2 + q^2) - (f_p / s^2 + p^2)) / (2 q - 2 p)
                const double p = vertex_.back(), x = static_cast<double>(q);
                from = ((f[q] - height_.back()) / spacing2_ + x * x - p * p) / (2 * (x - p));
                if (from > start_.back())
                    break;
                vertex_.pop_back();
                start_.pop_back();
                height_.pop_back();
                from = -kInfinity;
            }
            vertex_.push_back(static_cast<double>(q));
            start_.push_back(from);
            height_.push_back(f[q]);
        }
        at_ = 0;
    }

    /// Squared distance at row x. Domain: x does not decrease from call to call.
    double at(double x)
    {
        if (vertex_.empty())
            return kInfinity;
        while (at_ + 1 < vertex_.size() && start_[at_ + 1] <= x)
            ++at_;
        const double d = x - vertex_[at_];
        return height_[at_] + d * d * spacing2_;
    }

private:
    std::vector<double> vertex_, start_, height_;
    double spacing2_ = 1;
    size_t at_ = 0;
};

} // namespace

TrimMask scan_convert(std::span<const MonotonePiece> pieces, uint width, uint height)
{
    TrimMask mask;
    mask.width = width;
    mask.height = height;
    mask.inside.assign(static_cast<size_t>(width) * height, 0);
    // each crossing flips all pixels right of it: mark the first, then sum along the row
    for (const MonotonePiece& piece : pieces) {
        const double v_lo = piece.v_lo(), v_hi = piece.v_hi();
        const int last = std::min(static_cast<int>(height), first_centre(v_hi * height));
        for (int y = std::max(0, first_centre(v_lo * height)); y < last; ++y) {
            const int x = std::max(0, first_centre(u_at_v(piece, (y + 0.5) / height) * width));
            if (x < static_cast<int>(width))
                mask.inside[static_cast<size_t>(y) * width + x] ^= 1;
        }
    }
    for (uint y = 0; y < height; ++y) {
        uint8_t* row = mask.inside.data() + static_cast<size_t>(y) * width;
        for (uint x = 1; x < width; ++x)
            row[x] ^= row[x - 1];
    }
    return mask;
}

std::vector<float> signed_distances(const TrimMask& mask, uint oversampling, double pixel_u, double pixel_v)
{
    assert(oversampling % 2 == 1 && mask.width % oversampling == 0 && mask.height % oversampling == 0);
    const uint columns = mask.width / oversampling, rows = mask.height / oversampling;
    const uint middle = oversampling / 2;
    const size_t line = mask.height + 2; // a row of outside below and above
    // squared distance along the row to the nearest pixel of the other kind, by column; [0]: row -1
    std::vector<double> other(columns * line);
    std::vector<uint8_t> inside(columns * line, 0);
    std::vector<int> changes;
    for (uint y = 0; y < mask.height; ++y) {
        const uint8_t* row = mask.inside.data() + static_cast<size_t>(y) * mask.width;
        changes.clear(); // x where pixel x differs from x - 1, outside the mask being outside
        for (uint x = 0; x <= mask.width; ++x)
            if ((x > 0 ? row[x - 1] : 0) != (x < mask.width ? row[x] : 0))
                changes.push_back(static_cast<int>(x));
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
            other[c * line + y + 1] = steps * pixel_u * steps * pixel_u;
            inside[c * line + y + 1] = row[x];
        }
    }

    std::vector<float> out(static_cast<size_t>(columns) * rows);
    std::vector<double> f(line);
    Envelope envelope;
    for (uint c = 0; c < columns; ++c)
        for (const uint8_t kind : {0, 1}) {
            const uint8_t* kinds = inside.data() + c * line;
            bool asked = false;
            for (uint r = 0; r < rows && !asked; ++r)
                asked = kinds[r * oversampling + middle + 1] == kind;
            if (!asked)
                continue;
            for (size_t y = 0; y < line; ++y)
                f[y] = kinds[y] != kind ? 0 : y == 0 || y + 1 == line ? kInfinity : other[c * line + y];
            envelope.build(f, pixel_v);
            for (uint r = 0; r < rows; ++r) {
                const size_t y = r * oversampling + middle + 1;
                const double d = kinds[y] == kind ? std::sqrt(envelope.at(static_cast<double>(y))) : 0;
                if (kinds[y] == kind)
                    out[static_cast<size_t>(r) * columns + c] = static_cast<float>(kind != 0 ? d : -d);
            }
        }
    return out;
}

double unresolved_distance(const TrimMask& mask, std::span<const MonotonePiece> pieces, double pixel_u, double pixel_v)
{
    const int width = static_cast<int>(mask.width), height = static_cast<int>(mask.height);
    const auto inside = [&](int x, int y) {
        return x >= 0 && y >= 0 && x < width && y < height && mask.inside[static_cast<size_t>(y) * mask.width + x] != 0;
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
    double worst = 0;
    for (const MonotonePiece& piece : pieces) {
        const double length =
            std::max(std::abs(piece.u[3] - piece.u[0]) * width, std::abs(piece.v[3] - piece.v[0]) * height);
        // a cubic's speed is at most 3 times its chord's when its points are ordered
        const int steps = 1 + static_cast<int>(length * (piece.cubic ? 3 : 1) / kStep);
        for (int i = 0; i <= steps; ++i) {
            const double t = static_cast<double>(i) / steps;
            const double x = bezier3(piece.u, t) * width - 0.5, y = bezier3(piece.v, t) * height - 0.5;
            const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
            const int sum = inside(x0, y0) + inside(x0 + 1, y0) + inside(x0, y0 + 1) + inside(x0 + 1, y0 + 1);
            // both kinds within the four centres around: no farther than the diagonal
            worst = std::max(worst, sum % 4 != 0 ? std::hypot(pixel_u, pixel_v) : nearest_centre(x, y, sum == 0));
            if (worst == kInfinity)
                return worst;
        }
    }
    // a distance changes by no more than the way to the next sample
    return worst + 0.5 * kStep * std::hypot(pixel_u, pixel_v);
}

uint sdf_oversampling(uint width, uint height)
{
    // small textures get the finest masks; large ones resolve details by themselves
    const uint texels = width * height;
    return texels <= 32u * 32u ? 15 : texels <= 128u * 128u ? 9 : texels <= 1024u * 1024u ? 5 : 3;
}

} // namespace trimray
