#include "preprocess/proxy_mesh.h"

#include <cmath>

namespace trimray {

ProxyMesh collect_proxy(const CadModel& model, const PackImage& image, const FaceIds& face_ids)
{
    ProxyMesh proxy;
    for (size_t part = 0; part < model.parts.size(); ++part) {
        const CadMesh& mesh = model.parts[part].mesh;
        const PartRecord& record = image.parts[part];
        const uint first_vertex = static_cast<uint>(proxy.positions.size() / 3);
        for (size_t i = 0; i < mesh.positions.size(); ++i)
            proxy.positions.push_back(static_cast<float>(
                (mesh.origin_mm[i % 3] + mesh.positions[i] - record.origin_mm[i % 3]) / record.scale_mm));
        for (size_t t = 0; t < mesh.triangle_face.size(); ++t) {
            const uint face = face_ids[part][mesh.triangle_face[t]];
            if (face == kNotConverted)
                continue;
            for (size_t k = 0; k < 3; ++k)
                proxy.triangles.push_back(first_vertex + mesh.triangles[3 * t + k]);
            proxy.triangle_face.push_back(face);
        }
    }
    return proxy;
}

} // namespace trimray
