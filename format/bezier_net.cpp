// Compiled once for each target by foreach_target.h, for what cuts nets; the best one is chosen at run time. Nothing is
// fused, so all of them give the same bits.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "format/bezier_net.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "format/bezier_net.h"

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace trimray {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<double, 4> kTag; // a Point4, or half of it
constexpr int kLaneCount = int(hn::MaxLanes(kTag));

/// Makes each line of control points along a direction that of its part over [0, t] (`lower`) or [t, 1].
void cut(Net& net, int direction, double t, bool lower)
{
    // lines along u lie side by side and are cut at once, those along v one by one
    const int lines = direction == 0 ? 1 : net.count_u, points = direction == 0 ? net.count_u : net.count_v;
    const int next = direction == 0 ? 4 * net.count_v : 4; // numbers from a point to the next along its line
    const auto of_first = hn::Set(kTag, 1 - t), of_second = hn::Set(kTag, t);
    for (int line = 0; line < lines; ++line) {
        double* p = net.points[size_t(line) * net.count_v].data();
        for (int level = 1; level < points; ++level) {
            // lower: from the end, p_i = (1 - t) p_(i-1) + t p_i; else p_i = (1 - t) p_i + t p_(i+1)
            if (lower)
                for (int i = points * next - kLaneCount; i >= level * next; i -= kLaneCount)
                    hn::StoreU(of_first * hn::LoadU(kTag, p + i - next) + of_second * hn::LoadU(kTag, p + i), kTag,
                               p + i);
            else
                for (int i = 0; i < (points - level) * next; i += kLaneCount)
                    hn::StoreU(of_first * hn::LoadU(kTag, p + i) + of_second * hn::LoadU(kTag, p + i + next), kTag,
                               p + i);
        }
    }
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace trimray
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace trimray {
namespace {

HWY_EXPORT(cut);

void cut(Net& net, int direction, double t, bool lower)
{
    HWY_DYNAMIC_DISPATCH(cut)(net, direction, t, lower);
}

} // namespace

bool Net::rational() const
{
    return std::any_of(points.begin(), points.end(), [&](const Point4& p) { return p[3] != points[0][3]; });
}

Net load_net(const PackImage& image, const PatchRecord& patch)
{
    Net net;
    net.count_u = int(patch.shape >> 8 & 0xffu) + 1;
    net.count_v = int(patch.shape >> 16 & 0xffu) + 1;
    const bool rational = (patch.shape & kShapeRational) != 0;
    const float* from = &image.control_points[patch.first_control_point];
    net.points.resize(size_t(net.count_u) * net.count_v);
    for (Point4& p : net.points) {
        p = {from[0], from[1], from[2], rational ? from[3] : 1.0};
        from += rational ? 4 : 3;
    }
    return net;
}

Net halve(Net& net, int direction)
{
    Net upper = net;
    cut(net, direction, 0.5, true);
    cut(upper, direction, 0.5, false);
    return upper;
}

Net part_of(const Net& net, int direction, double lo, double hi)
{
    Net part = net;
    cut(part, direction, hi, true);
    cut(part, direction, lo / hi, false);
    return part;
}

} // namespace trimray

#endif
