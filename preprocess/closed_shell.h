// Closed shells: faces that meet along all their edges, two at each, with their normals outwards. From outside none of
// them shows its back, so what grown borders show of it can be left out (FaceRecord, kFaceRims).
#pragma once

#include "preprocess/import/cad_model.h"
#include "preprocess/trims/trim_loop.h"

#include <cstdint>
#include <vector>

namespace trimray {

/// A face with its trims as they go into a pack; no trims: dropped.
struct ShellFace {
    const CadFace* cad = nullptr;
    const TrimLoops* trims = nullptr;
};

/// What the orientations of a part's faces make of it.
struct ClosedShells {
    /// For each face, 1 if it belongs to a closed shell: a set of faces, connected by edges, each of whose edges is
    /// walked once each way and whose volume, by sampling, is positive. 0 for faces without edges, which end nowhere.
    std::vector<uint8_t> in_one;
    bool inside_out = false;     // sets that would be closed shells have, all together, a negative volume
    uint32_t disputed_edges = 0; // whose two faces walk them the same way: one of the two is turned round
};
ClosedShells find_closed_shells(const std::vector<ShellFace>& faces, size_t edge_count);

/// The rim fields of FaceRecord::flags for a face of a closed shell whose border was moved outwards; 0: it was not.
uint32_t rim_flags(const CadSurface& surface, const TrimLoops& trims);

} // namespace trimray
