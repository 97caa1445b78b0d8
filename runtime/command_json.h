// The JSON objects that several subcommands share. Keys and their order are a contract with outside programs.
#pragma once

#include "format/pack_reader.h"
#include "runtime/effect_plan.h"

#include <nlohmann/json.hpp>

#include <span>
#include <string>

namespace trimray {

using Json = nlohmann::ordered_json;

/// One line, UTF-8; bytes of a name that are not UTF-8 become U+FFFD.
void print_json(const Json& object);

/// What a scene calls for, a line each; as a list of {name, why}.
void print_plan(const EffectPlan& plan);
Json plan_json(const EffectPlan& plan);

/// Bytes a scene's arrays take in memory. geometry: parts, placements, faces, patches, control points; bvh: leaves and
/// nodes; trim_exact: pieces and cells; trim_sdf: distance textures; trim_kd and
/// borders (the cells that lines and smoothed trims are looked up in): 0, for they are no part of a pack; render
/// reports those that it built.
struct MemoryBytes {
    uint64_t geometry = 0, bvh = 0, trim_exact = 0, trim_sdf = 0, trim_kd = 0, borders = 0;
    uint64_t total() const { return geometry + bvh + trim_exact + trim_sdf + trim_kd + borders; }
};
MemoryBytes memory_bytes(const PackImage& image);
/// The key "borders" is there only where they are.
Json to_json(const MemoryBytes& bytes);

} // namespace trimray
