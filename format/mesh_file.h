// A model as triangles: what a picture of the surfaces is compared with. Its faces, instances and colours are those of
// the model's pack, by the same numbers.
//
// A .trimesh file is, little-endian and without gaps: MeshHeader, then `parts` MeshParts, `instances` MeshInstances,
// `faces` MeshFaces, then float positions[3 * vertices], float normals[3 * vertices], uint32 triangles[3 * triangles],
// uint32 triangle_face[triangles], and the XXH3 of all bytes before it in 8 bytes.
#pragma once

#include "format/result.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace trimray {

/// Triangles [first_triangle, first_triangle + triangle_count); the parts' follow each other.
struct MeshPart {
    double origin_mm[3]; // of its vertices' positions, part axes
    uint32_t first_triangle, triangle_count;
};

/// As the pack's InstanceRecord.
struct MeshInstance {
    double transform[12]; // row-major 3x4, part mm to world mm
    uint32_t part;
    uint32_t color_rgba; // of faces without their own; alpha 0: none, the default grey
};

struct MeshFace {
    uint32_t color_rgba; // sRGB, R in the low byte
    uint32_t has_color;  // 1, or 0: the instance's
};

struct TriangleMesh {
    double deflection_mm = 0; // how far off the surfaces triangles were allowed to lie
    std::vector<MeshPart> parts;
    std::vector<MeshInstance> instances;
    std::vector<MeshFace> faces;
    std::vector<float> positions;        // x, y, z; mm from the part's origin, part axes
    std::vector<float> normals;          // x, y, z; of the surface there, unit, outward, part axes
    std::vector<uint32_t> triangles;     // three vertices each
    std::vector<uint32_t> triangle_face; // index into faces
};

// so that three numbers a vertex, and three vertices a triangle, have indices below 2^31
inline constexpr uint64_t kMaxMeshVertices = 1u << 29, kMaxMeshTriangles = 1u << 29;

struct MeshHeader {
    unsigned char identifier[12];
    uint32_t version;
    double deflection_mm;
    uint64_t parts, instances, faces, vertices, triangles;
};
static_assert(sizeof(MeshPart) == 32 && sizeof(MeshInstance) == 104 && sizeof(MeshFace) == 8);
static_assert(sizeof(MeshHeader) == 64);

/// The file's bytes; the same mesh gives the same bytes. Domain: arrays whose lengths fit each other.
std::vector<std::byte> encode_mesh(const TriangleMesh& mesh);

/// The mesh that the bytes hold. Every count and index has been checked, numbers are finite, normals unit, placements
/// not flat. Fails: InvalidMesh, UnsupportedFormat (another version).
Result<TriangleMesh> decode_mesh(std::span<const std::byte> bytes);

/// Likewise, of a file. Fails: FileNotFound, FileNotReadable too.
Result<TriangleMesh> read_mesh(const std::string& path);

} // namespace trimray
