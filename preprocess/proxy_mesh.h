// The kernel's coarse triangles of all parts -> the pack's proxy mesh, in part units and with the pack's face ids.
#pragma once

#include "format/pack_image.h"
#include "format/proxy.h"
#include "preprocess/face_ids.h"
#include "preprocess/import/cad_model.h"

namespace trimray {

/// Returns the triangles of converted faces.
ProxyMesh collect_proxy(const CadModel& model, const PackImage& image, const FaceIds& face_ids);

} // namespace trimray
