// Pictures of a model's triangles by Embree: what a picture of its surfaces competes with. 16 rays at a time, those of
// the CPU tracer's packets, shaded by the CPU tracer's own code, so that neither has an advantage there.
#pragma once

#include "format/mesh_file.h"
#include "format/result.h"
#include "runtime/tracer.h"

#include <memory>
#include <string>

namespace trimray {

/// Takes a mesh as read_mesh gives it, and builds Embree's trees, on all cores. Its pictures hold what the CPU tracer's
/// hold of the surfaces, but uv, which is 0; normals are interpolated between the vertices', and all pixels are
/// certified, for of triangles nothing stays open. stats.buffer_bytes is what Embree has allocated and the mesh's
/// arrays. It does parallel rays, but nothing else that a SceneLook asks for and no lines: render fails as the
/// reference's (make_reference_tracer). The same bits on any number of threads; Embree's own arithmetic differs between
/// instruction sets. Fails: InvalidMesh (no triangles), DeviceFailed (Embree's words).
Result<std::unique_ptr<Tracer>> make_mesh_tracer(TriangleMesh mesh);

/// Of the mesh in a file. Fails: as read_mesh and make_mesh_tracer.
Result<std::unique_ptr<Tracer>> open_mesh(const std::string& path);

} // namespace trimray
