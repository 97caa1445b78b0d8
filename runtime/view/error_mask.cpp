#include "runtime/view/error_mask.h"

#include <algorithm>
#include <cstddef>

namespace trimray {
namespace {

enum : size_t { kWrong, kOtherFace, kOpen, kUncertified }; // in mask_colors()

} // namespace

const std::vector<MaskColor>& mask_colors()
{
    // Okabe & Ito's, which the colour-blind tell apart
    static const std::vector<MaskColor> colors{
        {"hits, misses or depths that are wrong", {213, 94, 0, 255}},
        {"another face at the right depth", {204, 121, 167, 255}},
        {"open: the right answer changes a hair beside", {86, 180, 233, 255}},
        {"not certified, but right", {240, 228, 66, 128}},
    };
    return colors;
}

Result<ErrorMask> error_mask(ViewReference& reference, const Frame& frame, float error_px,
                             const std::function<bool()>& cancelled)
{
    ErrorMask mask;
    mask.depth_px = std::max(double(error_px), kLeastDepthPx);
    const Result<std::vector<PixelVerdict>> verdicts = reference.verdicts(frame, mask.depth_px, cancelled);
    if (!verdicts.ok())
        return verdicts.error();
    mask.pixels = verdicts->size();
    mask.overlay = {frame.width, frame.height, std::vector<uint8_t>(4 * verdicts->size(), 0)};
    const auto paint = [&](size_t i, size_t meaning) {
        std::copy_n(mask_colors()[meaning].srgb.begin(), 4, mask.overlay.rgba.begin() + std::ptrdiff_t(4 * i));
    };
    for (size_t i = 0; i < verdicts->size(); ++i) {
        const bool uncertified = frame.certified[i] == 0;
        mask.uncertified += uncertified;
        switch ((*verdicts)[i]) {
        case PixelVerdict::Right:
            if (uncertified)
                paint(i, kUncertified);
            break;
        case PixelVerdict::Wrong:
            ++mask.wrong;
            paint(i, kWrong);
            break;
        case PixelVerdict::OtherFace:
            ++mask.other_face;
            paint(i, kOtherFace);
            break;
        case PixelVerdict::Open:
            ++mask.open;
            paint(i, kOpen);
            break;
        }
    }
    return mask;
}

} // namespace trimray
