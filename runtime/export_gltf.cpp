#include "runtime/export_gltf.h"

#include "format/draco_primitive.h"
#include "format/proxy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>

#include <nlohmann/json.hpp>

namespace trimray {
namespace {

using Json = nlohmann::ordered_json;
using Vec3 = std::array<double, 3>;

constexpr uint kDefaultGrey = 0xffb4b0acu; // the tracers' kDefaultColor (shaders/shared/shading.h)
constexpr uint kNoColor = 0;               // of a primitive whose colour is its placement's

constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963; // glTF's numbers, those of OpenGL
constexpr int kFloat = 5126, kUnsignedInt = 5125;

Vec3 position_of(const ProxyMesh& proxy, uint vertex)
{
    const float* p = &proxy.positions[3 * size_t{vertex}];
    return {p[0], p[1], p[2]};
}

/// Twice the area of the triangle, as a vector along its normal.
Vec3 area_vector(const Vec3& a, const Vec3& b, const Vec3& c)
{
    const Vec3 e{b[0] - a[0], b[1] - a[1], b[2] - a[2]}, f{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    return {e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]};
}

/// Appends the triangles [first, last) of one face. Its vertices get the mean normal of the face's triangles around
/// them, weighted by area: smooth within a face, sharp between faces.
void append_face(const ProxyMesh& proxy, size_t first, size_t last, TriangleMesh& out)
{
    std::map<uint, uint> local; // proxy vertex -> vertex of `out`
    std::vector<Vec3> normals;
    const uint base = static_cast<uint>(out.positions.size() / 3);
    for (size_t t = first; t < last; ++t) {
        const uint* corner = &proxy.triangles[3 * t];
        const Vec3 n =
            area_vector(position_of(proxy, corner[0]), position_of(proxy, corner[1]), position_of(proxy, corner[2]));
        for (size_t k = 0; k < 3; ++k) {
            const auto [found, is_new] = local.try_emplace(corner[k], static_cast<uint>(normals.size()));
            if (is_new) {
                normals.push_back({0, 0, 0});
                for (const double x : position_of(proxy, corner[k]))
                    out.positions.push_back(static_cast<float>(x));
            }
            for (size_t axis = 0; axis < 3; ++axis)
                normals[found->second][axis] += n[axis];
            out.indices.push_back(base + found->second);
        }
    }
    for (const Vec3& n : normals) {
        const double length = std::hypot(n[0], n[1], n[2]);
        for (size_t axis = 0; axis < 3; ++axis)
            out.normals.push_back(static_cast<float>(length > 0 ? n[axis] / length : (axis == 2)));
    }
}

/// Triangles of one colour. color kNoColor: each placement's own.
struct Primitive {
    uint color = kNoColor;
    TriangleMesh mesh;
    Json attributes, extensions; // filled when its bytes are in the buffer
    size_t index_accessor = 0;
};

/// The primitives of each part, colours in ascending order.
std::vector<std::vector<Primitive>> split_by_color(const PackImage& image, const ProxyMesh& proxy)
{
    std::vector<std::map<uint, TriangleMesh>> meshes(image.parts.size());
    for (size_t first = 0; first < proxy.triangle_face.size();) {
        const uint face = proxy.triangle_face[first];
        size_t last = first;
        while (last < proxy.triangle_face.size() && proxy.triangle_face[last] == face)
            ++last;
        const FaceRecord& record = image.faces[face];
        const uint color = (record.flags & kFaceHasColor) != 0 ? record.color_rgba : kNoColor;
        append_face(proxy, first, last, meshes[record.part][color]);
        first = last;
    }
    std::vector<std::vector<Primitive>> parts(image.parts.size());
    for (size_t part = 0; part < parts.size(); ++part)
        for (auto& [color, mesh] : meshes[part])
            parts[part].push_back({color, std::move(mesh), {}, {}, 0});
    return parts;
}

/// sRGB channel, 0 … 255, to linear light. Source: IEC 61966-2-1.
double to_linear(uint channel)
{
    const double c = channel / 255.0;
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

class GltfWriter {
public:
    GltfWriter(const PackImage& image, const GltfOptions& options) : image_(image), options_(options) {}

    Result<GltfExport> write(const ProxyMesh& proxy)
    {
        parts_ = split_by_color(image_, proxy);
        for (std::vector<Primitive>& part : parts_)
            for (Primitive& primitive : part) {
                const Status added = options_.draco ? add_draco(primitive) : add_plain(primitive);
                if (!added.ok())
                    return added.error();
            }
        add_nodes();
        GltfExport out;
        out.nodes = nodes_.size();
        out.meshes = meshes_.size();
        out.materials = materials_.size();
        out.triangles = triangles_;
        out.glb = to_glb();
        return out;
    }

private:
    const std::string& string(uint index) const { return image_.strings.strings[index]; }

    size_t add_view(const void* data, size_t size, int target)
    {
        buffer_.resize((buffer_.size() + 3) / 4 * 4); // accessors are aligned to their components
        Json view = {{"buffer", 0}, {"byteOffset", buffer_.size()}, {"byteLength", size}};
        if (target != 0)
            view["target"] = target;
        const auto* bytes = static_cast<const std::byte*>(data);
        buffer_.insert(buffer_.end(), bytes, bytes + size);
        views_.push_back(std::move(view));
        return views_.size() - 1;
    }

    size_t add_accessor(Json accessor)
    {
        accessors_.push_back(std::move(accessor));
        return accessors_.size() - 1;
    }

    static Json accessor(int component, size_t count, const char* type)
    {
        return {{"componentType", component}, {"count", count}, {"type", type}};
    }

    Status add_plain(Primitive& primitive)
    {
        const TriangleMesh& mesh = primitive.mesh;
        const size_t vertices = mesh.positions.size() / 3;
        std::array<float, 3> lo, hi;
        for (size_t axis = 0; axis < 3; ++axis)
            lo[axis] = hi[axis] = mesh.positions[axis];
        for (size_t i = 0; i < mesh.positions.size(); ++i) {
            lo[i % 3] = std::min(lo[i % 3], mesh.positions[i]);
            hi[i % 3] = std::max(hi[i % 3], mesh.positions[i]);
        }
        Json position = accessor(kFloat, vertices, "VEC3");
        position["bufferView"] = add_view(mesh.positions.data(), 4 * mesh.positions.size(), kArrayBuffer);
        position["min"] = lo;
        position["max"] = hi;
        Json normal = accessor(kFloat, vertices, "VEC3");
        normal["bufferView"] = add_view(mesh.normals.data(), 4 * mesh.normals.size(), kArrayBuffer);
        Json index = accessor(kUnsignedInt, mesh.indices.size(), "SCALAR");
        index["bufferView"] = add_view(mesh.indices.data(), 4 * mesh.indices.size(), kElementArrayBuffer);
        primitive.attributes = {{"POSITION", add_accessor(position)}, {"NORMAL", add_accessor(normal)}};
        primitive.index_accessor = add_accessor(index);
        return Done{};
    }

    Status add_draco(Primitive& primitive)
    {
        const Result<DracoPrimitive> encoded = encode_draco_primitive(primitive.mesh);
        if (!encoded.ok())
            return encoded.error();
        Json position = accessor(kFloat, encoded->vertex_count, "VEC3");
        position["min"] = encoded->lo;
        position["max"] = encoded->hi;
        primitive.attributes = {{"POSITION", add_accessor(position)},
                                {"NORMAL", add_accessor(accessor(kFloat, encoded->vertex_count, "VEC3"))}};
        primitive.index_accessor = add_accessor(accessor(kUnsignedInt, encoded->index_count, "SCALAR"));
        const size_t view = add_view(encoded->bytes.data(), encoded->bytes.size(), 0);
        const Json ids = {{"POSITION", encoded->position_id}, {"NORMAL", encoded->normal_id}};
        primitive.extensions = {{"KHR_draco_mesh_compression", {{"bufferView", view}, {"attributes", ids}}}};
        return Done{};
    }

    size_t material_of(uint color)
    {
        const auto [found, is_new] = material_of_color_.try_emplace(color, materials_.size());
        if (is_new) {
            const double alpha = (color >> 24) / 255.0;
            const Json rgba = {to_linear(color & 0xff), to_linear(color >> 8 & 0xff), to_linear(color >> 16 & 0xff),
                               alpha};
            Json material = {
                {"pbrMetallicRoughness", {{"baseColorFactor", rgba}, {"metallicFactor", 0}, {"roughnessFactor", 0.6}}},
                {"doubleSided", true}};
            if (alpha < 1)
                material["alphaMode"] = "BLEND";
            materials_.push_back(std::move(material));
        }
        return found->second;
    }

    /// The mesh of a part for placements of colour `color`; placements that look the same share it.
    size_t mesh_of(uint part, uint color)
    {
        const std::vector<Primitive>& primitives = parts_[part];
        const bool inherits = primitives.front().color == kNoColor; // the smallest colour comes first
        const auto [found, is_new] = mesh_of_part_.try_emplace({part, inherits ? color : kNoColor}, meshes_.size());
        if (is_new) {
            Json list = Json::array();
            for (const Primitive& primitive : primitives) {
                Json entry = {{"attributes", primitive.attributes},
                              {"indices", primitive.index_accessor},
                              {"material", material_of(primitive.color == kNoColor ? color : primitive.color)}};
                if (!primitive.extensions.is_null())
                    entry["extensions"] = primitive.extensions;
                list.push_back(std::move(entry));
            }
            Json mesh = {{"primitives", std::move(list)}};
            if (image_.parts[part].name != 0)
                mesh["name"] = string(image_.parts[part].name);
            meshes_.push_back(std::move(mesh));
        }
        return found->second;
    }

    void add_nodes()
    {
        // mm to metres and z up to y up: (x, y, z) -> (x, z, -y) / 1000
        constexpr double k = 0.001;
        Json root = {{"name", image_.provenance.source_name},
                     {"matrix", {k, 0, 0, 0, 0, 0, -k, 0, 0, k, 0, 0, 0, 0, 0, 1}}};
        nodes_.push_back(std::move(root));
        for (const TreeNode& node : image_.tree) {
            Json entry = Json::object();
            if (node.name != 0)
                entry["name"] = string(node.name);
            nodes_.push_back(std::move(entry));
        }
        for (size_t i = 0; i < image_.tree.size(); ++i)
            nodes_[i == 0 ? 0 : 1 + image_.tree[i].parent]["children"].push_back(1 + i);
        for (const InstanceRecord& instance : image_.instances) {
            nodes_[1 + instance.tree_node]["children"].push_back(nodes_.size());
            nodes_.push_back(placement(instance));
        }
    }

    Json placement(const InstanceRecord& instance)
    {
        const PartRecord& part = image_.parts[instance.part];
        Json node = Json::object();
        if (const uint name = instance.name != 0 ? instance.name : part.name)
            node["name"] = string(name);
        // part units -> world mm, column by column: M = transform * translation(origin) * scaling(scale)
        const double(&m)[12] = instance.transform;
        Json matrix = Json::array();
        for (size_t column = 0; column < 4; ++column) {
            for (size_t row = 0; row < 3; ++row) {
                double x = m[4 * row + column] * part.scale_mm;
                if (column == 3) {
                    x = m[4 * row + 3];
                    for (size_t axis = 0; axis < 3; ++axis)
                        x += m[4 * row + axis] * part.origin_mm[axis];
                }
                matrix.push_back(x);
            }
            matrix.push_back(column == 3 ? 1 : 0);
        }
        node["matrix"] = std::move(matrix);
        if (!parts_[instance.part].empty()) {
            const bool has_color = instance.color_rgba >> 24 != 0;
            node["mesh"] = mesh_of(instance.part, has_color ? instance.color_rgba : kDefaultGrey);
            for (const Primitive& primitive : parts_[instance.part])
                triangles_ += primitive.mesh.indices.size() / 3;
        }
        return node;
    }

    /// Header, JSON chunk padded with spaces, binary chunk padded with zeros.
    std::vector<std::byte> to_glb() const
    {
        Json gltf = {{"asset", {{"version", "2.0"}, {"generator", "trimray"}}},
                     {"scene", 0},
                     {"scenes", {{{"nodes", {0}}}}},
                     {"nodes", nodes_},
                     {"meshes", meshes_},
                     {"materials", materials_},
                     {"accessors", accessors_},
                     {"bufferViews", views_},
                     {"buffers", {{{"byteLength", buffer_.size()}}}}};
        if (options_.draco)
            gltf["extensionsUsed"] = gltf["extensionsRequired"] = {"KHR_draco_mesh_compression"};
        std::string json = gltf.dump();
        json.resize((json.size() + 3) / 4 * 4, ' ');
        const size_t binary_size = (buffer_.size() + 3) / 4 * 4;
        std::vector<std::byte> glb;
        const auto put = [&](uint word) {
            const auto* bytes = reinterpret_cast<const std::byte*>(&word);
            glb.insert(glb.end(), bytes, bytes + 4);
        };
        put(0x46546C67u); // "glTF"
        put(2);
        put(static_cast<uint>(12 + 8 + json.size() + 8 + binary_size));
        put(static_cast<uint>(json.size()));
        put(0x4E4F534Au); // "JSON"
        const auto* text = reinterpret_cast<const std::byte*>(json.data());
        glb.insert(glb.end(), text, text + json.size());
        put(static_cast<uint>(binary_size));
        put(0x004E4942u); // "BIN"
        glb.insert(glb.end(), buffer_.begin(), buffer_.end());
        glb.resize(glb.size() + binary_size - buffer_.size());
        return glb;
    }

    const PackImage& image_;
    const GltfOptions& options_;
    std::vector<std::vector<Primitive>> parts_;
    std::vector<std::byte> buffer_;
    Json views_ = Json::array(), accessors_ = Json::array(), materials_ = Json::array(), meshes_ = Json::array(),
         nodes_ = Json::array();
    std::map<uint, size_t> material_of_color_;
    std::map<std::pair<uint, uint>, size_t> mesh_of_part_;
    uint64_t triangles_ = 0;
};

} // namespace

Result<GltfExport> export_gltf(const PackImage& image, const GltfOptions& options)
{
    if (image.proxy_draco.empty())
        return Error{ErrorCode::UnsupportedPackFeature, "section prox",
                     image.compact ? "a compact pack has no coarse triangles; pack the model again without --compact"
                                   : "the pack has no coarse triangles; pack the model again"};
    const Result<ProxyMesh> proxy = decode_proxy(image.proxy_draco, image.faces.size());
    if (!proxy.ok())
        return proxy.error();
    GltfWriter writer(image, options);
    Result<GltfExport> out = writer.write(*proxy);
    if (out.ok() && out->glb.size() > UINT32_MAX)
        return Error{ErrorCode::UnsupportedPackFeature, "glTF", "the file would exceed 4 GiB, the limit of .glb"};
    return out;
}

} // namespace trimray
