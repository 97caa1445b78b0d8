#include "preprocess/collect_mesh.h"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>

namespace trimray {
namespace {

void append_part(const CadMesh& part, const std::vector<uint>& face_ids, TriangleMesh& mesh)
{
    const uint first_vertex = static_cast<uint>(mesh.positions.size() / 3);
    const uint first_triangle = static_cast<uint>(mesh.triangle_face.size());
    mesh.positions.insert(mesh.positions.end(), part.positions.begin(), part.positions.end());
    mesh.normals.insert(mesh.normals.end(), part.normals.begin(), part.normals.end());
    for (size_t t = 0; t < part.triangle_face.size(); ++t) {
        const uint face = face_ids[part.triangle_face[t]];
        if (face == kNotConverted)
            continue;
        for (size_t k = 0; k < 3; ++k)
            mesh.triangles.push_back(first_vertex + part.triangles[3 * t + k]);
        mesh.triangle_face.push_back(face);
    }
    MeshPart record{};
    std::copy(part.origin_mm.begin(), part.origin_mm.end(), record.origin_mm);
    record.first_triangle = first_triangle;
    record.triangle_count = static_cast<uint>(mesh.triangle_face.size()) - first_triangle;
    mesh.parts.push_back(record);
}

} // namespace

Result<TriangleMesh> collect_mesh(const CadModel& model, const ConvertedFaces& converted)
{
    uint64_t vertices = 0, triangles = 0;
    for (const CadPart& part : model.parts) {
        vertices += part.mesh.positions.size() / 3;
        triangles += part.mesh.triangle_face.size();
    }
    if (vertices > kMaxMeshVertices || triangles > kMaxMeshTriangles)
        return Error{ErrorCode::Usage, "--mesh",
                     fmt::format("{} triangles with {} vertices, a mesh holds {} with {}; take a larger deflection",
                                 triangles, vertices, kMaxMeshTriangles, kMaxMeshVertices)};
    TriangleMesh mesh;
    mesh.deflection_mm = model.mesh_deflection_mm;
    for (const FaceRecord& face : converted.image.faces) {
        const bool has_color = (face.flags & kFaceHasColor) != 0;
        mesh.faces.push_back({has_color ? face.color_rgba : 0, has_color});
    }
    for (const InstanceRecord& instance : converted.image.instances) {
        MeshInstance out{};
        std::copy(std::begin(instance.transform), std::end(instance.transform), out.transform);
        out.part = instance.part;
        out.color_rgba = instance.color_rgba;
        mesh.instances.push_back(out);
    }
    for (size_t part = 0; part < model.parts.size(); ++part)
        append_part(model.parts[part].mesh, converted.face_ids[part], mesh);
    return mesh;
}

std::vector<uint> faces_without_triangles(const TriangleMesh& mesh)
{
    std::vector<uint8_t> has_one(mesh.faces.size());
    for (const uint face : mesh.triangle_face)
        has_one[face] = 1;
    std::vector<uint> without;
    for (uint face = 0; face < has_one.size(); ++face)
        if (!has_one[face])
            without.push_back(face);
    return without;
}

} // namespace trimray
