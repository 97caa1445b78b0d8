// glTF from a pack: what is in the file, read back by the words of the glTF specification.
#include "format/proxy.h"
#include "runtime/export_gltf.h"
#include "synthetic_pack.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace trimray {
namespace {

using Json = nlohmann::json;

/// Two triangles for each face: the square [-0.5, 0.5]^2 at height face / 8, facing up.
PackImage image_with_proxy()
{
    PackImage image = synthetic_image();
    ProxyMesh mesh;
    for (uint face = 0; face < image.faces.size(); ++face) {
        const uint first = static_cast<uint>(mesh.positions.size() / 3);
        for (const auto& [x, y] : {std::pair{-0.5f, -0.5f}, {0.5f, -0.5f}, {0.5f, 0.5f}, {-0.5f, 0.5f}})
            for (const float c : {x, y, static_cast<float>(face) / 8})
                mesh.positions.push_back(c);
        for (const uint k : {0u, 1u, 2u, 0u, 2u, 3u})
            mesh.triangles.push_back(first + k);
        mesh.triangle_face.insert(mesh.triangle_face.end(), {face, face});
    }
    image.proxy_draco = *encode_proxy(mesh);
    image.faces[1].flags &= ~kFaceHasColor; // coloured by its placement
    image.instances[1].color_rgba = 0;      // by nothing: grey
    image.instances[1].name = image.strings.add("zweite");
    image.parts[0].origin_mm[2] = 7;
    return image;
}

struct Glb {
    Json json;
    std::vector<std::byte> binary;
};

uint word_at(const std::vector<std::byte>& bytes, size_t at)
{
    uint word;
    std::memcpy(&word, &bytes.at(at + 3) - 3, 4);
    return word;
}

/// Source: glTF 2.0, "GLB File Format Specification".
Glb parse(const std::vector<std::byte>& glb)
{
    EXPECT_EQ(word_at(glb, 0), 0x46546C67u);
    EXPECT_EQ(word_at(glb, 4), 2u);
    EXPECT_EQ(word_at(glb, 8), glb.size());
    const size_t json_size = word_at(glb, 12);
    EXPECT_EQ(json_size % 4, 0u);
    EXPECT_EQ(word_at(glb, 16), 0x4E4F534Au);
    const char* text = reinterpret_cast<const char*>(&glb[20]);
    const size_t binary_at = 20 + json_size;
    EXPECT_EQ(word_at(glb, binary_at + 4), 0x004E4942u);
    EXPECT_EQ(binary_at + 8 + word_at(glb, binary_at), glb.size());
    return {Json::parse(text, text + json_size), {glb.begin() + static_cast<ptrdiff_t>(binary_at) + 8, glb.end()}};
}

using Matrix = std::array<double, 16>; // column-major

Matrix multiply(const Matrix& a, const Matrix& b)
{
    Matrix c{};
    for (size_t column = 0; column < 4; ++column)
        for (size_t row = 0; row < 4; ++row)
            for (size_t k = 0; k < 4; ++k)
                c[4 * column + row] += a[4 * k + row] * b[4 * column + k];
    return c;
}

struct Placed {
    std::vector<std::string> path; // names from the root
    Matrix matrix;
    size_t mesh;
};

/// All nodes with a mesh, with their matrices in the scene.
std::vector<Placed> placed_meshes(const Json& gltf)
{
    std::vector<Placed> all;
    std::set<size_t> visited;
    const std::function<void(size_t, std::vector<std::string>, Matrix)> walk =
        [&](size_t index, std::vector<std::string> path, Matrix matrix) {
            EXPECT_TRUE(visited.insert(index).second) << "a node has one parent";
            const Json& node = gltf["nodes"].at(index);
            path.push_back(node.value("name", ""));
            if (node.contains("matrix"))
                matrix = multiply(matrix, node["matrix"].get<Matrix>());
            if (node.contains("mesh"))
                all.push_back({path, matrix, node["mesh"]});
            for (const Json& child : node.value("children", Json::array()))
                walk(child, path, matrix);
        };
    const Matrix identity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    for (const Json& root : gltf["scenes"][0]["nodes"])
        walk(root, {}, identity);
    EXPECT_EQ(visited.size(), gltf["nodes"].size()) << "every node is in the scene";
    return all;
}

TEST(export_gltf, keeps_tree_names_and_shared_meshes)
{
    const Result<GltfExport> out = export_gltf(image_with_proxy(), {});
    ASSERT_TRUE(out.ok()) << out.error().detail;
    const Glb glb = parse(out->glb);
    const std::vector<Placed> placed = placed_meshes(glb.json);
    ASSERT_EQ(placed.size(), 3u);
    const auto path_of = [&](const std::string& leaf) {
        const auto found =
            std::find_if(placed.begin(), placed.end(), [&](const Placed& p) { return p.path.back() == leaf; });
        return found == placed.end() ? std::vector<std::string>{} : found->path;
    };
    EXPECT_EQ(path_of("zweite"), (std::vector<std::string>{"Gehäuse.step", "assembly", "child", "zweite"}));
    EXPECT_EQ(path_of("плита").size(), 3u);
    // the first two placements show one part in two colours: two meshes, but one set of vertices
    EXPECT_EQ(out->meshes, 3u);
    EXPECT_EQ(out->triangles, 2u * (3 + 3 + 1));
    EXPECT_EQ(glb.json["meshes"][0]["primitives"][0]["attributes"],
              glb.json["meshes"][1]["primitives"][0]["attributes"]);
}

TEST(export_gltf, colours_are_linear_and_of_the_face_before_the_placement)
{
    const Glb glb = parse(export_gltf(image_with_proxy(), {})->glb);
    std::set<std::vector<float>> colors;
    for (const Json& material : glb.json["materials"])
        colors.insert(material["pbrMetallicRoughness"]["baseColorFactor"].get<std::vector<float>>());
    const auto has = [&](double r, double g, double b) {
        return std::any_of(colors.begin(), colors.end(), [&](const std::vector<float>& c) {
            return std::abs(c[0] - r) < 1e-3 && std::abs(c[1] - g) < 1e-3 && std::abs(c[2] - b) < 1e-3 && c[3] == 1;
        });
    };
    EXPECT_TRUE(has(0.5271, 0.0513, 0.0144)) << "0xc0, 0x40, 0x20 of the faces";
    EXPECT_TRUE(has(0.2159, 0.2159, 0.2159)) << "0x80 of the first placement";
    EXPECT_TRUE(has(0.4125, 0.4342, 0.4564)) << "the default grey of the second one";
    EXPECT_EQ(colors.size(), 3u);
}

TEST(export_gltf, vertices_lie_where_the_pack_has_them_in_metres_with_y_up)
{
    for (const bool draco : {false, true}) {
        const PackImage image = image_with_proxy();
        const Result<GltfExport> out = export_gltf(image, {draco});
        ASSERT_TRUE(out.ok()) << out.error().detail;
        const Glb glb = parse(out->glb);
        constexpr double kInf = std::numeric_limits<double>::infinity();
        std::array<double, 3> lo{kInf, kInf, kInf}, hi{-kInf, -kInf, -kInf};
        for (const Placed& p : placed_meshes(glb.json))
            for (const Json& primitive : glb.json["meshes"][p.mesh]["primitives"]) {
                const Json& a = glb.json["accessors"].at(primitive["attributes"]["POSITION"].get<size_t>());
                for (const char* corner : {"min", "max"}) // the placements do not turn: corners stay corners
                    for (size_t row = 0; row < 3; ++row) {
                        double x = p.matrix[12 + row];
                        for (size_t k = 0; k < 3; ++k)
                            x += p.matrix[4 * k + row] * a[corner][k].get<double>();
                        lo[row] = std::min(lo[row], x);
                        hi[row] = std::max(hi[row], x);
                    }
            }
        // x: -10 … 110 mm over the placements (the last mirrored); z of part 0: 7 + 20 * (0 … 2/8), of part 1: 20 * 3/8
        const double expected_lo[] = {-0.010, 0.007, -0.010}, expected_hi[] = {0.110, 0.012, 0.010};
        for (size_t axis = 0; axis < 3; ++axis) {
            EXPECT_NEAR(lo[axis], expected_lo[axis], 3e-5) << axis; // the proxy's rounding, 20 mm / 2^11, and Draco's
            EXPECT_NEAR(hi[axis], expected_hi[axis], 3e-5) << axis;
        }
    }
}

TEST(export_gltf, accessors_stay_inside_the_buffer_and_normals_are_unit)
{
    const Glb glb = parse(export_gltf(image_with_proxy(), {})->glb);
    const Json& gltf = glb.json;
    EXPECT_EQ(gltf["asset"]["version"], "2.0");
    EXPECT_LE(gltf["buffers"][0]["byteLength"].get<size_t>(), glb.binary.size());
    for (const Json& view : gltf["bufferViews"])
        EXPECT_LE(view["byteOffset"].get<size_t>() + view["byteLength"].get<size_t>(), glb.binary.size());
    for (const Json& mesh : gltf["meshes"])
        for (const Json& primitive : mesh["primitives"]) {
            const auto floats = [&](const Json& index) {
                const Json& a = gltf["accessors"].at(index.get<size_t>());
                std::vector<float> values(3 * a["count"].get<size_t>());
                const size_t at = gltf["bufferViews"].at(a["bufferView"].get<size_t>())["byteOffset"];
                std::memcpy(values.data(), &glb.binary.at(at), 4 * values.size());
                return values;
            };
            const std::vector<float> normals = floats(primitive["attributes"]["NORMAL"]);
            for (size_t i = 0; i < normals.size(); i += 3)
                EXPECT_NEAR(normals[i + 2], 1, 1e-6); // the squares face up
            const Json& indices = gltf["accessors"].at(primitive["indices"].get<size_t>());
            const size_t at = gltf["bufferViews"].at(indices["bufferView"].get<size_t>())["byteOffset"];
            for (size_t i = 0; i < indices["count"].get<size_t>(); ++i)
                EXPECT_LT(3 * word_at(glb.binary, at + 4 * i), normals.size());
        }
}

TEST(export_gltf, draco_is_required_by_name_and_has_no_plain_vertices)
{
    const Glb glb = parse(export_gltf(image_with_proxy(), {true})->glb);
    EXPECT_EQ(glb.json["extensionsRequired"], Json::array({"KHR_draco_mesh_compression"}));
    for (const Json& accessor : glb.json["accessors"])
        EXPECT_FALSE(accessor.contains("bufferView"));
    for (const Json& mesh : glb.json["meshes"])
        for (const Json& primitive : mesh["primitives"]) {
            const Json& extension = primitive["extensions"]["KHR_draco_mesh_compression"];
            const Json& view = glb.json["bufferViews"].at(extension["bufferView"].get<size_t>());
            EXPECT_EQ(std::memcmp(&glb.binary.at(view["byteOffset"].get<size_t>()), "DRACO", 5), 0);
            EXPECT_TRUE(extension["attributes"].contains("POSITION") && extension["attributes"].contains("NORMAL"));
        }
}

TEST(export_gltf, a_pack_without_proxy_says_so)
{
    PackImage image = synthetic_image();
    image.proxy_draco.clear();
    EXPECT_EQ(export_gltf(image, {}).error().code, ErrorCode::UnsupportedPackFeature);
}

} // namespace
} // namespace trimray
