// One glTF primitive as Draco bytes (KHR_draco_mesh_compression). Beside the proxy, so that Draco is in one library.
#pragma once

#include "format/pack_layout.h"
#include "format/result.h"

#include <array>
#include <cstddef>
#include <vector>

namespace trimray {

/// Triangles with a normal at each vertex.
struct TriangleMesh {
    std::vector<float> positions; // x, y, z
    std::vector<float> normals;   // unit
    std::vector<uint> indices;    // three a triangle
};

/// What a decoder will find in `bytes`: glTF states it outside of them.
struct DracoPrimitive {
    std::vector<std::byte> bytes;
    uint vertex_count = 0, index_count = 0;
    uint position_id = 0, normal_id = 0; // Draco's unique ids of the attributes
    std::array<float, 3> lo{}, hi{};     // bounds of the decoded positions
};

/// Positions are rounded to 14 bits of their bounds, normals to 10. Fails: Internal (what the encoder says).
Result<DracoPrimitive> encode_draco_primitive(const TriangleMesh& mesh);

} // namespace trimray
