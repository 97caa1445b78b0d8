#include "format/bezier_net.h"

#include <algorithm>

namespace trimray {
namespace {

/// The lines of control points along one direction, of a net of the given size.
struct Lines {
    int count = 0, step = 0, next_line = 0, points = 0;
};

Lines lines_along(const Net& net, int direction)
{
    if (direction == 0)
        return {net.count_v, net.count_v, 1, net.count_u};
    return {net.count_u, 1, net.count_v, net.count_v};
}

/// Makes each line that of its part over [0, t] (`lower`) or [t, 1].
void cut(Net& net, int direction, double t, bool lower)
{
    const Lines lines = lines_along(net, direction);
    for (int line = 0; line < lines.count; ++line) {
        Point4* p = &net.points[size_t(line) * lines.next_line];
        const int n = lines.points;
        for (int level = 1; level < n; ++level) {
            const int from = lower ? n - 1 : 0, to = lower ? level - 1 : n - 1 - level, way = lower ? -1 : 1;
            // lower: from the end, p_i = (1 - t) p_(i-1) + t p_i; else p_i = (1 - t) p_i + t p_(i+1)
            for (int i = from; i != to + (lower ? 0 : 1); i += way) {
                const int a = lower ? i - 1 : i, b = lower ? i : i + 1;
                for (int c = 0; c < 4; ++c)
                    p[i * lines.step][c] = (1 - t) * p[a * lines.step][c] + t * p[b * lines.step][c];
            }
        }
    }
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
