#include "runtime/measure/error_pictures.h"

#include "runtime/psnr.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace trimray {
namespace {

constexpr uint32_t kCropSide = 64; // pixels
constexpr uint32_t kMapWidth = 320;

uint32_t square(int value)
{
    return uint32_t(value * value);
}

/// Sums over all pixels above and left of a corner: (width + 1) x (height + 1) of them.
std::vector<uint64_t> sums_of_differences(const Picture& a, const Picture& b)
{
    const size_t stride = a.width + 1;
    std::vector<uint64_t> sums(stride * (a.height + 1), 0);
    for (size_t y = 0; y < a.height; ++y)
        for (size_t x = 0; x < a.width; ++x) {
            uint64_t difference = 0;
            for (size_t c = 0; c < 3; ++c) {
                const size_t at = 4 * (y * a.width + x) + c;
                difference += square(int(a.rgba[at]) - int(b.rgba[at]));
            }
            sums[(y + 1) * stride + x + 1] =
                difference + sums[y * stride + x + 1] + sums[(y + 1) * stride + x] - sums[y * stride + x];
        }
    return sums;
}

/// 0 where both miss, else how many steps it reaches; one more than there are for a wrong answer.
size_t badness(const ReferencePicture& reference, const Frame& frame, size_t i)
{
    const float depth = frame.depth_mm[i], right = reference.frame().depth_mm[i];
    if (std::isfinite(depth) != std::isfinite(right))
        return error_steps().size() + 1;
    if (!std::isfinite(right))
        return 0;
    const double off_px = std::abs(double(depth) - double(right)) / reference.footprint_mm(i);
    const auto reached = [off_px](const ErrorStep& step) { return off_px >= step.depth_px; };
    return size_t(std::count_if(error_steps().begin(), error_steps().end(), reached));
}

Picture cut_out(const Picture& picture, const WorstPlace& place)
{
    Picture out{place.width, place.height, {}};
    for (uint32_t y = place.y; y < place.y + place.height; ++y) {
        const auto row = picture.rgba.begin() + std::ptrdiff_t(4 * (size_t{y} * picture.width + place.x));
        out.rgba.insert(out.rgba.end(), row, row + std::ptrdiff_t(4 * size_t{place.width}));
    }
    return out;
}

} // namespace

WorstPlace worst_place(const Picture& picture, const Picture& right, uint32_t side)
{
    assert(picture.width == right.width && picture.height == right.height && side > 0);
    const std::vector<uint64_t> sums = sums_of_differences(picture, right);
    const size_t stride = picture.width + 1;
    WorstPlace worst{0, 0, std::min(side, picture.width), std::min(side, picture.height), 0};
    for (uint32_t y = 0; y + worst.height <= picture.height; ++y)
        for (uint32_t x = 0; x + worst.width <= picture.width; ++x) {
            const size_t top = y * stride + x, bottom = top + worst.height * stride;
            const uint64_t difference = sums[bottom + worst.width] - sums[bottom] - sums[top + worst.width] + sums[top];
            if (difference > worst.difference)
                worst = {x, y, worst.width, worst.height, difference};
        }
    return worst;
}

const std::vector<ErrorStep>& error_steps()
{
    // viridis, from its dark end on
    static const std::vector<ErrorStep> steps{
        {0, {68, 1, 84}},       {1e-6, {71, 44, 122}},  {1e-5, {59, 81, 139}},
        {1e-4, {44, 113, 142}}, {1e-3, {33, 144, 141}}, {1e-2, {39, 173, 129}},
        {1e-1, {92, 200, 99}},  {1, {170, 220, 50}},    {10, {253, 231, 37}},
    };
    return steps;
}

Picture error_map(const ReferencePicture& reference, const Frame& frame, uint32_t widest)
{
    const uint32_t width = frame.width, height = frame.height, side = (width + widest - 1) / widest;
    Picture map{(width + side - 1) / side, (height + side - 1) / side, {}};
    std::vector<size_t> worst(size_t{map.width} * map.height, 0);
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) {
            size_t& at = worst[size_t{y / side} * map.width + x / side];
            at = std::max(at, badness(reference, frame, size_t{y} * width + x));
        }
    for (const size_t badness : worst) {
        if (badness == 0) {
            map.rgba.insert(map.rgba.end(), 4, 0);
            continue;
        }
        const auto& steps = error_steps();
        const std::array<uint8_t, 3>& colour = badness > steps.size() ? kWrongAnswer : steps[badness - 1].srgb;
        map.rgba.insert(map.rgba.end(), colour.begin(), colour.end());
        map.rgba.push_back(255);
    }
    return map;
}

Result<ErrorPictures> error_pictures(const ReferencePicture& reference, const Frame& frame,
                                     const std::vector<size_t>& ties)
{
    const Picture seen = reference.without_ties(over_white(frame), ties);
    ErrorPictures pictures;
    pictures.place = worst_place(seen, reference.picture(), kCropSide);
    if (pictures.place.difference == 0)
        return pictures;
    for (const auto& [picture, png] : {std::pair{cut_out(seen, pictures.place), &pictures.seen},
                                       std::pair{cut_out(reference.picture(), pictures.place), &pictures.right},
                                       std::pair{error_map(reference, frame, kMapWidth), &pictures.map}}) {
        Result<std::vector<std::byte>> bytes = encode_png(picture, PngForm::Fewest);
        if (!bytes.ok())
            return bytes.error();
        *png = std::move(*bytes);
    }
    return pictures;
}

} // namespace trimray
