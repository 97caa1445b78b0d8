// The vector part of the mesh tracer: packets of 16 rays through Embree into the frame.
#pragma once

#include "format/mesh_file.h"
#include "runtime/cpu_lanes.h"

#include <embree3/rtcore.h>

#include <cstdint>

namespace trimray {

struct MeshJob {
    const BlockJob& block; // its scene has the mesh's instances and the colours of its faces, but no patches
    const TriangleMesh& mesh;
    RTCScene scene;                 // an instance of each placement, by its number
    const uint32_t* first_triangle; // by instance
    // rays begin at tau = tau_ref - before_mm: the ray of (x, y) at start + x start_x + y start_y, in the scene's axes
    float start[3], start_x[3], start_y[3];
    float before_mm;
};

/// Traces the block into `frame`, whose arrays have their size, by the best instruction set of this machine.
void trace_mesh_block(const MeshJob& job, const Block& block, Strip& strip, Frame& frame, WorkCounts& work);

} // namespace trimray
