// The middle of a few measurements, and how far they spread.
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

/// Third quartile less first, over the median. Domain: at least one value, of one sign.
inline double relative_spread(std::vector<double> values)
{
    std::sort(values.begin(), values.end());
    const size_t quarter = values.size() / 4;
    return (values[values.size() - 1 - quarter] - values[quarter]) / median(values);
}

} // namespace trimray
