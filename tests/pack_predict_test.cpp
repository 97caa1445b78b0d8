// Filter 2: sections as differences from their prediction.
#include "format/derive.h"
#include "format/pack_predict.h"
#include "format/trim_texture.h"
#include "tests/random_pack.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace trimray::test {
namespace {

/// A pack with nets, trees, trim points on their grid, and three textures of smooth texels.
PackImage predictable_pack()
{
    PackImage image = random_pack(5, 3, 12);
    derive_leaves(image, LeafOptions{});
    derive_trees(image);
    for (int i = 0; i < 200; ++i)
        image.trim_points.push_back(std::ldexp(std::nearbyint(std::ldexp(0.5 + 0.4 * std::sin(0.1 * i), 22)), -22));
    // two faces with a loop of lines and cubics each, of three edge classes
    image.trim_pieces.clear();
    for (uint f = 0; f < 2; ++f) {
        image.faces[f].first_piece = uint(image.trim_pieces.size());
        image.faces[f].piece_count = 30;
        uint point = 0;
        for (uint i = 0; i < 30; ++i) {
            const uint cubic = i % 10 < 6 ? kPieceCubic : 0;
            image.trim_pieces.push_back(point << kPiecePointShift | i / 10 << kPieceClassShift | cubic);
            point += cubic != 0 ? 3 : 1;
        }
    }
    for (uint f = 0; f < 3; ++f) { // rows, and tiles of two sizes; some are constant
        const TextureShape shape = texture_shape(21 + f, 16, f == 0 ? 0 : f + 1);
        std::vector<uint8_t> levels;
        for (uint y = 0; y < shape.height; ++y)
            for (uint x = 0; x < shape.width; ++x)
                levels.push_back(static_cast<uint8_t>(std::clamp(300.0 - 30 * std::hypot(x + 0.5, y), 0.0, 255.0)));
        image.faces[f].sdf_size = shape.width | shape.height << 16;
        image.faces[f].flags |= shape.tile_shift << kFaceTileShiftBit;
        image.faces[f].sdf_first_word = uint(image.sdf_words.size());
        const std::vector<uint> words = pack_texels(shape, levels);
        EXPECT_LT(words.size(), shape.words_at_most() + (f == 0)) << "no tile is constant";
        image.sdf_words.insert(image.sdf_words.end(), words.begin(), words.end());
    }
    return image;
}

template <class F>
void for_each_predicted(const PackImage& image, F&& f)
{
    f("CTRL", std::as_bytes(std::span(image.control_points)));
    f("TPNT", std::as_bytes(std::span(image.trim_points)));
    f("TPCE", std::as_bytes(std::span(image.trim_pieces)));
    f("NODE", std::as_bytes(std::span(image.part_nodes)));
    f("SDFW", std::as_bytes(std::span(image.sdf_words)));
}

TEST(pack_predict, what_the_converter_makes_comes_back_and_is_small)
{
    const PackImage image = predictable_pack();
    for_each_predicted(image, [&](std::string_view id, std::span<const std::byte> records) {
        ASSERT_FALSE(records.empty()) << id;
        ASSERT_TRUE(has_prediction(id));
        std::vector<std::byte> coded = predict_records(id, image, records);
        ASSERT_EQ(coded.size(), records.size()) << id << ": not on its grid, or a tree in another order";
        const auto zeros = [](auto& bytes) { return std::count(bytes.begin(), bytes.end(), std::byte{0}); };
        EXPECT_GT(zeros(coded), zeros(records)) << id;
        restore_records(id, image, coded);
        EXPECT_TRUE(std::equal(coded.begin(), coded.end(), records.begin(), records.end())) << id;
    });
}

TEST(pack_predict, origins_of_all_nodes_but_roots_are_expected)
{
    const PackImage image = predictable_pack();
    const std::vector<std::byte> coded = predict_records("NODE", image, std::as_bytes(std::span(image.part_nodes)));
    size_t unexpected = 0;
    for (size_t n = 0; n < image.part_nodes.size(); ++n)
        unexpected += std::any_of(&coded[64 * n], &coded[64 * n] + 12, [](std::byte b) { return b != std::byte{0}; });
    EXPECT_LE(unexpected, image.parts.size());
    EXPECT_GT(image.part_nodes.size(), 3 * image.parts.size());
}

TEST(pack_predict, numbers_off_the_grid_and_trees_in_another_order_are_left_to_filter_1)
{
    PackImage image = predictable_pack();
    for (const float x : {1e-9f, -0.0f, 1e30f, NAN}) {
        std::vector<float> points = image.trim_points;
        points[7] = x;
        EXPECT_TRUE(predict_records("TPNT", image, std::as_bytes(std::span(points))).empty()) << x;
    }
    image.control_points[0] = 1e-12f;
    EXPECT_TRUE(predict_records("CTRL", image, std::as_bytes(std::span(image.control_points))).empty());
    std::swap(image.part_nodes[0].child[0], image.part_nodes[0].child[1]);
    EXPECT_TRUE(predict_records("NODE", image, std::as_bytes(std::span(image.part_nodes))).empty());
}

TEST(pack_predict, any_bytes_restore_to_the_same_records_every_time)
{
    PackImage image = predictable_pack();
    std::mt19937 random(3);
    for (int repeat = 0; repeat < 200; ++repeat) {
        // patches and faces that point anywhere, as in a file before it is validated
        PatchRecord& patch = image.patches[random() % image.patches.size()];
        patch.first_control_point = repeat % 2 == 0 ? random() : random() % 500;
        patch.shape = kKindBezier | (random() & 0x01020300u);
        FaceRecord& face = image.faces[random() % image.faces.size()];
        face.sdf_size = repeat % 2 == 0 ? random() : random() & 0x00070007u;
        face.sdf_first_word = random() % 30;
        face.first_piece = repeat % 2 == 0 ? random() : random() % 60;
        face.flags = random();
        for_each_predicted(image, [&](std::string_view id, std::span<const std::byte> records) {
            std::vector<std::byte> bytes(records.size());
            for (std::byte& b : bytes)
                b = std::byte(random() % 3 == 0 ? random() : random() % 3);
            std::vector<std::byte> again = bytes;
            restore_records(id, image, bytes);
            restore_records(id, image, again);
            EXPECT_EQ(bytes, again) << id;
        });
    }
}

} // namespace
} // namespace trimray::test
