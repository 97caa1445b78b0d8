#include "runtime/measure/picture_errors.h"

#include "runtime/measure/ssim.h"
#include "runtime/psnr.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace trimray {
namespace {

bool hits(const Frame& frame, size_t i)
{
    return std::isfinite(frame.depth_mm[i]);
}

/// Radians between two unit vectors; arc tangent, for angles near zero.
double angle_between(const float* a, const float* b)
{
    double dot = 0, cross = 0;
    for (size_t i = 0; i < 3; ++i) {
        const size_t j = (i + 1) % 3, k = (i + 2) % 3;
        dot += double(a[i]) * double(b[i]);
        const double c = double(a[j]) * double(b[k]) - double(a[k]) * double(b[j]);
        cross += c * c;
    }
    return std::atan2(std::sqrt(cross), dot);
}

/// Where the nearest pixel is that hits, or misses.
class NearestAnswer {
public:
    explicit NearestAnswer(const Frame& frame) : frame_(frame) {}

    /// From pixel i to the nearest other with the answer `hit`, outwards ring by ring; infinity: there is none.
    double distance_px(size_t i, bool hit) const
    {
        const int width = int(frame_.width), height = int(frame_.height);
        const int x0 = int(i % frame_.width), y0 = int(i / frame_.width);
        double nearest2 = std::numeric_limits<double>::infinity();
        for (int ring = 1; ring < std::max(width, height) && double(ring) * ring < nearest2; ++ring)
            for (int y = std::max(y0 - ring, 0); y <= std::min(y0 + ring, height - 1); ++y) {
                const bool whole_row = std::abs(y - y0) == ring;
                for (int x = x0 - ring; x <= x0 + ring; x += whole_row ? 1 : 2 * ring)
                    if (x >= 0 && x < width && hits(frame_, size_t(y) * frame_.width + size_t(x)) == hit)
                        nearest2 = std::min(nearest2, double((x - x0) * (x - x0) + (y - y0) * (y - y0)));
            }
        return std::sqrt(nearest2);
    }

private:
    const Frame& frame_;
};

bool is_surrounded(const Frame& frame, size_t i)
{
    const uint32_t x = uint32_t(i % frame.width), y = uint32_t(i / frame.width);
    if (x == 0 || y == 0 || x + 1 == frame.width || y + 1 == frame.height)
        return false;
    for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
            if (!hits(frame, size_t(int(y) + dy) * frame.width + size_t(int(x) + dx)))
                return false;
    return true;
}

} // namespace

PictureErrors picture_errors(ReferencePicture& reference, const Frame& frame)
{
    const Frame& right = reference.frame();
    PictureErrors errors;
    errors.answers = reference.errors(frame);
    const std::vector<size_t>& ties = errors.answers.ties;
    errors.ssim = ssim(reference.without_ties(over_white(frame), ties), reference.picture());
    std::vector<double> depth_mm, depth_px, normal_deg, outline_px;
    const NearestAnswer nearest(right);
    for (size_t i = 0; i < right.depth_mm.size(); ++i) {
        const bool hit = hits(frame, i), right_hit = hits(right, i);
        if (hit && right_hit) {
            const double off = std::abs(double(frame.depth_mm[i]) - double(right.depth_mm[i]));
            depth_mm.push_back(off);
            depth_px.push_back(off / reference.footprint_mm(i));
            if (!std::binary_search(ties.begin(), ties.end(), i)) // the two faces may look away from each other
                normal_deg.push_back(angle_between(&frame.normal[3 * i], &right.normal[3 * i]) * 180 /
                                     std::numbers::pi);
        } else if (hit != right_hit) {
            const double away = nearest.distance_px(i, hit);
            outline_px.push_back(std::isfinite(away) ? away - 0.5 : std::hypot(right.width, right.height));
            errors.leaks += right_hit && is_surrounded(right, i);
        }
    }
    errors.both_hit = depth_mm.size();
    errors.depth_mm = spread(std::move(depth_mm));
    errors.depth_px = spread(std::move(depth_px));
    errors.normal_deg = spread(std::move(normal_deg));
    errors.outline_px = spread(std::move(outline_px));
    return errors;
}

} // namespace trimray
