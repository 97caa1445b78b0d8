#include "format/fit_border.h"

#include <cmath>

namespace trimray {
namespace {

// Steps between points of a piece, at most; sweeps over all points; and how much of a point's error a visit takes away,
// so that points of one cell share what they cannot all have. More of each changes the border's error by under 3 %.
constexpr double kSpacing = 0.3;
constexpr int kSweeps = 4;
constexpr float kRelaxation = 0.5f;

/// f(x, y) for points along the pieces, in steps of the grid from its first sample.
template <class F>
void for_each_point(std::span<const MonotonePiece> pieces, const SampleGrid& grid, double step_u, double step_v, F&& f)
{
    const double step = std::max(step_u, step_v);
    for (const MonotonePiece& piece : pieces) {
        double x[4], y[4];
        for (int i = 0; i < 4; ++i) {
            x[i] = (piece.u[i] - grid.u0) / grid.du;
            y[i] = (piece.v[i] - grid.v0) / grid.dv;
        }
        double leg = 0; // a third of the piece's greatest speed
        for (int i = 0; i < 3; ++i)
            leg = std::max(leg, std::hypot((x[i + 1] - x[i]) * step_u, (y[i + 1] - y[i]) * step_v) / step);
        const int count = 1 + static_cast<int>(3 * leg / kSpacing);
        for (int i = 0; i < count; ++i) {
            const double t = (i + 0.5) / count;
            f(static_cast<float>(bezier3(x, t)), static_cast<float>(bezier3(y, t)));
        }
    }
}

} // namespace

std::vector<float> fit_to_border(std::span<const MonotonePiece> pieces, const SampleGrid& grid, double step_u,
                                 double step_v, std::span<const float> distances, double most)
{
    std::vector<float> fitted(distances.begin(), distances.end());
    const float last_x = static_cast<float>(grid.width - 1), last_y = static_cast<float>(grid.height - 1);
    const float limit = static_cast<float>(most);
    const auto visit = [&](float x, float y) {
        if (!(x >= 0 && y >= 0 && x < last_x && y < last_y))
            return;
        const uint i = static_cast<uint>(x), j = static_cast<uint>(y);
        const float s = x - static_cast<float>(i), t = y - static_cast<float>(j);
        const float weights[4] = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
        const size_t first = static_cast<size_t>(j) * grid.width + i;
        const size_t corners[4] = {first, first + 1, first + grid.width, first + grid.width + 1};
        float value = 0, squares = 0;
        for (int k = 0; k < 4; ++k) {
            value += weights[k] * fitted[corners[k]];
            squares += weights[k] * weights[k];
        }
        // b -= r B(p) w / |w|^2 brings B(p) = w.b to (1 - r) B(p)
        for (int k = 0; k < 4; ++k) {
            const float moved = fitted[corners[k]] - kRelaxation * value / squares * weights[k];
            const float distance = distances[corners[k]];
            fitted[corners[k]] = std::clamp(moved, distance - limit, distance + limit);
        }
    };
    for (int sweep = 0; sweep < kSweeps; ++sweep)
        for_each_point(pieces, grid, step_u, step_v, visit);
    return fitted;
}

} // namespace trimray
