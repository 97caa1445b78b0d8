// How many values of one quantity are spread: the mean, nearly the largest, the largest.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace trimray {

/// Of one quantity, over many pixels; zeros where there are none.
struct Spread {
    double mean = 0, at_99 = 0, largest = 0; // at_99: 99 % are no larger
};

/// `values` in any order.
inline Spread spread(std::vector<double> values)
{
    if (values.empty())
        return {};
    std::sort(values.begin(), values.end());
    double sum = 0;
    for (const double value : values)
        sum += value;
    const size_t rank = size_t(std::ceil(0.99 * double(values.size()))); // the nearest-rank percentile, from 1
    return {sum / double(values.size()), values[rank - 1], values.back()};
}

} // namespace trimray
