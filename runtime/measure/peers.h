// What our pictures compete with, made from the CAD file itself: the paper's shape of tracer, and triangles.
#pragma once

#include "format/result.h"
#include "runtime/command_converter.h"
#include "runtime/measure/measure.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace trimray {

/// What it takes until there is a picture.
struct Preparation {
    double make_seconds = 0; // reading the CAD file and making the pack or the mesh from it, once
    uint64_t file_bytes = 0; // of the pack, or of the mesh's own file
    // From opening that file, which is in the system's cache, to the picture from iso, on all cores: the median of
    // three; 0: not measured
    double first_picture_ms = 0;
    std::optional<uint64_t> triangles;
};

/// What the paper's first table counts of a model.
struct PaperCounts {
    uint64_t nurbs_surfaces = 0, nurbs_curves = 0;   // faces, and their pcurves
    uint64_t bezier_surfaces = 0, bezier_curves = 0; // patches, and monotone pieces of trims
    uint64_t bytes = 0;                              // in memory
};

struct Peers {
    std::vector<Contender> contenders;
    std::vector<Preparation> preparations; // by contender
    std::optional<PaperCounts> paper;      // of the paper's shape of tracer
    std::vector<std::string> notes;        // peers that could not be made, and why; what is not in others
};

/// Deflections of the meshes, shares of the model's diagonal, coarse to fine.
std::vector<double> mesh_deflections(bool quick);

/// Makes the pack that a user would: native surfaces, everything stored but previews. Notes what is not in it.
/// Fails: as run_converter, load_scene.
Result<Preparation> make_own_pack(const std::string& model, const std::string& pack, const AccuracyOptions& options,
                                  std::vector<std::string>& notes);

/// The paper's shape (all Bezier patches, one leaf each, kd-trees, one ray at a time), the same by our wide tracer,
/// its tenth frame and with the paper's textures too, and a mesh at each deflection, traced by Embree; all on the CPU.
/// `scene` is the model's own pack, whose views all have. A peer that cannot be made is noted. Fails: as bench_view.
Result<Peers> make_peers(const std::string& model, const std::shared_ptr<const Scene>& scene,
                         const ScratchFolder& scratch, const AccuracyOptions& options,
                         const std::function<void(const std::string&)>& progress);

} // namespace trimray
