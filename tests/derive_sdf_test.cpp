// Distance textures: mask, transform and bytes against the slow, obvious forms; the band's bound; memory to the byte.
#include "format/derive.h"
#include "format/distance_field.h"
#include "format/trim_texture.h"
#include "tests/trim_shapes.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

namespace trimray {
namespace {

using namespace shapes;

const std::vector<Uv> kSquare = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};

std::vector<std::vector<Loop>> shapes_for_masks()
{
    return {
        {polygon(kSquare), circle(0.5, 0.5, 0.3, 0.3)},
        {star(0.5, 0.5, 0.5, 0.15, 7)},
        {gear(0.5, 0.5, 0.5, 0.4, 12), circle(0.5, 0.5, 0.2, 0.1)},
        {polygon({{0, 0}, {1, 1}, {1, 0}, {0, 1}})},
        {polygon({{0.25f, 0.25f}, {0.75f, 0.25f}, {0.75f, 0.75f}, {0.25f, 0.75f}}), polygon(kSquare)},
    };
}

TEST(derive_sdf, masks_equal_an_exact_crossing_count)
{
    PackImage image;
    for (const auto& loops : shapes_for_masks())
        add_face(image, loops);
    std::mt19937 rng(4);
    for (int i = 0; i < 10; ++i)
        add_face(image, {random_loop(rng, 25)});
    for (uint f = 0; f < image.faces.size(); ++f) {
        const std::vector<MonotonePiece> pieces = pieces_of(image, f);
        const TrimMask mask = scan_convert(pieces, pixel_centres(96, 64));
        for (uint y = 0; y < mask.height; ++y)
            for (uint x = 0; x < mask.width; ++x) {
                const double u = (x + 0.5) / mask.width, v = (y + 0.5) / mask.height;
                const bool inside = mask.inside[y * mask.width + x] != 0;
                if (inside != exact_inside(pieces, u, v)) {
                    ASSERT_LT(exact_distance(pieces, u, v), 1e-12) << "face " << f << " at " << x << ", " << y;
                }
            }
    }
}

TEST(derive_sdf, the_transform_equals_brute_force)
{
    std::mt19937 rng(8);
    for (const uint oversampling : {1u, 3u, 5u}) {
        for (const int density : {2, 10, 100, 1000000}) {
            TrimMask mask{9 * oversampling, 7 * oversampling, {}};
            for (uint i = 0; i < mask.width * mask.height; ++i)
                mask.inside.push_back(rng() % static_cast<uint>(density) == 0 ? 1 : 0);
            const double pixel_u = 0.7, pixel_v = 1.9;
            const std::vector<float> distances = signed_distances(mask, oversampling, pixel_u, pixel_v);
            const int width = static_cast<int>(mask.width), height = static_cast<int>(mask.height);
            for (int r = 0; r < 7; ++r)
                for (int c = 0; c < 9; ++c) {
                    const int x0 = c * static_cast<int>(oversampling) + static_cast<int>(oversampling) / 2;
                    const int y0 = r * static_cast<int>(oversampling) + static_cast<int>(oversampling) / 2;
                    const auto at = [&](int x, int y) {
                        return x >= 0 && y >= 0 && x < width && y < height &&
                               mask.inside[static_cast<size_t>(y * width + x)] != 0;
                    };
                    double best = std::numeric_limits<double>::infinity();
                    for (int y = -1; y <= height; ++y)
                        for (int x = -1; x <= width; ++x)
                            if (at(x, y) != at(x0, y0))
                                best = std::min(best, std::hypot((x - x0) * pixel_u, (y - y0) * pixel_v));
                    const float expected = static_cast<float>(at(x0, y0) ? best : -best);
                    const float actual = distances[static_cast<size_t>(r * 9 + c)];
                    if (std::isinf(expected))
                        ASSERT_EQ(actual, expected);
                    else
                        ASSERT_NEAR(actual, expected, 1e-5) << "texel " << c << ", " << r;
                }
        }
    }
}

/// |B - d| <= band wherever neither is clamped, and where |B| > band the sign is right.
void expect_band(const PackImage& image, uint f, double extent_u, double extent_v, uint seed)
{
    const FaceRecord& face = image.faces[f];
    const std::vector<MonotonePiece> pieces = pieces_of(image, f);
    std::mt19937 rng(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int i = 0; i < 4000; ++i) {
        const double u = uniform(rng), v = uniform(rng);
        const double b = texture_distance(image, face, u, v);
        const bool inside = exact_inside(pieces, u, v);
        if (std::abs(b) > face.sdf_band_texels) {
            ASSERT_EQ(b >= 0, inside) << "face " << f << " at " << u << ", " << v << ": " << b;
        }
        const double d = exact_distance(pieces, u, v, extent_u, extent_v) / face.sdf_texel_mm * (inside ? 1 : -1);
        if (std::abs(d) < 2.5) { // samples around are not clamped
            ASSERT_LE(std::abs(b - d), face.sdf_band_texels) << "face " << f << " at " << u << ", " << v;
        }
    }
}

TEST(derive_sdf, outside_its_band_the_texture_is_right)
{
    for (const TrimSource source : {TrimSource::Curve, TrimSource::Mask}) {
        PackImage image;
        image.trim_textures.source = source;
        std::vector<std::array<double, 2>> extents;
        for (const auto& loops : shapes_for_masks())
            for (const double extent_v : {10.0, 3.0}) {
                add_face(image, loops, 10, static_cast<float>(extent_v));
                image.faces.back().sdf_size = 40u | (extent_v == 3 ? 12u : 40u) << 16;
                extents.push_back({10, extent_v});
            }
        derive_sdf(image);
        for (uint f = 0; f < image.faces.size(); ++f) {
            EXPECT_LT(image.faces[f].sdf_band_texels, 1.5f) << "face " << f; // the tips of the star press it up
            expect_band(image, f, extents[f][0], extents[f][1], 50 + f);
        }
    }
}

TEST(derive_sdf, slivers_below_the_masks_pixels_widen_the_band_until_nothing_is_wrong)
{
    PackImage image;
    image.trim_textures.source = TrimSource::Mask;
    for (const double radius : {0.1, 0.025, 0.01, 0.003, 0.001, 0.0003, 0.0001}) {
        add_face(image, {polygon(kSquare), circle(0.503, 0.511, radius, radius)});
        image.faces.back().sdf_size = 40u | 40u << 16;
    }
    add_face(image, {polygon(kSquare), polygon({{0.1f, 0.3f}, {0.9f, 0.31f}, {0.9f, 0.3101f}})});
    image.faces.back().sdf_size = 40u | 40u << 16;
    derive_sdf(image);
    for (uint f = 0; f < image.faces.size(); ++f)
        expect_band(image, f, 1, 1, 10 + f);
    EXPECT_LT(image.faces[0].sdf_band_texels, 1);
    EXPECT_GT(image.faces[6].sdf_band_texels, 4); // a circle of 0.004 texels: the texture never decides
}

TEST(derive_sdf, square_layout_follows_equations_4_and_5_to_the_byte)
{
    PackImage image;
    const double areas[4] = {1.0, 10.0, 0.37, 250.0};
    for (const double area : areas) {
        add_face(image, {circle(0.5, 0.5, 0.5, 0.5)});
        image.faces.back().area_mm2 = static_cast<float>(area);
    }
    add_face(image, {});
    image.faces.back().area_mm2 = 1000; // a natural border takes no part
    const double total = 10000;
    double sum = 0;
    for (int i = 0; i < 4; ++i)
        sum += image.faces[static_cast<size_t>(i)].area_mm2;
    allocate_trim_memory(image, total, {TrimSource::Mask, TrimLayout::Square});
    for (size_t i = 0; i < 4; ++i) {
        const double bytes = std::ceil(total * image.faces[i].area_mm2 / sum);
        const uint side = static_cast<uint>(std::floor(std::sqrt(bytes)));
        EXPECT_EQ(image.faces[i].sdf_size, side | side << 16);
    }
    EXPECT_EQ(image.faces[4].sdf_size, 0u);
    derive_sdf(image);
    size_t words = 0;
    for (const FaceRecord& face : image.faces) {
        EXPECT_TRUE(face.sdf_size == 0 || face.sdf_first_word == words);
        words += texture_shape(face).words(0); // the last is padded
    }
    EXPECT_EQ(image.sdf_words.size(), words);
}

TEST(derive_sdf, isotropic_layout_keeps_to_the_total_and_spares_small_faces)
{
    PackImage image;
    const float extents[5][2] = {{100, 100}, {1, 1}, {300, 2}, {0.1f, 0.1f}, {50, 20}};
    for (const auto& e : extents)
        add_face(image, {circle(0.5, 0.5, 0.5, 0.5)}, e[0], e[1]);
    double area = 0;
    for (const FaceRecord& face : image.faces)
        area += face.area_mm2;
    for (const TrimSource source : {TrimSource::Curve, TrimSource::Mask})
        for (const double total : {500.0, 5000.0, 100000.0}) {
            allocate_trim_memory(image, total, {source, TrimLayout::Isotropic});
            derive_sdf(image);
            EXPECT_LE(4.0 * static_cast<double>(image.sdf_words.size()), total);
            // what faces leave of their shares goes to those that can use it
            EXPECT_GE(4.0 * static_cast<double>(image.sdf_words.size()), (total < 1000 ? 0.8 : 0.9) * total);
            const double floor_bytes = std::min(64.0, 0.1 * total);
            for (uint f = 0; f < 5; ++f) {
                const FaceRecord& face = image.faces[f];
                const size_t end = f + 1 < 5 ? image.faces[f + 1].sdf_first_word : image.sdf_words.size();
                const double bytes = 4.0 * static_cast<double>(end - face.sdf_first_word);
                // M_i = ceil(M_total A_i / sum A), after what each face gets
                EXPECT_GE(bytes, 0.6 * std::ceil(floor_bytes + (total - 5 * floor_bytes) * face.area_mm2 / area));
                const uint width = face.sdf_size & 0xffffu, height = face.sdf_size >> 16;
                if (width >= 8 && height >= 8) {
                    EXPECT_NEAR((face.extent_mm[0] / width) / (face.extent_mm[1] / height), 1, 0.15);
                }
            }
        }
    allocate_trim_memory(image, 0, {});
    derive_sdf(image);
    EXPECT_TRUE(image.sdf_words.empty());
    for (const FaceRecord& face : image.faces)
        EXPECT_EQ(face.sdf_size, 0u);
}

TEST(derive_sdf, tiles_give_every_texel_back_and_keep_those_near_a_border_only)
{
    for (const uint tile_shift : {0u, 1u, 2u, 3u, 4u})
        for (const auto& [width, height] : {std::pair{1u, 1u}, {2u, 2u}, {3u, 17u}, {90u, 70u}, {65u, 64u}}) {
            std::vector<uint8_t> levels;
            for (uint y = 0; y < height; ++y)
                for (uint x = 0; x < width; ++x)
                    levels.push_back(
                        static_cast<uint8_t>(std::clamp(128 + 64 * (20 - std::hypot(x - 30.0, y - 30.0)), 0.0, 255.0)));
            const TextureShape shape = texture_shape(width, height, tile_shift);
            const std::vector<uint> words = pack_texels(shape, levels);
            for (uint y = 0; y < height; ++y)
                for (uint x = 0; x < width; ++x)
                    ASSERT_EQ(texel_level(shape, words.data(), x, y), levels[y * width + x])
                        << width << " x " << height << ", tile shift " << tile_shift << ": " << x << ", " << y;
            if (tile_shift > 0 && width == 90) {
                EXPECT_LT(words.size(), 0.6 * static_cast<double>(shape.words_at_most()));
            }
        }
}

TEST(derive_sdf, bytes_do_not_depend_on_the_number_of_threads)
{
    PackImage one;
    for (int i = 0; i < 8; ++i)
        for (const auto& loops : shapes_for_masks())
            add_face(one, loops, 3, 2);
    allocate_trim_memory(one, 20000, {});
    PackImage two = one;
    {
        const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
        derive_sdf(one);
    }
    derive_sdf(two);
    EXPECT_EQ(one.sdf_words, two.sdf_words);
}

} // namespace
} // namespace trimray
