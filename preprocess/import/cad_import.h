// Import of CAD files through OpenCASCADE's document readers. cad_import*.cpp are the only files that include its
// headers.
#pragma once

#include "format/result.h"
#include "preprocess/import/cad_model.h"

#include <functional>
#include <string>

namespace trimray {

struct ImportOptions {
    bool heal = false;                     // run the kernel's shape healing: slow, off where nothing is lost without it
    bool native_surfaces = true;           // false: every surface as a B-spline, pcurves following (--surfaces bezier)
    double approximation_tolerance_mm = 0; // for offsets and the like; 0: 1e-6 of the part's size
    std::string file_name;                 // as its user has it, where `path` is a temporary; empty: as in `path`
    double proxy_deflection = 0.02;        // of the proxy mesh, relative to the part's diagonal; 0: no mesh
    double mesh_deflection = 0; // above 0: in the proxy's place a mesh with normals, relative to the model's diagonal
};

/// Called with a phase's name and its share done in [0,1], or a negative share where the kernel does not tell.
using Progress = std::function<void(const char* phase, double share)>;

/// Reads a STEP, IGES or BREP file, by its content. A model that does not name itself gets the file's name. Lengths
/// come back in millimetres. Fails: FileNotFound, FileNotReadable, InvalidCad, EmptyCad, UnsupportedFormat. The kernel
/// may crash or hang on damaged files: callers run this in a process of its own (see worker.h).
Result<CadModel> import_cad(const std::string& path, const ImportOptions& options, const Progress& progress);

/// "OpenCASCADE 7.6.3": what a conversion depends on beside its input and options.
std::string kernel_version();

} // namespace trimray
