// Homogeneous control nets of Bezier patches, in double: loaded from a record, halved, cut to a part.
#pragma once

#include "format/pack_image.h"

#include <array>
#include <vector>

namespace trimray {

using Point4 = std::array<double, 4>;

/// A homogeneous control net (w x, w y, w z, w), index i * count_v + j.
struct Net {
    int count_u = 0, count_v = 0;
    std::vector<Point4> points;

    bool rational() const;
};

/// In patch units. Domain: a validated record of kind Bezier.
Net load_net(const PackImage& image, const PatchRecord& patch);

/// Halves a net at the middle of one direction (0: u, 1: v): `net` becomes the lower half, the upper half is returned.
/// Source: de Casteljau, Piegl & Tiller A1.5.
Net halve(Net& net, int direction);

/// The net of the same surface over [lo, hi] of one direction; beyond [0, 1] the polynomials go on.
/// Domain: lo < hi, hi > 0. Source: de Casteljau.
Net part_of(const Net& net, int direction, double lo, double hi);

} // namespace trimray
