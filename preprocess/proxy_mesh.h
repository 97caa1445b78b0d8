// The kernel's coarse triangles of all parts -> the pack's proxy mesh, in part units and with the pack's face ids.
#pragma once

#include "format/pack_image.h"
#include "format/proxy.h"
#include "preprocess/cad_model.h"

#include <vector>

namespace trimray {

/// A face that was not converted has no id in the pack.
inline constexpr uint kNotConverted = 0xffffffffu;

/// Returns the triangles of converted faces. face_ids[part][face in CadPart::faces] is the face's id in the pack.
ProxyMesh collect_proxy(const CadModel& model, const PackImage& image, const std::vector<std::vector<uint>>& face_ids);

} // namespace trimray
