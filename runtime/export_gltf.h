// A pack's proxy mesh as glTF 2.0 binary (.glb): the assembly tree as nodes, names, colours, placements that share
// their part's mesh. Source: glTF 2.0 and KHR_draco_mesh_compression, registry.khronos.org.
#pragma once

#include "format/pack_image.h"
#include "format/result.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace trimray {

struct GltfOptions {
    bool draco = false; // compress the meshes; readers then need KHR_draco_mesh_compression
};

struct GltfExport {
    std::vector<std::byte> glb;
    uint64_t nodes = 0, meshes = 0, materials = 0, triangles = 0; // triangles: of all placements
};

/// CAD is in millimetres with z up, glTF in metres with y up: the root node turns and scales. Vertices are in part
/// units, the placement's node takes them to millimetres. Fails: UnsupportedPackFeature (the pack has no proxy mesh),
/// InvalidPack, Internal.
Result<GltfExport> export_gltf(const PackImage& image, const GltfOptions& options);

} // namespace trimray
