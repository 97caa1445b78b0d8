// CadModel -> PackImage: the converter's own part, on all cores. Each step is one function from const values to a new
// value.
#pragma once

#include "format/derive.h"
#include "format/pack_image.h"
#include "format/result.h"
#include "preprocess/face_ids.h"
#include "preprocess/import/cad_model.h"
#include "preprocess/trims/trim_loop.h"

#include <string>

namespace trimray {

struct BuildOptions {
    TrimOptions trims;
    LeafOptions leaves;
    TrimTextureOptions trim_textures;
    double trim_memory_fraction = 1.0; // of kd_trim_bytes; used when trim_memory_bytes is negative
    double trim_memory_bytes = -1;
    bool compact = false;
    int threads = 0; // 0: all
};

/// A finding of a face that was converted.
struct FaceFinding {
    uint32_t part = 0, face_in_part = 0;
    TrimFinding finding;
};

struct BuildReport {
    uint32_t faces = 0, converted = 0;
    double convert_seconds = 0, trims_seconds = 0, bvh_seconds = 0, proxy_seconds = 0;
    std::vector<FaceFinding> trim_findings; // by part and face
    std::vector<std::string> warnings;
};

/// What build_pack makes first: the pack without what is derived from it (leaves, trees, cells, textures, proxy).
struct ConvertedFaces {
    PackImage image;
    FaceIds face_ids;
};
ConvertedFaces convert_faces(const CadModel& model, const BuildOptions& options, BuildReport& report);

/// Converts a model. Faces that cannot be converted end in image.dropped with a reason; nothing else is lost.
PackImage build_pack(const CadModel& model, const BuildOptions& options, BuildReport& report);

} // namespace trimray
