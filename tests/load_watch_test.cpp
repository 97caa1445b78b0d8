// Loads that are watched: given up, and telling of what a first picture is drawn from. What is told is safe to use,
// whatever the bytes.
#include "format/affine.h"
#include "format/pack_file.h"
#include "format/pack_writer.h"
#include "proxied_pack.h"
#include "runtime/arrangement.h"
#include "runtime/command_trace.h"
#include "runtime/view/proxy_view.h"
#include "runtime/watched_load.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <random>
#include <string>

namespace trimray {
namespace {

using Bytes = std::vector<std::byte>;

PackImage compact_image()
{
    PackImage image = image_with_proxy();
    image.compact = true;
    for_each_array(image, [](std::string_view, bool is_derived, auto& array) {
        if (is_derived)
            array.clear();
    });
    for (PartRecord& part : image.parts)
        part.first_leaf = part.leaf_count = part.first_node = part.node_count = 0;
    for (FaceRecord& face : image.faces)
        face.grid = face.first_cell = face.first_entry = face.entry_count = face.sdf_first_word = 0;
    return image;
}

ReadOptions without_extras()
{
    ReadOptions options;
    options.previews_and_proxy = false;
    return options;
}

template <class T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b)
{
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

TEST(load_watch, the_outline_is_the_whole_packs)
{
    const Bytes bytes = encode_pack(image_with_proxy(), WriteOptions{12});
    const Result<LoadedPack> whole = decode_pack(bytes, ReadOptions{});
    ASSERT_TRUE(whole.ok()) << whole.error().detail;
    int told = 0;
    PackImage outline;
    LoadWatch watch;
    watch.on_outline = [&](PackImage image) {
        ++told;
        outline = std::move(image);
    };
    const Result<LoadedPack> watched = decode_pack(bytes, without_extras(), watch);
    const Result<LoadedPack> plain = decode_pack(bytes, without_extras());
    ASSERT_TRUE(watched.ok() && plain.ok());
    EXPECT_EQ(told, 1);
    const PackImage& m = whole->image;
    EXPECT_TRUE(same_bytes(outline.parts, m.parts) && same_bytes(outline.instances, m.instances) &&
                same_bytes(outline.tree, m.tree) && same_bytes(outline.faces, m.faces) &&
                same_bytes(outline.patches, m.patches) && same_bytes(outline.leaves, m.leaves) &&
                same_bytes(outline.part_nodes, m.part_nodes) && same_bytes(outline.top_nodes, m.top_nodes));
    EXPECT_EQ(outline.strings.strings, m.strings.strings);
    EXPECT_TRUE(std::equal(outline.bounds_hi_mm, outline.bounds_hi_mm + 3, m.bounds_hi_mm));
    EXPECT_TRUE(outline.control_points.empty() && outline.trim_points.empty() && outline.sdf_words.empty() &&
                outline.preview_256_png.empty());
    const Result<ProxyMesh> early = decode_proxy(outline.proxy_draco, outline.faces.size());
    const Result<ProxyMesh> late = decode_proxy(m.proxy_draco, m.faces.size());
    ASSERT_TRUE(early.ok() && late.ok());
    EXPECT_EQ(early->triangles.size(), 12u);
    EXPECT_EQ(early->positions, late->positions);
    EXPECT_EQ(early->triangles, late->triangles);
    EXPECT_EQ(early->triangle_face, late->triangle_face);
    EXPECT_EQ(encode_pack(watched->image, WriteOptions{0}), encode_pack(plain->image, WriteOptions{0}));
}

TEST(load_watch, nothing_is_told_of_a_pack_without_proxy_or_trees)
{
    PackImage bare = synthetic_image();
    bare.proxy_draco.clear();
    for (const PackImage& image : {bare, compact_image()}) {
        LoadWatch watch;
        watch.on_outline = [](const PackImage&) { ADD_FAILURE() << "there is nothing to draw"; };
        const Result<LoadedPack> pack = decode_pack(encode_pack(image, WriteOptions{3}), without_extras(), watch);
        EXPECT_TRUE(pack.ok()) << pack.error().where << pack.error().detail;
    }
}

TEST(load_watch, a_load_ends_wherever_it_is_given_up)
{
    for (const PackImage& image : {image_with_proxy(), compact_image()}) {
        const Bytes bytes = encode_pack(image, WriteOptions{12});
        int given_up = 0;
        for (int after = 0;; ++after) {
            std::atomic<int> looks = 0;
            LoadWatch watch;
            watch.cancelled = [&] { return looks++ >= after; };
            watch.on_outline = [&](const PackImage&) { EXPECT_LE(looks, after) << "told, though given up"; };
            const Result<LoadedPack> pack = decode_pack(bytes, ReadOptions{}, watch);
            if (looks <= after) {
                EXPECT_TRUE(pack.ok());
                break;
            }
            ++given_up;
            ASSERT_FALSE(pack.ok()) << after;
            EXPECT_EQ(pack.error().code, ErrorCode::Interrupted) << pack.error().detail;
        }
        EXPECT_GT(given_up, 30); // once a section at least
    }
}

TEST(load_watch, a_scene_is_given_up_too)
{
    const std::string file = testing::TempDir() + "given_up.tray";
    ASSERT_TRUE(write_file_atomically(file, encode_pack(image_with_proxy(), WriteOptions{3})).ok());
    const auto loaded = load_scene(file, LoadWatch{[] { return true; }, {}});
    ASSERT_FALSE(loaded.ok());
    EXPECT_EQ(loaded.error().code, ErrorCode::Interrupted);
    EXPECT_TRUE(load_scene(file, LoadWatch{[] { return false; }, {}}).ok());
}

// ---- hostile bytes -------------------------------------------------------------------------------------------------

/// Uses an outline as the viewer does. Every index has to be in its range, every number finite.
void use(const PackImage& m)
{
    for (const InstanceRecord& instance : m.instances) {
        ASSERT_LT(instance.part, m.parts.size());
        ASSERT_FALSE(is_singular(instance.transform));
    }
    for (const FaceRecord& face : m.faces)
        ASSERT_LT(face.part, m.parts.size());
    for (const PartRecord& part : m.parts) {
        ASSERT_LE(size_t{part.first_leaf} + part.leaf_count, m.leaves.size());
        ASSERT_LE(size_t{part.first_node} + part.node_count, m.part_nodes.size());
    }
    for (const LeafRecord& leaf : m.leaves)
        ASSERT_LT(leaf.patch, m.patches.size());
    const PlacementView placed(m);
    const Result<Camera> camera = camera_of(SceneCamera{}, placed, model_reach(m, placed), 640, 480);
    ASSERT_TRUE(camera.ok());
    for (const double x : camera->eye)
        ASSERT_TRUE(std::isfinite(x));
    (void)proxy_projection(*camera, placed, {640, 480});
    for (uint32_t i = 0; i < m.instances.size(); ++i)
        for (const auto& row : proxy_placement(*camera, placed, i))
            for (const float x : row)
                ASSERT_TRUE(std::isfinite(x));
    Arrangement apart;
    apart.explode = 1;
    KeptArrangement arrangement;
    ASSERT_TRUE(arrangement.change_to(m, apart).ok());
    const Result<ProxyMesh> mesh = decode_proxy(m.proxy_draco, m.faces.size());
    if (!mesh.ok())
        return;
    for (const uint vertex : mesh->triangles)
        ASSERT_LT(3 * size_t{vertex} + 2, mesh->positions.size());
    for (const uint face : mesh->triangle_face)
        ASSERT_LT(face, m.faces.size());
}

struct Counts {
    int told = 0, refused = 0;
};

void read_hostile(const Bytes& bytes, Counts& counts)
{
    LoadWatch watch;
    watch.on_outline = [&](const PackImage& outline) {
        ++counts.told;
        use(outline);
    };
    if (!decode_pack(bytes, without_extras(), watch).ok())
        ++counts.refused;
}

TEST(load_watch, damaged_files_tell_nothing_that_is_wrong)
{
    const Bytes good = encode_pack(image_with_proxy(), WriteOptions{3});
    std::mt19937 random(5);
    Counts counts;
    for (int round = 0; round < 2000 && !testing::Test::HasFatalFailure(); ++round) {
        Bytes bytes = good;
        bytes[random() % bytes.size()] = static_cast<std::byte>(random());
        if (random() % 4 == 0)
            bytes.resize(random() % bytes.size());
        read_hostile(bytes, counts);
    }
    EXPECT_GT(counts.refused, 1900);
    EXPECT_GT(counts.told, 100) << "what lies behind the outline alone is damaged";
}

/// Another number in place of one: any bits, or a small step, which finds the checks' edges.
void change_word(std::byte* word, std::mt19937& random)
{
    uint32_t bits;
    std::memcpy(&bits, word, sizeof bits);
    switch (random() % 4) {
    case 0:
        bits = static_cast<uint32_t>(random());
        break;
    case 1:
        bits += random() % 2 == 0 ? 1 : 0xffffffffu;
        break;
    case 2:
        bits ^= 1u << random() % 32;
        break;
    default:
        bits = 0x7fc00000u; // NaN
    }
    std::memcpy(word, &bits, sizeof bits);
}

TEST(load_watch, forged_numbers_with_right_checksums_tell_nothing_that_is_wrong)
{
    std::mt19937 random(7);
    Counts counts;
    for (int round = 0; round < 4000 && !testing::Test::HasFatalFailure(); ++round) {
        PackImage image = image_with_proxy();
        std::vector<std::byte*> words;
        for_each_array(image, [&](std::string_view, bool, auto& array) {
            auto* const first = reinterpret_cast<std::byte*>(array.data());
            for (size_t at = 0; at + 4 <= array.size() * sizeof(array[0]); at += 4)
                words.push_back(first + at);
        });
        for (double* const numbers : {image.bounds_lo_mm, image.bounds_hi_mm, &image.world_scale_mm})
            words.push_back(reinterpret_cast<std::byte*>(numbers) + 4);
        change_word(words[random() % words.size()], random);
        if (random() % 4 == 0)
            image.proxy_draco[random() % image.proxy_draco.size()] = static_cast<std::byte>(random());
        read_hostile(encode_pack(image, WriteOptions{0}), counts);
    }
    EXPECT_GT(counts.refused, 500);
    EXPECT_GT(counts.told, 500);
}

} // namespace
} // namespace trimray
