#include "format/alike_trims.h"

#include <cstring>
#include <unordered_map>

#include <xxhash.h>

namespace trimray {
namespace {

constexpr uint kTextureFlags = kFaceTexelCentres | kFaceTileShiftMask << kFaceTileShiftBit;

struct TrimBytes {
    const float* points;
    const uint* pieces;
    size_t points_size, pieces_size; // in bytes
    struct {
        uint point_count, piece_count, sdf_size, flags;
        float extent_mm[2];
    } facts;

    TrimBytes(const PackImage& image, const FaceRecord& face)
        : points(image.trim_points.data() + 2 * static_cast<size_t>(face.first_point)),
          pieces(image.trim_pieces.data() + face.first_piece),
          points_size(2 * sizeof(float) * static_cast<size_t>(face.point_count)),
          pieces_size(sizeof(uint) * static_cast<size_t>(face.piece_count)), facts{
                                                                                 face.point_count,
                                                                                 face.piece_count,
                                                                                 face.sdf_size,
                                                                                 face.flags & kTextureFlags,
                                                                                 {face.extent_mm[0], face.extent_mm[1]}}
    {
    }
    uint64_t hash() const
    {
        const uint64_t h = XXH3_64bits_withSeed(points, points_size, XXH3_64bits(&facts, sizeof facts));
        return XXH3_64bits_withSeed(pieces, pieces_size, h);
    }
    bool operator==(const TrimBytes& other) const
    {
        return std::memcmp(&facts, &other.facts, sizeof facts) == 0 &&
               std::memcmp(points, other.points, points_size) == 0 &&
               std::memcmp(pieces, other.pieces, pieces_size) == 0;
    }
};

} // namespace

std::vector<uint> first_alike(const PackImage& image)
{
    std::vector<uint> first(image.faces.size());
    std::unordered_map<uint64_t, uint> face_of_hash; // looked up, never walked: its order does not matter
    for (uint f = 0; f < first.size(); ++f) {
        first[f] = f;
        if (image.faces[f].piece_count == 0)
            continue;
        const TrimBytes trims(image, image.faces[f]);
        const auto [found, added] = face_of_hash.try_emplace(trims.hash(), f);
        if (!added && trims == TrimBytes(image, image.faces[found->second]))
            first[f] = found->second;
    }
    return first;
}

} // namespace trimray
