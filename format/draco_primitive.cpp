#include "format/draco_primitive.h"

#include <algorithm>
#include <exception>
#include <memory>

#include <draco/compression/decode.h>
#include <draco/compression/encode.h>
#include <draco/mesh/mesh.h>

namespace trimray {
namespace {

constexpr int kPositionBits = 14;
constexpr int kNormalBits = 10;

int add_attribute(draco::Mesh& mesh, draco::GeometryAttribute::Type type, const std::vector<float>& values)
{
    draco::GeometryAttribute attribute;
    attribute.Init(type, nullptr, 3, draco::DT_FLOAT32, false, 3 * sizeof(float), 0);
    const auto count = static_cast<uint32_t>(values.size() / 3);
    const int id = mesh.AddAttribute(attribute, true, count);
    for (uint32_t i = 0; i < count; ++i)
        mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), &values[3 * size_t{i}]);
    return id;
}

Error encoder_error(const std::string& detail)
{
    return {ErrorCode::Internal, "Draco", detail};
}

Result<DracoPrimitive> encode(const TriangleMesh& in)
{
    draco::Mesh mesh;
    mesh.set_num_points(static_cast<uint32_t>(in.positions.size() / 3));
    mesh.SetNumFaces(in.indices.size() / 3);
    for (uint32_t t = 0; t < mesh.num_faces(); ++t) {
        draco::Mesh::Face face;
        for (size_t k = 0; k < 3; ++k)
            face[k] = draco::PointIndex(in.indices[3 * size_t{t} + k]);
        mesh.SetFace(draco::FaceIndex(t), face);
    }
    const int position = add_attribute(mesh, draco::GeometryAttribute::POSITION, in.positions);
    const int normal = add_attribute(mesh, draco::GeometryAttribute::NORMAL, in.normals);

    DracoPrimitive out;
    out.position_id = mesh.attribute(position)->unique_id();
    out.normal_id = mesh.attribute(normal)->unique_id();
    draco::Encoder encoder;
    encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, kPositionBits);
    encoder.SetAttributeQuantization(draco::GeometryAttribute::NORMAL, kNormalBits);
    draco::EncoderBuffer buffer;
    const draco::Status status = encoder.EncodeMeshToBuffer(mesh, &buffer);
    if (!status.ok())
        return encoder_error(status.error_msg_string());
    const auto* first = reinterpret_cast<const std::byte*>(buffer.data());
    out.bytes.assign(first, first + buffer.size());

    // the encoder may merge and split vertices: what a reader will see is known by reading
    draco::DecoderBuffer encoded;
    encoded.Init(buffer.data(), buffer.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&encoded);
    if (!decoded.ok())
        return encoder_error(decoded.status().error_msg_string());
    const draco::Mesh& seen = *decoded.value();
    const draco::PointAttribute* positions = seen.GetNamedAttribute(draco::GeometryAttribute::POSITION);
    out.vertex_count = seen.num_points();
    out.index_count = 3 * seen.num_faces();
    for (uint32_t p = 0; p < seen.num_points(); ++p) {
        std::array<float, 3> x;
        positions->GetMappedValue(draco::PointIndex(p), x.data());
        for (size_t axis = 0; axis < 3; ++axis) {
            out.lo[axis] = p == 0 ? x[axis] : std::min(out.lo[axis], x[axis]);
            out.hi[axis] = p == 0 ? x[axis] : std::max(out.hi[axis], x[axis]);
        }
    }
    return out;
}

} // namespace

Result<DracoPrimitive> encode_draco_primitive(const TriangleMesh& mesh)
{
    try {
        return encode(mesh);
    } catch (const std::exception& e) {
        return encoder_error(e.what());
    }
}

} // namespace trimray
