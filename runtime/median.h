// The middle of a few measurements, and how far they spread.
#pragma once

#include <algorithm>
#include <cmath>
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

/// Third quartile less first. Domain: at least one value.
inline double quartile_distance(std::vector<double> values)
{
    std::sort(values.begin(), values.end());
    const size_t quarter = values.size() / 4;
    return values[values.size() - 1 - quarter] - values[quarter];
}

/// Third quartile less first, over the median. Domain: at least one value, of one sign.
inline double relative_spread(const std::vector<double>& values)
{
    return quartile_distance(values) / median(values);
}

/// The standard error of the median, as the quartiles tell it: of a normal distribution sigma is the quartiles'
/// distance over 1.349, and the median of n errs by 1.2533 sigma / sqrt(n). Domain: at least one value; of one it is 0.
inline double median_error(const std::vector<double>& values)
{
    return 1.2533 / 1.349 * quartile_distance(values) / std::sqrt(double(values.size()));
}

} // namespace trimray
