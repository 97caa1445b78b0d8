// The kernel's triangles of all parts -> a mesh that has the faces, placements and colours of the model's pack.
#pragma once

#include "format/mesh_file.h"
#include "preprocess/build_pack.h"
#include "preprocess/import/cad_model.h"

#include <vector>

namespace trimray {

/// Returns the triangles of converted faces. Domain: a model imported with mesh_deflection, and what convert_faces made
/// of it. Fails: Usage, where there are more triangles or vertices than a mesh holds.
Result<TriangleMesh> collect_mesh(const CadModel& model, const ConvertedFaces& converted);

/// The pack's faces that have no triangle, ascending.
std::vector<uint> faces_without_triangles(const TriangleMesh& mesh);

} // namespace trimray
