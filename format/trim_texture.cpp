#include "format/trim_texture.h"

#include <algorithm>
#include <cmath>

namespace trimray {
namespace {

uint8_t byte_at(const uint* words, size_t at)
{
    return static_cast<uint8_t>(words[at / 4] >> 8 * (at % 4));
}
void set_byte(std::vector<uint>& words, size_t at, uint value)
{
    words[at / 4] |= value << 8 * (at % 4);
}

} // namespace

uint64_t TextureShape::words(uint64_t tiles) const
{
    const uint64_t rows = static_cast<uint64_t>(stride) * height;
    return ((tile_shift == 0 ? rows : directory_bytes() + tiles * tile_bytes()) + 3) / 4;
}

TextureShape texture_shape(uint width, uint height, uint tile_shift)
{
    TextureShape shape{width, height, tile_shift, std::max(width, 2u), 0, 0};
    if (tile_shift == 0 || width == 0 || height == 0)
        return shape;
    // a look-up at the last texel goes to the tile before it
    const auto tiles = [&](uint texels) { return ((std::max(texels, 2u) - 2) >> tile_shift) + 1; };
    shape.stride = (1u << tile_shift) + 1;
    shape.tiles_u = tiles(width);
    shape.tiles_v = tiles(height);
    return shape;
}

TextureShape texture_shape(const FaceRecord& face)
{
    return texture_shape(face.sdf_size & 0xffffu, face.sdf_size >> 16,
                         face.flags >> kFaceTileShiftBit & kFaceTileShiftMask);
}

double texel_inset(bool centres)
{
    return centres ? 0.5 : static_cast<double>(kSdfInset);
}

SampleGrid texel_grid(const FaceRecord& face)
{
    const uint width = face.sdf_size & 0xffffu, height = face.sdf_size >> 16;
    const double inset = texel_inset((face.flags & kFaceTexelCentres) != 0);
    const double du = 1 / (width - 1 + 2 * inset), dv = 1 / (height - 1 + 2 * inset);
    return {width, height, inset * du, inset * dv, du, dv};
}

std::vector<uint> pack_texels(const TextureShape& shape, std::span<const uint8_t> levels)
{
    const auto level = [&](uint x, uint y) {
        return levels[static_cast<size_t>(std::min(y, shape.height - 1)) * shape.width + std::min(x, shape.width - 1)];
    };
    std::vector<uint> words(shape.words(0));
    if (shape.tile_shift == 0) {
        for (uint y = 0; y < shape.height; ++y)
            for (uint x = 0; x < shape.width; ++x)
                set_byte(words, static_cast<size_t>(y) * shape.stride + x, level(x, y));
        return words;
    }
    std::vector<uint8_t> tile(shape.tile_bytes());
    uint kept = 0;
    for (uint ty = 0; ty < shape.tiles_v; ++ty)
        for (uint tx = 0; tx < shape.tiles_u; ++tx) {
            for (uint y = 0; y < shape.stride; ++y)
                for (uint x = 0; x < shape.stride; ++x)
                    tile[y * shape.stride + x] = level((tx << shape.tile_shift) + x, (ty << shape.tile_shift) + y);
            const bool constant = (tile[0] == 0 || tile[0] == 255) &&
                                  std::all_of(tile.begin(), tile.end(), [&](uint8_t b) { return b == tile[0]; });
            const uint entry = constant ? (tile[0] == 0 ? kTileOut : kTileIn) : kFirstTile + kept;
            const size_t at = 2 * (static_cast<size_t>(ty) * shape.tiles_u + tx);
            set_byte(words, at, entry & 0xffu);
            set_byte(words, at + 1, entry >> 8);
            if (constant)
                continue;
            const size_t first = shape.directory_bytes() + static_cast<size_t>(kept) * shape.tile_bytes();
            words.resize(shape.words(++kept));
            for (size_t i = 0; i < tile.size(); ++i)
                set_byte(words, first + i, tile[i]);
        }
    return words;
}

uint8_t texel_level(const TextureShape& shape, const uint* words, uint x, uint y)
{
    if (shape.tile_shift == 0)
        return byte_at(words, static_cast<size_t>(y) * shape.stride + x);
    const uint tx = std::min(x >> shape.tile_shift, shape.tiles_u - 1);
    const uint ty = std::min(y >> shape.tile_shift, shape.tiles_v - 1);
    const size_t at = 2 * (static_cast<size_t>(ty) * shape.tiles_u + tx);
    const uint entry = byte_at(words, at) | static_cast<uint>(byte_at(words, at + 1)) << 8;
    if (entry < kFirstTile)
        return entry == kTileIn ? 255 : 0;
    const size_t first = shape.directory_bytes() + static_cast<size_t>(entry - kFirstTile) * shape.tile_bytes();
    return byte_at(words, first + (y - (ty << shape.tile_shift)) * shape.stride + (x - (tx << shape.tile_shift)));
}

double texture_distance(const PackImage& image, const FaceRecord& face, double u, double v)
{
    const TextureShape shape = texture_shape(face);
    const SampleGrid grid = texel_grid(face);
    const uint* words = image.sdf_words.data() + face.sdf_first_word;
    const double x = std::clamp<double>((u - grid.u0) / grid.du, 0, shape.width - 1);
    const double y = std::clamp<double>((v - grid.v0) / grid.dv, 0, shape.height - 1);
    const uint i = static_cast<uint>(x), j = static_cast<uint>(y);
    const uint i1 = std::min(i + 1, shape.width - 1), j1 = std::min(j + 1, shape.height - 1);
    const auto texel = [&](uint column, uint row) { return texel_level(shape, words, column, row) - 128.0; };
    const double lower = std::lerp(texel(i, j), texel(i1, j), x - i);
    const double upper = std::lerp(texel(i, j1), texel(i1, j1), x - i);
    return std::lerp(lower, upper, y - j) * kSdfTexelQuantum;
}

} // namespace trimray
