// A face's distance texture as it lies in memory: rows of texels, or tiles of which only those near a border are kept.
// In words and tables: SPEC.md, "Distance textures".
#pragma once

#include "format/distance_field.h"
#include "format/pack_image.h"

#include <span>

namespace trimray {

inline constexpr uint kMaxTextureSide = 16384;
inline constexpr uint kMaxTileShift = 4;
inline constexpr uint kMaxTiles = 65534; // what 16 bits can name beside kTileOut and kTileIn

/// Texels a side and how they are kept. Shapes: tiles of (2^tile_shift + 1)^2 texels, each sharing its border texels
/// with its neighbours, tiles_u by tiles_v of them; with tile_shift 0 rows of `stride` texels.
struct TextureShape {
    uint width = 0, height = 0; // 0: no texture
    uint tile_shift = 0;
    uint stride = 0; // bytes from a texel to the one above it, in a row or in a tile
    uint tiles_u = 0, tiles_v = 0;

    uint tile_bytes() const { return stride * stride; }
    /// Bytes of the tiles' entries, before the tiles themselves.
    uint directory_bytes() const { return 2 * tiles_u * tiles_v; }
    /// Words of the texture if `tiles` tiles are kept; without tiles, of its rows.
    uint64_t words(uint64_t tiles) const;
    /// Words of the texture if every tile is kept.
    uint64_t words_at_most() const { return words(static_cast<uint64_t>(tiles_u) * tiles_v); }
};

TextureShape texture_shape(uint width, uint height, uint tile_shift);
TextureShape texture_shape(const FaceRecord& face);

/// Steps between texels from the domain's border to the outer texels: half a step where texels are a mask's pixels.
double texel_inset(bool centres);

/// Where the texels lie in the face's domain. Domain: a face with a texture.
SampleGrid texel_grid(const FaceRecord& face);

/// A texture's words from its texels. Shapes: levels[y * width + x]; the result has shape.words(tiles kept) words.
std::vector<uint> pack_texels(const TextureShape& shape, std::span<const uint8_t> levels);

/// Texel (x, y) of a texture whose words begin at `words`.
uint8_t texel_level(const TextureShape& shape, const uint* words, uint x, uint y);

/// Signed distance in texels at (u, v), positive inside: the tracers' bilinear look-up, in double.
/// Domain: a validated image with its textures; a face that has one.
double texture_distance(const PackImage& image, const FaceRecord& face, double u, double v);

} // namespace trimray
