// The proxy: coarse triangles of all parts, compressed with Draco, for thumbnails, a first picture and export. Its
// bytes are a pack's section `prox` (SPEC.md, "Proxy mesh"). A library of its own: only what exports or converts links
// Draco.
#pragma once

#include "format/pack_layout.h"
#include "format/result.h"

#include <cstddef>
#include <span>
#include <vector>

namespace trimray {

/// Triangles with the face that each lies on; the face says the part.
struct ProxyMesh {
    std::vector<float> positions;    // x, y, z; part units of the face's part
    std::vector<uint> triangles;     // three vertices each
    std::vector<uint> triangle_face; // index into the pack's faces
};

inline constexpr int kProxyPositionBits = 11; // 1/2000 of a part: finer than the triangles are coarse
inline constexpr size_t kMaxProxyTriangles = 1u << 26;

/// Returns the Draco bytes; the same mesh gives the same bytes. Triangles without area after rounding are left out by
/// the encoder. An empty mesh gives no bytes. Fails: Internal (what the encoder says), InvalidSurface (not finite).
Result<std::vector<std::byte>> encode_proxy(const ProxyMesh& mesh);

/// Returns the mesh, triangles sorted by face, for a pack of `face_count` faces. The bytes are hostile until decoded.
/// Fails: InvalidPack.
Result<ProxyMesh> decode_proxy(std::span<const std::byte> bytes, size_t face_count);

} // namespace trimray
