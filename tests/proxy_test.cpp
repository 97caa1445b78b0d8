#include "format/proxy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <random>

#include <gtest/gtest.h>

namespace trimray {
namespace {

/// An n x n net of triangles over part of a sphere for each face; neighbouring faces share their border's positions.
ProxyMesh sphere_strips(uint faces, uint n)
{
    ProxyMesh mesh;
    for (uint f = 0; f < faces; ++f) {
        const uint first = static_cast<uint>(mesh.positions.size() / 3);
        for (uint i = 0; i <= n; ++i)
            for (uint j = 0; j <= n; ++j) {
                const float u = 6.0f * (static_cast<float>(f * n + i)) / static_cast<float>(faces * n);
                const float v = -1 + 2 * static_cast<float>(j) / static_cast<float>(n);
                for (const float x : {std::cos(v) * std::cos(u), std::cos(v) * std::sin(u), std::sin(v)})
                    mesh.positions.push_back(x);
            }
        for (uint i = 0; i < n; ++i)
            for (uint j = 0; j < n; ++j) {
                const uint a = first + i * (n + 1) + j, b = a + n + 1;
                for (const uint vertex : {a, b, b + 1, a, b + 1, a + 1})
                    mesh.triangles.push_back(vertex);
                mesh.triangle_face.insert(mesh.triangle_face.end(), {f, f});
            }
    }
    return mesh;
}

/// Corner positions of each triangle, first the smallest corner (winding kept), triangles sorted: order is free.
std::vector<std::array<float, 10>> soup(const ProxyMesh& mesh)
{
    std::vector<std::array<float, 10>> all;
    for (size_t t = 0; t < mesh.triangle_face.size(); ++t) {
        std::array<std::array<float, 3>, 3> corners;
        for (size_t k = 0; k < 3; ++k)
            for (size_t axis = 0; axis < 3; ++axis)
                corners[k][axis] = mesh.positions[3 * mesh.triangles[3 * t + k] + axis];
        std::array<float, 10> row{static_cast<float>(mesh.triangle_face[t])};
        for (size_t i = 0; i < 9; ++i)
            row[1 + i] = corners[i / 3][i % 3];
        all.push_back(row);
    }
    return all;
}

std::array<float, 3> centroid(const std::array<float, 10>& t)
{
    return {(t[1] + t[4] + t[7]) / 3, (t[2] + t[5] + t[8]) / 3, (t[3] + t[6] + t[9]) / 3};
}

TEST(proxy, triangles_and_their_faces_come_back_within_the_rounding)
{
    const ProxyMesh mesh = sphere_strips(7, 12);
    const auto bytes = encode_proxy(mesh);
    ASSERT_TRUE(bytes.ok()) << bytes.error().detail;
    const Result<ProxyMesh> back = decode_proxy(*bytes, 7);
    ASSERT_TRUE(back.ok()) << back.error().detail;
    ASSERT_EQ(back->triangle_face.size(), mesh.triangle_face.size());
    EXPECT_TRUE(std::is_sorted(back->triangle_face.begin(), back->triangle_face.end()));
    EXPECT_LT(bytes->size(), mesh.triangle_face.size() * 4) << "Draco's point is bytes a triangle, not twenty";
    const float rounding = 2.0f / (1 << kProxyPositionBits);
    const auto before = soup(mesh), after = soup(*back);
    for (const auto& triangle : after) {
        const bool found = std::any_of(before.begin(), before.end(), [&](const auto& other) {
            const auto a = centroid(triangle), b = centroid(other);
            return triangle[0] == other[0] && std::abs(a[0] - b[0]) < rounding && std::abs(a[1] - b[1]) < rounding &&
                   std::abs(a[2] - b[2]) < rounding;
        });
        ASSERT_TRUE(found);
    }
}

TEST(proxy, same_mesh_gives_same_bytes)
{
    EXPECT_EQ(*encode_proxy(sphere_strips(3, 9)), *encode_proxy(sphere_strips(3, 9)));
}

TEST(proxy, an_empty_mesh_has_no_bytes)
{
    EXPECT_TRUE(encode_proxy(ProxyMesh{})->empty());
    EXPECT_TRUE(decode_proxy({}, 3)->triangles.empty());
}

TEST(proxy, damaged_bytes_give_an_error_or_a_mesh_within_its_bounds)
{
    const std::vector<std::byte> good = *encode_proxy(sphere_strips(3, 6));
    EXPECT_FALSE(decode_proxy(good, 2).ok()) << "a face that does not exist";
    std::mt19937 random(11);
    int refused = 0;
    for (int round = 0; round < 2000; ++round) {
        std::vector<std::byte> bytes = good;
        for (uint k = 0; k < 1 + random() % 3; ++k)
            bytes[random() % bytes.size()] = static_cast<std::byte>(random());
        if (random() % 4 == 0)
            bytes.resize(random() % bytes.size());
        const Result<ProxyMesh> mesh = decode_proxy(bytes, 3);
        if (!mesh.ok()) {
            ++refused;
            continue;
        }
        for (const uint vertex : mesh->triangles)
            ASSERT_LT(3 * size_t{vertex} + 2, mesh->positions.size());
        for (const uint face : mesh->triangle_face)
            ASSERT_LT(face, 3u);
    }
    EXPECT_GT(refused, 200);
}

} // namespace
} // namespace trimray
