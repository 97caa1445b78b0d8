// The synthetic pack with a real proxy: a triangle on each of its four faces.
#pragma once

#include "format/proxy.h"
#include "synthetic_pack.h"

namespace trimray {

/// A triangle on each face of the synthetic pack.
inline ProxyMesh proxy_of_four_faces()
{
    ProxyMesh mesh;
    for (uint f = 0; f < 4; ++f)
        for (uint k = 0; k < 3; ++k) {
            const float z = 0.2f * static_cast<float>(f);
            for (const float x : {k == 1 ? 0.9f : -0.9f, k == 2 ? 0.9f : -0.9f, z})
                mesh.positions.push_back(x);
            mesh.triangles.push_back(3 * f + k);
            if (k == 0)
                mesh.triangle_face.push_back(f);
        }
    return mesh;
}

inline PackImage image_with_proxy()
{
    PackImage image = synthetic_image();
    image.proxy_draco = *encode_proxy(proxy_of_four_faces());
    return image;
}

} // namespace trimray
