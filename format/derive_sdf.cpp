// Distance textures: their sizes from the memory allowed (paper, eq. 4 and 5) and their texels.
#include "format/alike_trims.h"
#include "format/curve_distance.h"
#include "format/derive.h"
#include "format/distance_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace trimray {
namespace {

constexpr uint kMaxSdfSide = 8192;
// Isotropic layout: bytes that a small face gets whatever its share, if the total allows (about 8 x 8 texels).
constexpr double kFloorBytes = 64;
// No |B| exceeds this, so the texture never decides.
constexpr float kNeverDecides = 255;

bool has_texture(const FaceRecord& face)
{
    return face.piece_count != 0 && (face.sdf_size & 0xffffu) != 0 && (face.sdf_size >> 16) != 0;
}

/// The least number of 12 bits that is not below x > 0: a texture's unit and band are free within that, and so short
/// they compress.
double rounded_up(double x)
{
    int exponent = 0;
    const double mantissa = std::frexp(x, &exponent);
    return std::ldexp(std::ceil(std::ldexp(mantissa, 12)), exponent - 12);
}

uint words_of(uint sdf_size)
{
    return ((sdf_size & 0xffffu) + 3) / 4 * (sdf_size >> 16);
}

/// Signed distances of a face's texels, in the unit of extent_mm, and by how much they may be off.
struct TexelDistances {
    std::vector<float> values; // width * height, or more than `reach` (infinite), positive inside
    double error = 0;
};

TexelDistances distances_to_mask(std::span<const MonotonePiece> pieces, uint width, uint height, double texel_u,
                                 double texel_v, double reach)
{
    const uint oversampling = sdf_oversampling(width, height);
    const double pixel_u = texel_u / oversampling, pixel_v = texel_v / oversampling;
    const TrimMask mask = scan_convert(pieces, pixel_centres(width * oversampling, height * oversampling));
    // The loop runs between two pixels of different kinds, so the distance to the nearest other pixel is up to
    // `unresolved` too long and never too short; half a pixel less of it halves the error.
    const double shift = 0.25 * (pixel_u + pixel_v);
    const double unresolved = unresolved_distance(mask, pieces, pixel_u, pixel_v);
    TexelDistances distances;
    distances.error = std::max(shift, unresolved - shift);
    distances.values = signed_distances(mask, oversampling, pixel_u, pixel_v, reach + shift);
    for (float& d : distances.values)
        d = static_cast<float>(d > 0 ? std::max(d - shift, 0.0) : std::min(d + shift, 0.0));
    return distances;
}

TexelDistances distances_to_curves(std::span<const MonotonePiece> pieces, uint width, uint height, double texel_u,
                                   double texel_v, double reach)
{
    return {curve_distances(pieces, pixel_centres(width, height), texel_u, texel_v, reach),
            (kChordDeviation + kDistanceRounding) * reach};
}

void fill_texture(PackImage& image, FaceRecord& face)
{
    const uint width = face.sdf_size & 0xffffu, height = face.sdf_size >> 16;
    const bool measured = face.extent_mm[0] > 0 && face.extent_mm[1] > 0;
    const double texel_u = (measured ? static_cast<double>(face.extent_mm[0]) : 1.0) / width;
    const double texel_v = (measured ? static_cast<double>(face.extent_mm[1]) : 1.0) / height;
    const double texel = rounded_up(std::max(texel_u, texel_v));

    std::vector<MonotonePiece> pieces;
    for (uint i = 0; i < face.piece_count; ++i)
        pieces.push_back(
            load_piece(image.trim_points.data(), face.first_point, image.trim_pieces[face.first_piece + i]));
    const double reach = 129 * kSdfTexelQuantum * texel; // levels end at 127 and 128 quanta
    const auto distances_to = image.trim_textures.source == TrimSource::Mask ? distances_to_mask : distances_to_curves;
    const TexelDistances distances = distances_to(pieces, width, height, texel_u, texel_v, reach);

    // |B - d| <= sqrt(hu^2 + hv^2) / 2 + q / 2 + e
    const double band = 0.5 * std::hypot(texel_u, texel_v) / texel + 0.5 * kSdfTexelQuantum + distances.error / texel;
    face.sdf_texel_mm = static_cast<float>(texel);
    face.sdf_band_texels = band < kNeverDecides ? static_cast<float>(rounded_up(band * (1 + 1e-6))) : kNeverDecides;

    const uint row_words = (width + 3) / 4;
    uint* words = image.sdf_words.data() + face.sdf_first_word;
    for (uint y = 0; y < height; ++y)
        for (uint x = 0; x < width; ++x) {
            const double d = distances.values[static_cast<size_t>(y) * width + x];
            const double level = std::round(128 + d / texel / kSdfTexelQuantum);
            const uint b = static_cast<uint>(std::clamp(level, 0.0, 255.0));
            words[y * row_words + x / 4] |= b << (8 * (x % 4));
        }
}

/// Texture size of `bytes` texels for a face, texels as near to square on the surface as whole numbers allow.
uint isotropic_size(const FaceRecord& face, double bytes)
{
    const double aspect = face.extent_mm[0] > 0 && face.extent_mm[1] > 0
                              ? static_cast<double>(face.extent_mm[0]) / face.extent_mm[1]
                              : 1.0;
    const double texels = std::floor(bytes);
    if (texels < 1)
        return 0;
    const double side_max = std::min<double>(kMaxSdfSide, texels);
    const double width = std::clamp(std::round(std::sqrt(texels * aspect)), 1.0, side_max);
    const double height = std::clamp(std::floor(texels / width), 1.0, side_max);
    return static_cast<uint>(width) | static_cast<uint>(height) << 16;
}

} // namespace

void derive_sdf(PackImage& image)
{
    size_t word_count = 0;
    for (FaceRecord& face : image.faces) {
        if (!has_texture(face))
            face.sdf_size = 0;
        face.sdf_first_word = face.sdf_size != 0 ? static_cast<uint>(word_count) : 0;
        face.sdf_texel_mm = 0;
        face.sdf_band_texels = 0;
        word_count += words_of(face.sdf_size);
    }
    image.sdf_words.assign(word_count, 0);
    const std::vector<uint> alike = first_alike(image);
    tbb::parallel_for(size_t{0}, image.faces.size(), [&](size_t f) {
        if (has_texture(image.faces[f]) && alike[f] == f)
            fill_texture(image, image.faces[f]);
    });
    for (size_t f = 0; f < image.faces.size(); ++f) {
        FaceRecord& face = image.faces[f];
        const FaceRecord& filled = image.faces[alike[f]];
        if (alike[f] == f || !has_texture(face))
            continue;
        face.sdf_texel_mm = filled.sdf_texel_mm;
        face.sdf_band_texels = filled.sdf_band_texels;
        std::copy_n(image.sdf_words.begin() + filled.sdf_first_word, words_of(face.sdf_size),
                    image.sdf_words.begin() + face.sdf_first_word);
    }
}

void allocate_trim_memory(PackImage& image, double total_bytes, const TrimTextureOptions& options)
{
    image.trim_textures = options;
    double total_area = 0;
    double faces = 0;
    for (FaceRecord& face : image.faces) {
        face.sdf_size = 0;
        if (face.piece_count == 0)
            continue;
        total_area += face.area_mm2;
        faces += 1;
    }
    if (!(total_bytes > 0) || !(total_area > 0))
        return;

    const double floor_bytes = std::min(kFloorBytes, 0.5 * total_bytes / faces);
    const double shared_bytes = total_bytes - floor_bytes * faces;
    for (FaceRecord& face : image.faces) {
        if (face.piece_count == 0)
            continue;
        const double area = face.area_mm2;
        if (options.layout == TrimLayout::Square) {
            // M_i = ceil(M_total A_i / sum A), H_i = floor(sqrt(M_i))
            const double bytes = std::ceil(total_bytes * area / total_area);
            const uint side = static_cast<uint>(std::min<double>(kMaxSdfSide, std::floor(std::sqrt(bytes))));
            face.sdf_size = side | side << 16;
        } else {
            face.sdf_size = isotropic_size(face, floor_bytes + shared_bytes * area / total_area);
        }
    }
}

} // namespace trimray
