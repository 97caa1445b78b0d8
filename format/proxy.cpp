#include "format/proxy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <memory>
#include <numeric>

#include <draco/compression/decode.h>
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <fmt/format.h>

namespace trimray {
namespace {

/// Vertices that agree in position and face become one, so that Draco sees the surface's connectivity.
std::unique_ptr<draco::Mesh> to_draco(const ProxyMesh& mesh)
{
    const size_t count = mesh.triangle_face.size();
    draco::TriangleSoupMeshBuilder builder;
    builder.Start(static_cast<int>(count));
    const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
    const int face = builder.AddAttribute(draco::GeometryAttribute::GENERIC, 1, draco::DT_UINT32);
    for (size_t t = 0; t < count; ++t) {
        const draco::FaceIndex index(static_cast<uint32_t>(t));
        const auto corner = [&](size_t k) { return &mesh.positions[3 * size_t{mesh.triangles[3 * t + k]}]; };
        builder.SetAttributeValuesForFace(position, index, corner(0), corner(1), corner(2));
        const uint* id = &mesh.triangle_face[t];
        builder.SetAttributeValuesForFace(face, index, id, id, id);
    }
    return builder.Finalize();
}

Error damaged(std::string detail)
{
    return {ErrorCode::InvalidPack, "section prox", std::move(detail)};
}

/// The mesh with its triangles in the order of their faces.
ProxyMesh sorted_by_face(const ProxyMesh& mesh)
{
    std::vector<uint> order(mesh.triangle_face.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(),
                     [&](uint a, uint b) { return mesh.triangle_face[a] < mesh.triangle_face[b]; });
    ProxyMesh sorted;
    sorted.positions = mesh.positions;
    for (const uint t : order) {
        sorted.triangle_face.push_back(mesh.triangle_face[t]);
        for (size_t k = 0; k < 3; ++k)
            sorted.triangles.push_back(mesh.triangles[3 * size_t{t} + k]);
    }
    return sorted;
}

Result<ProxyMesh> from_draco(const draco::Mesh& mesh, size_t face_count)
{
    const draco::PointAttribute* position = mesh.GetNamedAttribute(draco::GeometryAttribute::POSITION);
    const draco::PointAttribute* face = mesh.GetNamedAttribute(draco::GeometryAttribute::GENERIC);
    if (!position || !face || position->num_components() != 3 || face->num_components() != 1)
        return damaged("expected a position of three components and a face id");
    if (mesh.num_faces() > kMaxProxyTriangles)
        return damaged(fmt::format("{} triangles, the limit is {}", mesh.num_faces(), kMaxProxyTriangles));
    ProxyMesh out;
    std::vector<uint> face_of_point(mesh.num_points());
    for (uint p = 0; p < mesh.num_points(); ++p) {
        std::array<float, 3> x{};
        const draco::PointIndex index(p);
        const bool converted = position->ConvertValue<float, 3>(position->mapped_index(index), x.data()) &&
                               face->ConvertValue<uint32_t, 1>(face->mapped_index(index), &face_of_point[p]);
        if (!converted || !std::all_of(x.begin(), x.end(), [](float c) { return std::isfinite(c); }))
            return damaged(fmt::format("vertex {} has no finite position", p));
        out.positions.insert(out.positions.end(), x.begin(), x.end());
    }
    for (uint t = 0; t < mesh.num_faces(); ++t) {
        const draco::Mesh::Face& corners = mesh.face(draco::FaceIndex(t));
        if (std::any_of(corners.begin(), corners.end(), [&](draco::PointIndex p) { return p >= mesh.num_points(); }))
            return damaged(fmt::format("triangle {} has a vertex that does not exist", t));
        const uint id = face_of_point[corners[0].value()];
        if (id >= face_count || id != face_of_point[corners[1].value()] || id != face_of_point[corners[2].value()])
            return damaged(fmt::format("triangle {} lies on face {} of {}", t, id, face_count));
        for (const draco::PointIndex& p : corners)
            out.triangles.push_back(p.value());
        out.triangle_face.push_back(id);
    }
    return sorted_by_face(out);
}

} // namespace

Result<std::vector<std::byte>> encode_proxy(const ProxyMesh& mesh)
{
    if (mesh.triangle_face.empty())
        return std::vector<std::byte>{};
    if (!std::all_of(mesh.positions.begin(), mesh.positions.end(), [](float x) { return std::isfinite(x); }))
        return Error{ErrorCode::InvalidSurface, "proxy mesh", "a vertex is not finite"};
    try {
        const std::unique_ptr<draco::Mesh> in = to_draco(mesh);
        if (!in)
            return Error{ErrorCode::Internal, "proxy mesh", "Draco could not build the mesh"};
        draco::Encoder encoder;
        encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, kProxyPositionBits);
        encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
        encoder.SetSpeedOptions(3, 3); // slower ones gain 1 %
        draco::EncoderBuffer buffer;
        const draco::Status status = encoder.EncodeMeshToBuffer(*in, &buffer);
        if (!status.ok())
            return Error{ErrorCode::Internal, "proxy mesh", status.error_msg_string()};
        const auto* first = reinterpret_cast<const std::byte*>(buffer.data());
        return std::vector<std::byte>(first, first + buffer.size());
    } catch (const std::exception& e) {
        return Error{ErrorCode::Internal, "proxy mesh", e.what()};
    }
}

Result<ProxyMesh> decode_proxy(std::span<const std::byte> bytes, size_t face_count)
{
    if (bytes.empty())
        return ProxyMesh{};
    try {
        draco::DecoderBuffer buffer;
        buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        draco::Decoder decoder;
        draco::StatusOr<std::unique_ptr<draco::Mesh>> decoded = decoder.DecodeMeshFromBuffer(&buffer);
        if (!decoded.ok())
            return damaged(decoded.status().error_msg_string());
        return from_draco(*decoded.value(), face_count);
    } catch (const std::exception& e) {
        return damaged(e.what());
    }
}

} // namespace trimray
