#include "runtime/psnr.h"

#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>

namespace trimray {

Picture over_white(const Frame& frame)
{
    Frame opaque;
    opaque.width = frame.width;
    opaque.height = frame.height;
    opaque.rgba = frame.rgba;
    composite_over(opaque, {1, 1, 1});
    return to_picture(opaque);
}

double psnr_db(const Picture& a, const Picture& b)
{
    assert(a.width == b.width && a.height == b.height && a.rgba.size() == b.rgba.size() && !a.rgba.empty());
    uint64_t squares = 0;
    for (size_t i = 0; i < a.rgba.size(); ++i) {
        if (i % 4 == 3)
            continue;
        const int difference = int(a.rgba[i]) - int(b.rgba[i]);
        squares += static_cast<uint64_t>(difference * difference);
    }
    if (squares == 0)
        return std::numeric_limits<double>::infinity();
    const double mse = static_cast<double>(squares) / (0.75 * static_cast<double>(a.rgba.size()));
    return 10 * std::log10(255.0 * 255.0 / mse);
}

} // namespace trimray
