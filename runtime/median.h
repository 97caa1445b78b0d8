// The middle of a few measurements.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace trimray {

/// The mean of the two middle ones where their number is even. Domain: at least one value.
inline double median(std::vector<double> values)
{
    std::sort(values.begin(), values.end());
    const size_t middle = values.size() / 2;
    return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

} // namespace trimray
