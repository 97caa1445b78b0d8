// Distance textures: their sizes from the memory allowed (paper, eq. 4 and 5) and their texels.
#include "format/alike_trims.h"
#include "format/curve_distance.h"
#include "format/derive.h"
#include "format/distance_field.h"
#include "format/fit_border.h"
#include "format/trim_texture.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

namespace trimray {
namespace {

// Isotropic layout: bytes that a small face gets whatever its share, if the total allows (about 8 x 8 texels).
constexpr double kFloorBytes = 64;
// No |B| exceeds this, so the texture never decides.
constexpr float kNeverDecides = 255;
// Levels of a texel end 128 quanta outside and 127 inside.
constexpr double kReachTexels = 129 * kSdfTexelQuantum;

bool has_texture(const FaceRecord& face)
{
    return face.piece_count != 0 && (face.sdf_size & 0xffffu) != 0 && (face.sdf_size >> 16) != 0;
}

/// The pieces of a face, each from its lower end, in an order of their own: which way the file's loops run and where
/// they begin must not show in a texture's rounding.
std::vector<MonotonePiece> pieces_of(const PackImage& image, const FaceRecord& face)
{
    std::vector<MonotonePiece> pieces;
    for (uint i = 0; i < face.piece_count; ++i) {
        MonotonePiece piece =
            load_piece(image.trim_points.data(), face.first_point, image.trim_pieces[face.first_piece + i]);
        if (std::tie(piece.v[3], piece.u[3]) < std::tie(piece.v[0], piece.u[0])) {
            std::reverse(std::begin(piece.u), std::end(piece.u));
            std::reverse(std::begin(piece.v), std::end(piece.v));
            if (!piece.cubic)
                set_thirds(piece);
        }
        pieces.push_back(piece);
    }
    std::sort(pieces.begin(), pieces.end(), [](const MonotonePiece& a, const MonotonePiece& b) {
        return std::tie(a.v[0], a.u[0], a.v[3], a.u[3], a.v[1], a.u[1], a.v[2], a.u[2]) <
               std::tie(b.v[0], b.u[0], b.v[3], b.u[3], b.v[1], b.u[1], b.v[2], b.u[2]);
    });
    return pieces;
}

/// Lengths of a face's domain along u and v on the surface, in mm; where they were not measured, 1 each.
std::array<double, 2> metric_of(const FaceRecord& face)
{
    if (!(face.extent_mm[0] > 0 && face.extent_mm[1] > 0))
        return {1, 1};
    return {face.extent_mm[0], face.extent_mm[1]};
}

/// The least number of 12 bits that is not below x > 0: a texture's unit and band are free within that, and so short
/// they compress.
double rounded_up(double x)
{
    int exponent = 0;
    const double mantissa = std::frexp(x, &exponent);
    return std::ldexp(std::ceil(std::ldexp(mantissa, 12)), exponent - 12);
}

/// Signed distances of a face's texels, in the unit of extent_mm, and by how much they may be off.
struct TexelDistances {
    std::vector<float> values; // width * height, or more than `reach` (infinite), positive inside
    double error = 0;
};

TexelDistances distances_to_mask(std::span<const MonotonePiece> pieces, const SampleGrid& grid, double texel_u,
                                 double texel_v, double reach)
{
    const uint oversampling = sdf_oversampling(grid.width, grid.height);
    const double pixel_u = texel_u / oversampling, pixel_v = texel_v / oversampling;
    const TrimMask mask = scan_convert(pieces, pixel_centres(grid.width * oversampling, grid.height * oversampling));
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

TexelDistances distances_to_curves(std::span<const MonotonePiece> pieces, const SampleGrid& grid, double texel_u,
                                   double texel_v, double reach)
{
    constexpr double kMostMoved = 0.2; // texels: what the border's error gains by moving them farther, the band loses
    const std::vector<float> exact = curve_distances(pieces, grid, texel_u, texel_v, reach);
    TexelDistances distances;
    distances.values = fit_to_border(pieces, grid, texel_u, texel_v, exact, kMostMoved * std::max(texel_u, texel_v));
    for (size_t i = 0; i < exact.size(); ++i)
        if (std::isfinite(exact[i]))
            distances.error = std::max(distances.error, std::abs(static_cast<double>(distances.values[i]) - exact[i]));
    distances.error += (kChordDeviation + kDistanceRounding) * reach;
    return distances;
}

/// Rounding of a tracer's look-up, in texels: of a point's place among the texels, two roundings of a number up to the
/// side; then of the interpolation, a few of a distance up to the reach.
double look_up_rounding(const FaceRecord& face)
{
    return 0x1p-23 * ((face.sdf_size & 0xffffu) + (face.sdf_size >> 16) + 8 * kReachTexels);
}

/// The words of a face's texture; sets the length of its texels and its band.
std::vector<uint> make_texture(const PackImage& image, FaceRecord& face)
{
    const auto [length_u, length_v] = metric_of(face);
    const SampleGrid grid = texel_grid(face);
    const double texel_u = length_u * grid.du, texel_v = length_v * grid.dv;
    const double texel = rounded_up(std::max(texel_u, texel_v)), reach = kReachTexels * texel;
    const std::vector<MonotonePiece> pieces = pieces_of(image, face);
    const TexelDistances distances = image.trim_textures.source == TrimSource::Mask
                                         ? distances_to_mask(pieces, grid, texel_u, texel_v, reach)
                                         : distances_to_curves(pieces, grid, texel_u, texel_v, reach);

    // |B - d| <= sqrt(hu^2 + hv^2) / 2 + q / 2 + e
    const double band = 0.5 * std::hypot(texel_u, texel_v) / texel + 0.5 * kSdfTexelQuantum + distances.error / texel +
                        look_up_rounding(face);
    face.sdf_texel_mm = static_cast<float>(texel);
    face.sdf_band_texels = band < kNeverDecides ? static_cast<float>(rounded_up(band)) : kNeverDecides;

    std::vector<uint8_t> levels(distances.values.size());
    const double levels_a_length = 1 / (texel * kSdfTexelQuantum);
    for (size_t i = 0; i < levels.size(); ++i) {
        const double level = std::clamp(128.5 + distances.values[i] * levels_a_length, 0.0, 255.0);
        levels[i] = static_cast<uint8_t>(level);
    }
    return pack_texels(texture_shape(face), levels);
}

// ---- sizes ---------------------------------------------------------------------------------------------------------

struct TextureSize {
    uint width = 0, height = 0, tile_shift = 0;
    double texel = 0; // the longer step between texels, in the unit of the metric
    double bytes = 0; // at most
};

/// The texture of a face whose steps between texels are just below `step` along u and along v.
TextureSize size_at(const std::array<double, 2>& metric, double step, bool centres, uint tile_shift)
{
    const double around = 2 * texel_inset(centres) - 1; // steps of the domain beyond the number of texels
    const auto texels = [&](double length) {
        const double least = std::ceil(length / step - around - 1e-9); // for the rounding of whole numbers of steps
        return static_cast<uint>(std::clamp<double>(least, 1, kMaxTextureSide));
    };
    const uint width = texels(metric[0]), height = texels(metric[1]);
    return {width, height, tile_shift, std::max(metric[0] / (width + around), metric[1] / (height + around)), 0};
}

/// How many tiles the border's surroundings touch: at least as many as the texture will keep, and few more.
uint64_t count_tiles(std::span<const MonotonePiece> pieces, const std::array<double, 2>& metric,
                     const TextureSize& size, bool centres)
{
    const TextureShape shape = texture_shape(size.width, size.height, size.tile_shift);
    const double inset = texel_inset(centres);
    const double scale[2] = {size.width - 1 + 2 * inset, size.height - 1 + 2 * inset};
    const double ratio[2] = {metric[0] / scale[0] / size.texel, metric[1] / scale[1] / size.texel};
    constexpr double kStep = 0.5; // texels between samples of a piece, at most
    const double reach = kReachTexels + 0.5 * kStep;
    const double side = 1u << size.tile_shift;
    std::vector<uint8_t> touched(static_cast<size_t>(shape.tiles_u) * shape.tiles_v, 0);
    uint64_t count = 0;
    const auto touch = [&](double u, double v) {
        const double p[2] = {u * scale[0] - inset, v * scale[1] - inset};
        const uint tiles[2] = {shape.tiles_u, shape.tiles_v};
        uint first[2], last[2];
        for (int axis = 0; axis < 2; ++axis) {
            const double half = reach / ratio[axis];
            first[axis] = static_cast<uint>(std::clamp<double>(std::ceil((p[axis] - half) / side - 1), 0, tiles[axis]));
            last[axis] = static_cast<uint>(std::clamp<double>(std::floor((p[axis] + half) / side) + 1, 0, tiles[axis]));
        }
        for (uint ty = first[1]; ty < last[1]; ++ty)
            for (uint tx = first[0]; tx < last[0]; ++tx) {
                uint8_t& tile = touched[static_cast<size_t>(ty) * shape.tiles_u + tx];
                if (tile != 0)
                    continue;
                const double x = std::max({tx * side - p[0], 0.0, p[0] - (tx + 1) * side}) * ratio[0];
                const double y = std::max({ty * side - p[1], 0.0, p[1] - (ty + 1) * side}) * ratio[1];
                if (x * x + y * y <= reach * reach) {
                    tile = 1;
                    ++count;
                }
            }
    };
    for (const MonotonePiece& piece : pieces) {
        double longest_leg = 0; // a third of a cubic's greatest speed
        for (int i = 0; i < 3; ++i)
            longest_leg = std::max(longest_leg, std::hypot((piece.u[i + 1] - piece.u[i]) * scale[0] * ratio[0],
                                                           (piece.v[i + 1] - piece.v[i]) * scale[1] * ratio[1]));
        const int steps = 1 + static_cast<int>(3 * longest_leg / kStep);
        for (int i = 0; i <= steps; ++i) {
            const double t = static_cast<double>(i) / steps;
            touch(bezier3(piece.u, t), bezier3(piece.v, t));
        }
    }
    return count;
}

/// The finest texture of one form that `bytes` hold, or one of no texels. Source: bisection of the logarithm of a
/// texel's length, from `coarsest`, `halvings` times.
template <class Bytes>
TextureSize finest(const std::array<double, 2>& metric, bool centres, uint tile_shift, double finest_step,
                   double coarsest_step, int halvings, double bytes, Bytes&& bytes_of)
{
    TextureSize best;
    double lo = finest_step, hi = coarsest_step;
    for (int i = 0; i <= halvings; ++i) {
        const double step = i == 0 ? hi : std::sqrt(lo * hi);
        TextureSize size = size_at(metric, step, centres, tile_shift);
        size.bytes = bytes_of(size);
        const bool fits = size.bytes <= bytes;
        if (fits && (best.width == 0 || size.texel < best.texel))
            best = size;
        if (!fits && i == 0)
            return best;
        (fits ? hi : lo) = step;
    }
    return best;
}

/// The isotropic texture of `bytes` for a face: rows, or tiles where these give finer texels.
TextureSize isotropic_size(const PackImage& image, const FaceRecord& face, double bytes)
{
    const bool centres = image.trim_textures.source == TrimSource::Mask;
    const std::array<double, 2> metric = metric_of(face);
    const double coarsest = std::max(metric[0], metric[1]), even = std::sqrt(metric[0] * metric[1] / bytes);
    const auto bytes_of_rows = [](const TextureSize& s) { return 4.0 * texture_shape(s.width, s.height, 0).words(0); };
    TextureSize best = finest(metric, centres, 0, 0.5 * std::min(even, coarsest), coarsest, 30, bytes, bytes_of_rows);
    if (best.width == 0) { // every texture has a word
        best = size_at(metric, coarsest, centres, 0);
        best.bytes = bytes_of_rows(best);
        return best;
    }
    constexpr double kLeastGain = 0.97; // of a texel's length: below it the tiles' entries are not worth a fetch
    const std::vector<MonotonePiece> pieces = pieces_of(image, face);
    for (const uint tile_shift : {2u, 3u}) {
        const auto bytes_of = [&](const TextureSize& size) {
            const TextureShape shape = texture_shape(size.width, size.height, tile_shift);
            const uint64_t tiles = static_cast<uint64_t>(shape.tiles_u) * shape.tiles_v;
            if (tiles > kMaxTiles || 2.0 * tiles > bytes)
                return std::numeric_limits<double>::infinity();
            return 4.0 * shape.words(count_tiles(pieces, metric, size, centres));
        };
        const TextureSize tiled =
            finest(metric, centres, tile_shift, best.texel / 16, kLeastGain * best.texel, 10, bytes, bytes_of);
        if (tiled.width != 0 && tiled.texel < best.texel)
            best = tiled;
    }
    return best;
}

/// M_i = ceil(M_total A_i / sum A), H_i = floor(sqrt(M_i))
TextureSize square_size(double bytes)
{
    const double side = std::min<double>(kMaxTextureSide, std::floor(std::sqrt(std::ceil(bytes))));
    return {static_cast<uint>(side), static_cast<uint>(side), 0, 0, 0};
}

void set_size(FaceRecord& face, const TextureSize& size)
{
    face.sdf_size = size.width | size.height << 16;
    face.flags = (face.flags & ~(kFaceTileShiftMask << kFaceTileShiftBit)) | size.tile_shift << kFaceTileShiftBit;
}

/// Gives what the faces' shares of `total_bytes` left, in equal parts, to the faces for which that is much. A share is
/// left in part where sides are whole texels, where a straight border costs a row of tiles more than fits, and where a
/// texture's tiles have no more numbers. Shapes: bytes by face, as their textures are; 0 for faces without trims.
void spread_unspent(PackImage& image, double total_bytes, const std::vector<double>& bytes)
{
    constexpr double kMuch = 0.1; // of a texture's bytes
    const double unspent = total_bytes - std::accumulate(bytes.begin(), bytes.end(), 0.0);
    const auto faces_below = [&](double most) {
        return static_cast<double>(
            std::count_if(bytes.begin(), bytes.end(), [&](double b) { return b > 0 && b < most; }));
    };
    const double most = unspent / std::max(faces_below(std::numeric_limits<double>::infinity()), 1.0) / kMuch;
    const double each = unspent / std::max(faces_below(most), 1.0);
    tbb::parallel_for(size_t{0}, bytes.size(), [&](size_t f) {
        if (bytes[f] > 0 && bytes[f] < most)
            set_size(image.faces[f], isotropic_size(image, image.faces[f], bytes[f] + each));
    });
}

} // namespace

void derive_sdf(PackImage& image, const std::function<bool()>& cancelled)
{
    for (FaceRecord& face : image.faces) {
        if (!has_texture(face))
            face.sdf_size = 0;
        const bool centres = face.sdf_size != 0 && image.trim_textures.source == TrimSource::Mask;
        face.flags = (face.flags & ~kFaceTexelCentres) | (centres ? kFaceTexelCentres : 0);
        face.sdf_first_word = 0;
        face.sdf_texel_mm = 0;
        face.sdf_band_texels = 0;
    }
    const std::vector<uint> alike = first_alike(image);
    std::vector<std::vector<uint>> textures(image.faces.size());
    tbb::parallel_for(size_t{0}, image.faces.size(), [&](size_t f) {
        if (has_texture(image.faces[f]) && alike[f] == f && !(cancelled && cancelled()))
            textures[f] = make_texture(image, image.faces[f]);
    });
    image.sdf_words.clear();
    for (size_t f = 0; f < image.faces.size(); ++f) {
        FaceRecord& face = image.faces[f];
        if (!has_texture(face))
            continue;
        const FaceRecord& filled = image.faces[alike[f]];
        const std::vector<uint>& words = textures[alike[f]];
        face.sdf_texel_mm = filled.sdf_texel_mm;
        face.sdf_band_texels = filled.sdf_band_texels;
        face.sdf_first_word = static_cast<uint>(image.sdf_words.size());
        image.sdf_words.insert(image.sdf_words.end(), words.begin(), words.end());
    }
}

void allocate_trim_memory(PackImage& image, double total_bytes, const TrimTextureOptions& options)
{
    image.trim_textures = options;
    double total_area = 0;
    double faces = 0;
    for (FaceRecord& face : image.faces) {
        face.sdf_size = 0;
        face.flags &= ~(kFaceTileShiftMask << kFaceTileShiftBit);
        if (face.piece_count == 0)
            continue;
        total_area += face.area_mm2;
        faces += 1;
    }
    if (!(total_bytes > 0) || !(total_area > 0))
        return;

    const double floor_bytes = std::min(kFloorBytes, 0.5 * total_bytes / faces);
    const double shared_bytes = total_bytes - floor_bytes * faces;
    std::vector<double> bytes(image.faces.size(), 0);
    tbb::parallel_for(size_t{0}, image.faces.size(), [&](size_t f) {
        FaceRecord& face = image.faces[f];
        if (face.piece_count == 0)
            return;
        const double share = face.area_mm2 / total_area;
        const TextureSize size = options.layout == TrimLayout::Square
                                     ? square_size(total_bytes * share)
                                     : isotropic_size(image, face, floor_bytes + shared_bytes * share);
        set_size(face, size);
        bytes[f] = size.bytes;
    });
    if (options.layout == TrimLayout::Isotropic)
        spread_unspent(image, total_bytes, bytes);
}

} // namespace trimray
