#include "runtime/trim_mode.h"

#include <fmt/format.h>

#include <algorithm>

namespace trimray {

const char* trim_name(TrimMode mode)
{
    switch (mode) {
    case TrimMode::Auto:
        return "auto";
    case TrimMode::Exact:
        return "exact";
    case TrimMode::Sdf:
        return "sdf";
    case TrimMode::Hybrid:
        return "hybrid";
    case TrimMode::Kd:
        return "kd";
    case TrimMode::Reference:
        return "reference";
    }
    return "unknown";
}

Result<TrimMode> choose_trim(const PackImage& image, TrimMode wanted)
{
    const TrimMode mode = wanted == TrimMode::Auto ? TrimMode::Exact : wanted;
    if (mode == TrimMode::Reference || mode == TrimMode::Kd)
        return mode;
    const auto refusal = [mode](const std::string& detail) {
        return Error{ErrorCode::UnsupportedPackFeature, fmt::format("--trim {}", trim_name(mode)), detail};
    };
    // a face without pieces has no inside in any mode, and needs neither cells nor texture to say so
    const auto faces_without = [&image](uint FaceRecord::*data) {
        return std::count_if(image.faces.begin(), image.faces.end(), [data](const FaceRecord& face) {
            return (face.flags & kFaceNaturalBorder) == 0 && face.piece_count != 0 && face.*data == 0;
        });
    };
    if (const auto bare = faces_without(&FaceRecord::sdf_size); bare > 0 && mode != TrimMode::Exact)
        return refusal(fmt::format("{} of the pack's {} faces have trims without a distance texture; use --trim exact, "
                                   "or pack with --trim-memory above 0",
                                   bare, image.faces.size()));
    if (const auto bare = faces_without(&FaceRecord::grid); bare > 0 && mode != TrimMode::Sdf)
        return refusal(fmt::format("{} of the pack's {} faces have trims without cells; pack the model again", bare,
                                   image.faces.size()));
    return mode;
}

} // namespace trimray
