// Closed shells: faces that meet along all their edges, two at each, with their normals outwards. From outside none of
// them shows its back, so what grown borders show of it can be left out (FaceRecord, kFaceRims).
#pragma once

#include "preprocess/cad_model.h"
#include "preprocess/trim_loop.h"

#include <cstdint>
#include <vector>

namespace trimray {

/// A face with its trims as they go into a pack; no trims: dropped.
struct ShellFace {
    const CadFace* cad = nullptr;
    const TrimLoops* trims = nullptr;
};

/// For each face of a part, 1 if it belongs to a closed shell: a set of faces, connected by edges, each of whose edges
/// is walked once each way and whose volume, by sampling, is positive. 0 for faces without edges, which end nowhere.
std::vector<uint8_t> in_closed_shells(const std::vector<ShellFace>& faces, size_t edge_count);

/// The rim fields of FaceRecord::flags for a face of a closed shell whose border was moved outwards; 0: it was not.
uint32_t rim_flags(const CadSurface& surface, const TrimLoops& trims);

} // namespace trimray
