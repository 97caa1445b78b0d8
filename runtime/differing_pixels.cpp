#include "runtime/differing_pixels.h"

#include <cstddef>
#include <cstring>
#include <vector>

namespace trimray {
namespace {

template <class T>
bool same_pixel(const std::vector<T>& a, const std::vector<T>& b, size_t pixel, size_t channels = 1)
{
    return std::memcmp(&a[pixel * channels], &b[pixel * channels], channels * sizeof(T)) == 0;
}

} // namespace

uint64_t differing_pixels(const Frame& a, const Frame& b)
{
    uint64_t count = 0;
    for (size_t i = 0; i < a.face.size(); ++i)
        count +=
            !(same_pixel(a.rgba, b.rgba, i, 4) && same_pixel(a.depth_mm, b.depth_mm, i) &&
              same_pixel(a.normal, b.normal, i, 3) && same_pixel(a.uv, b.uv, i, 2) && same_pixel(a.face, b.face, i) &&
              same_pixel(a.instance, b.instance, i) && same_pixel(a.certified, b.certified, i));
    return count;
}

} // namespace trimray
