// Files of triangle meshes: what was written comes back, and nothing damaged is read.
#include "format/mesh_file.h"
#include "format/pack_file.h"
#include "format/pack_writer.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <functional>
#include <limits>
#include <unistd.h>

namespace trimray {
namespace {

/// Two parts of a triangle each, the second placed twice, once mirrored.
TriangleMesh small_mesh()
{
    TriangleMesh mesh;
    mesh.deflection_mm = 0.125;
    mesh.parts = {{{1, 2, 3}, 0, 1}, {{0, 0, 0}, 1, 1}};
    mesh.instances = {{{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, 0, 0},
                      {{1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0}, 1, 0xff0000ffu},
                      {{-1, 0, 0, 9, 0, 1, 0, 0, 0, 0, 1, 0}, 1, 0}};
    mesh.faces = {{0xff00ff00u, 1}, {0, 0}};
    mesh.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 2, 0, 1, 0, 2, 1};
    mesh.normals = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0.6f, 0, 0.8f, 0, 0, 1, 0, 0.6f, 0.8f};
    mesh.triangles = {0, 1, 2, 3, 4, 5};
    mesh.triangle_face = {0, 1};
    return mesh;
}

TEST(mesh_file, holds_all_of_a_mesh)
{
    const TriangleMesh mesh = small_mesh();
    const std::vector<std::byte> bytes = encode_mesh(mesh);
    const Result<TriangleMesh> read = decode_mesh(bytes);
    ASSERT_TRUE(read.ok()) << read.error().detail;
    EXPECT_EQ(read->deflection_mm, 0.125);
    EXPECT_EQ(read->positions, mesh.positions);
    EXPECT_EQ(read->normals, mesh.normals);
    EXPECT_EQ(read->triangles, mesh.triangles);
    EXPECT_EQ(read->triangle_face, mesh.triangle_face);
    ASSERT_EQ(read->parts.size(), 2u);
    EXPECT_EQ(read->parts[0].origin_mm[2], 3);
    EXPECT_EQ(read->parts[1].first_triangle, 1u);
    ASSERT_EQ(read->instances.size(), 3u);
    EXPECT_EQ(read->instances[1].color_rgba, 0xff0000ffu);
    EXPECT_EQ(read->instances[2].transform[3], 9);
    ASSERT_EQ(read->faces.size(), 2u);
    EXPECT_EQ(read->faces[0].color_rgba, 0xff00ff00u);
    EXPECT_EQ(encode_mesh(*read), bytes);
}

TEST(mesh_file, holds_an_empty_mesh)
{
    const Result<TriangleMesh> read = decode_mesh(encode_mesh({}));
    ASSERT_TRUE(read.ok()) << read.error().detail;
    EXPECT_TRUE(read->triangles.empty());
}

TEST(mesh_file, is_read_from_a_file_and_names_it_in_errors)
{
    const std::string path =
        (std::filesystem::temp_directory_path() / ("trimray_mesh_" + std::to_string(getpid()) + ".trimesh")).string();
    ASSERT_TRUE(write_file_atomically(path, encode_mesh(small_mesh())).ok());
    EXPECT_TRUE(read_mesh(path).ok());
    ASSERT_TRUE(write_file_atomically(path, {}).ok());
    const Result<TriangleMesh> empty = read_mesh(path);
    ASSERT_FALSE(empty.ok());
    EXPECT_EQ(empty.error().code, ErrorCode::InvalidMesh);
    EXPECT_EQ(empty.error().where, path);
    std::filesystem::remove(path);
    EXPECT_EQ(read_mesh(path).error().code, ErrorCode::FileNotFound);
}

TEST(mesh_file, refuses_every_truncation_and_every_longer_file)
{
    std::vector<std::byte> bytes = encode_mesh(small_mesh());
    for (size_t size = 0; size < bytes.size(); ++size)
        EXPECT_FALSE(decode_mesh(std::span(bytes).first(size)).ok()) << size;
    bytes.push_back(std::byte{0});
    EXPECT_FALSE(decode_mesh(bytes).ok());
}

TEST(mesh_file, refuses_every_changed_byte)
{
    std::vector<std::byte> bytes = encode_mesh(small_mesh());
    for (size_t i = 0; i < bytes.size(); ++i)
        for (const std::byte change : {std::byte{1}, std::byte{0x80}, std::byte{0xff}}) {
            bytes[i] ^= change;
            EXPECT_FALSE(decode_mesh(bytes).ok()) << i;
            bytes[i] ^= change;
        }
}

/// What is said of a mesh whose checksum fits, but which cannot be traced.
std::string refusal(const std::function<void(TriangleMesh&)>& damage)
{
    TriangleMesh mesh = small_mesh();
    damage(mesh);
    const Result<TriangleMesh> read = decode_mesh(encode_mesh(mesh));
    if (read.ok())
        return "";
    EXPECT_EQ(read.error().code, ErrorCode::InvalidMesh);
    return read.error().detail;
}

TEST(mesh_file, refuses_what_cannot_be_traced)
{
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    constexpr float kInf = std::numeric_limits<float>::infinity();
    using Mesh = TriangleMesh;
    EXPECT_EQ(refusal([](Mesh&) {}), "");
    EXPECT_NE(refusal([](Mesh& m) { m.deflection_mm = kNan; }), "");
    EXPECT_NE(refusal([](Mesh& m) { m.deflection_mm = -1; }), "");
    EXPECT_NE(refusal([](Mesh& m) { m.parts[1].origin_mm[0] = kInf; }), "");
    EXPECT_NE(refusal([](Mesh& m) { m.parts[0].triangle_count = 2; }), "");
    EXPECT_NE(refusal([](Mesh& m) { m.parts[1].triangle_count = 0; }), "");
    EXPECT_NE(refusal([](Mesh& m) { m.parts[1].first_triangle = 0; }), "");
    EXPECT_NE(refusal([](Mesh& m) { m.parts[1].triangle_count = 0xffffffffu; }), "");
    EXPECT_NE(refusal([](Mesh& m) { m.instances[0].part = 2; }), "");
    EXPECT_NE(refusal([](Mesh& m) { m.instances[0].transform[7] = kNan; }), "");
    EXPECT_NE(refusal([](Mesh& m) { m.instances[0].transform[0] = 0; }), "");
    EXPECT_NE(refusal([](Mesh& m) { m.faces[0].has_color = 2; }), "");
    EXPECT_NE(refusal([](Mesh& m) { m.positions[7] = kInf; }), "");
    EXPECT_NE(refusal([](Mesh& m) { m.normals[17] = kNan; }), "");
    EXPECT_NE(refusal([](Mesh& m) { m.normals[2] = 0; }), "");
    EXPECT_NE(refusal([](Mesh& m) { m.normals[2] = 1.001f; }), "");
    EXPECT_NE(refusal([](Mesh& m) { m.triangles[5] = 6; }), "");
    EXPECT_NE(refusal([](Mesh& m) { m.triangle_face[1] = 2; }), "");
}

TEST(mesh_file, allocates_nothing_for_counts_that_the_file_does_not_hold)
{
    std::vector<std::byte> bytes = encode_mesh(small_mesh());
    for (const uint64_t count : {uint64_t{1} << 28, uint64_t{1} << 40, ~uint64_t{0}})
        for (size_t at = offsetof(MeshHeader, parts); at < sizeof(MeshHeader); at += sizeof count) {
            std::vector<std::byte> large = bytes;
            std::memcpy(&large[at], &count, sizeof count);
            const uint64_t checksum = xxh3(large.data(), large.size() - sizeof checksum);
            std::memcpy(&large[large.size() - sizeof checksum], &checksum, sizeof checksum);
            const Result<TriangleMesh> read = decode_mesh(large);
            ASSERT_FALSE(read.ok()) << at;
            EXPECT_EQ(read.error().code, ErrorCode::InvalidMesh);
        }
}

TEST(mesh_file, of_another_version_is_unsupported)
{
    std::vector<std::byte> bytes = encode_mesh(small_mesh());
    bytes[offsetof(MeshHeader, version)] = std::byte{2};
    const Result<TriangleMesh> read = decode_mesh(bytes);
    ASSERT_FALSE(read.ok());
    EXPECT_EQ(read.error().code, ErrorCode::UnsupportedFormat);
}

} // namespace
} // namespace trimray
