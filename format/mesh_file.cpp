#include "format/mesh_file.h"

#include "format/affine.h"
#include "format/pack_file.h"
#include "format/read_file.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <optional>

#include <fmt/format.h>

namespace trimray {
namespace {

static_assert(std::endian::native == std::endian::little, "a mesh is little-endian and is read by copying");

constexpr unsigned char kIdentifier[12] = {0xAB, 'T', 'R', 'I', 'M', 'E', 'S', 'H', 0xBB, '\r', '\n', 0x1A};
constexpr uint32_t kVersion = 1;
constexpr uint64_t kMaxRecords = 1u << 29; // of parts, instances and faces each
constexpr float kUnitTolerance = 1e-4f;    // of the square of a normal's length; single precision keeps 1e-6

/// Calls f(array, elements a record has, records) for each array, in the order of the file.
template <class Mesh, class F>
void for_each_mesh_array(Mesh& mesh, const MeshHeader& header, F&& f)
{
    f(mesh.parts, 1, header.parts);
    f(mesh.instances, 1, header.instances);
    f(mesh.faces, 1, header.faces);
    f(mesh.positions, 3, header.vertices);
    f(mesh.normals, 3, header.vertices);
    f(mesh.triangles, 3, header.triangles);
    f(mesh.triangle_face, 1, header.triangles);
}

/// Of a whole file. Domain: counts within their bounds.
uint64_t file_bytes(const MeshHeader& header)
{
    uint64_t bytes = sizeof header + sizeof(uint64_t);
    const TriangleMesh none;
    for_each_mesh_array(none, header, [&](const auto& array, uint64_t width, uint64_t records) {
        bytes += sizeof(array[0]) * width * records;
    });
    return bytes;
}

template <class Range>
bool are_lengths(const Range& numbers)
{
    // false for NaN
    return std::all_of(std::begin(numbers), std::end(numbers), [](auto x) { return std::abs(x) <= kMaxMillimetres; });
}

Error damaged(std::string detail)
{
    return {ErrorCode::InvalidMesh, "mesh", std::move(detail)};
}

std::optional<std::string> fault_of_header(const MeshHeader& header, uint64_t bytes)
{
    if (!(header.deflection_mm >= 0 && header.deflection_mm <= kMaxMillimetres))
        return fmt::format("a deflection of {} mm", header.deflection_mm);
    if (std::max({header.parts, header.instances, header.faces}) > kMaxRecords || header.vertices > kMaxMeshVertices ||
        header.triangles > kMaxMeshTriangles)
        return fmt::format("{} parts, {} instances, {} faces, {} vertices and {} triangles are more than a mesh holds",
                           header.parts, header.instances, header.faces, header.vertices, header.triangles);
    if (file_bytes(header) != bytes)
        return fmt::format("expected {} bytes, found {}", file_bytes(header), bytes);
    return std::nullopt;
}

std::optional<std::string> fault_of_parts(const TriangleMesh& mesh)
{
    uint64_t next = 0;
    for (size_t i = 0; i < mesh.parts.size(); ++i) {
        const MeshPart& part = mesh.parts[i];
        if (!are_lengths(part.origin_mm))
            return fmt::format("part {}: its origin is not finite", i);
        if (part.first_triangle != next)
            return fmt::format("part {}: expected its first triangle to be {}, found {}", i, next, part.first_triangle);
        next += part.triangle_count;
    }
    if (next != mesh.triangle_face.size())
        return fmt::format("the parts have {} of {} triangles", next, mesh.triangle_face.size());
    for (size_t i = 0; i < mesh.instances.size(); ++i) {
        if (mesh.instances[i].part >= mesh.parts.size())
            return fmt::format("instance {}: part {} of {}", i, mesh.instances[i].part, mesh.parts.size());
        if (!are_lengths(mesh.instances[i].transform) || is_singular(mesh.instances[i].transform))
            return fmt::format("instance {}: its transform is flat or not finite", i);
    }
    for (size_t i = 0; i < mesh.faces.size(); ++i)
        if (mesh.faces[i].has_color > 1)
            return fmt::format("face {}: expected 0 or 1, found {}", i, mesh.faces[i].has_color);
    return std::nullopt;
}

std::optional<std::string> fault_of_triangles(const TriangleMesh& mesh)
{
    if (!are_lengths(mesh.positions))
        return "a vertex is not finite";
    for (size_t v = 0; v < mesh.normals.size(); v += 3) {
        const float* n = &mesh.normals[v];
        if (!(std::abs(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) <= kUnitTolerance))
            return fmt::format("vertex {}: its normal is not a unit vector", v / 3);
    }
    const size_t vertices = mesh.positions.size() / 3;
    const auto bad =
        std::find_if(mesh.triangles.begin(), mesh.triangles.end(), [&](uint32_t v) { return v >= vertices; });
    if (bad != mesh.triangles.end())
        return fmt::format("triangle {}: vertex {} of {}", (bad - mesh.triangles.begin()) / 3, *bad, vertices);
    for (size_t t = 0; t < mesh.triangle_face.size(); ++t)
        if (mesh.triangle_face[t] >= mesh.faces.size())
            return fmt::format("triangle {}: face {} of {}", t, mesh.triangle_face[t], mesh.faces.size());
    return std::nullopt;
}

} // namespace

std::vector<std::byte> encode_mesh(const TriangleMesh& mesh)
{
    MeshHeader header{};
    std::copy(std::begin(kIdentifier), std::end(kIdentifier), header.identifier);
    header.version = kVersion;
    header.deflection_mm = mesh.deflection_mm;
    header.parts = mesh.parts.size();
    header.instances = mesh.instances.size();
    header.faces = mesh.faces.size();
    header.vertices = mesh.positions.size() / 3;
    header.triangles = mesh.triangle_face.size();
    std::vector<std::byte> bytes(file_bytes(header));
    std::byte* next = bytes.data();
    const auto append = [&](const void* from, size_t size) {
        if (size > 0)
            std::memcpy(next, from, size);
        next += size;
    };
    append(&header, sizeof header);
    for_each_mesh_array(mesh, header, [&](const auto& array, uint64_t width, uint64_t records) {
        assert(array.size() == width * records && "arrays that fit each other");
        append(array.data(), sizeof(array[0]) * width * records);
    });
    const uint64_t checksum = xxh3(bytes.data(), static_cast<size_t>(next - bytes.data()));
    append(&checksum, sizeof checksum);
    return bytes;
}

Result<TriangleMesh> decode_mesh(std::span<const std::byte> bytes)
{
    MeshHeader header;
    if (bytes.size() < sizeof header)
        return damaged(fmt::format("expected at least {} bytes, found {}", sizeof header, bytes.size()));
    std::memcpy(&header, bytes.data(), sizeof header);
    if (!std::equal(std::begin(kIdentifier), std::end(kIdentifier), header.identifier))
        return damaged("it does not begin as a .trimesh file does");
    if (header.version != kVersion)
        return Error{ErrorCode::UnsupportedFormat, "mesh",
                     fmt::format("version {}; this program reads version {}", header.version, kVersion)};
    if (const auto fault = fault_of_header(header, bytes.size()))
        return damaged(*fault);
    uint64_t checksum = 0;
    const size_t content_bytes = bytes.size() - sizeof checksum;
    std::memcpy(&checksum, bytes.data() + content_bytes, sizeof checksum);
    if (xxh3(bytes.data(), content_bytes) != checksum)
        return damaged("its checksum does not fit; write it again");
    TriangleMesh mesh;
    mesh.deflection_mm = header.deflection_mm;
    const std::byte* next = bytes.data() + sizeof header;
    for_each_mesh_array(mesh, header, [&](auto& array, uint64_t width, uint64_t records) {
        array.resize(width * records);
        const size_t size = sizeof(array[0]) * array.size();
        if (size > 0)
            std::memcpy(array.data(), next, size);
        next += size;
    });
    if (const auto fault = fault_of_parts(mesh))
        return damaged(*fault);
    if (const auto fault = fault_of_triangles(mesh))
        return damaged(*fault);
    return mesh;
}

Result<TriangleMesh> read_mesh(const std::string& path)
{
    const Result<std::vector<std::byte>> bytes = read_file(path);
    if (!bytes.ok())
        return bytes.error();
    Result<TriangleMesh> mesh = decode_mesh(*bytes);
    if (mesh.ok())
        return mesh;
    Error error = mesh.error();
    error.where = path;
    return error;
}

} // namespace trimray
